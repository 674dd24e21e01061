// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>

#include "config/quantity.hpp"
#include "devices/camcube/frame_assembler.hpp"
#include "devices/camcube/raw_output.hpp"
#include "devices/camcube/usb_device.hpp"
#include "devices/camcube/usb_transport.hpp"

namespace tofgraph::camcube {
namespace {

constexpr std::size_t waiting_frames = 8;

class Usb final : public Backend {
 public:
  Usb(const Stage&, const Settings& settings)
      : settings_(settings), frames_(waiting_frames, settings.layout.frame_bytes()) {
    frame_.bytes.resize(settings.layout.frame_bytes());
  }
  ~Usb() override { close(); }

  Delivery open() override {
    read_description();
    check_settings();
    context_ = make_usb_context();
    device_ = std::make_unique<UsbDevice>(context_.get(), protocol_, settings_.device);
    try {
      device_->command("identify", values_);
      if (values_.integration_time_us != 0) device_->command("integration_time", values_);
      if (values_.modulation_frequency_hz != 0) device_->command("modulation_frequency", values_);
    } catch (const Fault& fault) {
      close();
      throw SettingError("backend", fault.what());
    }
    assembler_ = std::make_unique<FrameAssembler>(protocol_, settings_.layout, defaults_, frames_);
    Delivery delivery;
    delivery.channels = {"taps", "raw_headers"};
    delivery.known = TOFGRAPH_KNOWS_TIMESTAMP;
    if (protocol_.integration_time || std::isfinite(defaults_.integration_time))
      delivery.known |= TOFGRAPH_KNOWS_INTEGRATION_TIME;
    if (protocol_.modulation_frequency || std::isfinite(defaults_.modulation_frequency))
      delivery.known |= TOFGRAPH_KNOWS_MODULATION_FREQUENCY;
    delivery.serial = device_->camera().serial;
    delivery.text = fmt::format("{} over USB as '{}' ({})", device_->camera().text(), protocol_.name, unverified);
    return delivery;
  }

  void close() noexcept override {
    if (transport_) {
      transport_->stop();  // must precede any synchronous transfer
      try {
        if (transport_->all_came_back()) device_->command("stop", values_);
      } catch (const std::exception&) {  // it may have been unplugged
      }
      transport_.reset();
    }
    assembler_.reset();
    device_.reset();
    context_.reset();
    frames_.clear();
  }

  Got read(Frame& frame, std::chrono::milliseconds patience) override {
    if (!transport_) start();
    if (!frames_.take(frame_, patience)) return Got::nothing;
    tofgraph_metadata& metadata = frame.metadata();
    metadata.device_number = frame_.number;
    metadata.timestamp_ns = frame_.timestamp_ns;
    metadata.integration_time = frame_.integration_time;
    metadata.modulation_frequency = frame_.modulation_frequency;
    write_raw(settings_.layout, frame_.bytes, frame);
    return Got::frame;
  }

  std::string why_not_adjustable() const override {
    if (protocol_.integration_time && protocol_.has("integration_time")) return {};
    return fmt::format("the protocol description {} has no command for it, or no place where the headers tell it",
                       protocol_.file.string());
  }
  double longest_integration_time() const override {
    double most = protocol_.integration_time ? protocol_.integration_time->type.greatest() : 0;
    const auto command = protocol_.commands.find("integration_time");
    if (command == protocol_.commands.end()) return most * 1e-6;
    for (const Step& step : command->second)
      for (const Step::Part& part : step.data)
        if (part.value == &CommandValues::integration_time_us) most = std::min(most, part.type.greatest());
    return most * 1e-6;
  }
  void set_integration_time(double time) override {
    CommandValues values = values_;
    values.integration_time_us = static_cast<std::uint64_t>(std::llround(time * 1e6));
    if (transport_) transport_->post([this, values] { device_->command("integration_time", values); });
  }

  std::uint64_t lost_frames() const override { return frames_.lost_frames(); }
  void stop() noexcept override { frames_.wake(); }

 private:
  void read_description() {
    try {
      protocol_ = read_protocol(settings_.protocol.empty() ? shipped_file("software_camera.yaml")
                                                           : std::filesystem::path(settings_.protocol));
    } catch (const std::exception& error) {
      throw SettingError("protocol", error.what());
    }
  }

  void check_settings() {
    defaults_.integration_time = settings_.integration_time;
    defaults_.modulation_frequency =
        std::isfinite(settings_.modulation_frequency) ? settings_.modulation_frequency : settings_.nominal_frequency;
    if (std::isfinite(settings_.integration_range[1])) defaults_.longest_time = settings_.integration_range[1];
    values_ = {};
    if (std::isfinite(settings_.integration_time)) {
      check_integration_time(settings_);
      needs_command("integration_time");
      values_.integration_time_us = static_cast<std::uint64_t>(std::llround(settings_.integration_time * 1e6));
    }
    if (std::isfinite(settings_.modulation_frequency)) {
      needs_command("modulation_frequency");
      values_.modulation_frequency_hz = static_cast<std::uint64_t>(std::llround(settings_.modulation_frequency));
    }
    check_memory();
    for (const auto& [name, steps] : protocol_.commands) {
      try {
        for (const Step& step : steps) static_cast<void>(step.bytes(values_));
      } catch (const std::out_of_range& error) {
        throw SettingError(name, error.what());
      }
    }
  }

  /// Checks the USB memory before the camera is started, with the remedy in the message.
  void check_memory() const {
    const std::size_t message = settings_.layout.frame_bytes() / (protocol_.whole_frames ? 1 : RawSourceData::images);
    const std::size_t needed = protocol_.transfers * message, most = usb_memory();
    if (most == 0 || needed <= most) return;
    throw SettingError(
        "protocol", fmt::format("{}: {} transfers of {} bytes need {} MB, the system gives {} MB to USB: "
                                "'transfers' may be {} here, or write a greater number into {}",
                                protocol_.file.string(), protocol_.transfers, message, (needed + 999'999) / 1'000'000,
                                most / 1'000'000, most / message, usb_memory_file));
  }

  void needs_command(const std::string& name) const {
    if (!protocol_.has(name))
      throw SettingError(name,
                         fmt::format("the protocol description {} has no command for it", protocol_.file.string()));
  }

  void start() {
    transport_ = std::make_unique<UsbTransport>(
        context_.get(), device_->handle(), protocol_.endpoint, protocol_.transfers, assembler_->message_bytes(),
        TransportEvents{[this](std::span<const std::uint8_t> bytes) { assembler_->message(bytes); },
                        [this] { assembler_->interrupted(); }, [this](const Fault& fault) { frames_.fail(fault); }});
    transport_->submit();
    device_->command("start", values_);
    transport_->run();
  }

  const Settings& settings_;
  Protocol protocol_;
  CommandValues values_;
  FrameDefaults defaults_{};
  FrameExchange frames_;
  RawFrame frame_;  // of the reading thread
  UsbContext context_{nullptr, libusb_exit};
  std::unique_ptr<UsbDevice> device_;
  std::unique_ptr<FrameAssembler> assembler_;
  std::unique_ptr<UsbTransport> transport_;
};

}  // namespace

BackendPtr make_usb(const Stage& stage, const Settings& settings) { return std::make_unique<Usb>(stage, settings); }

}  // namespace tofgraph::camcube
