// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <tofgraph/channels.hpp>
#include <tofgraph/stage.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>

#include "devices/camcube/pmd_session.hpp"
#include "devices/camcube/raw_output.hpp"

namespace tofgraph::camcube {
namespace {

/// Corrections by the vendor's software that would precede the project's models: command, and whether it is for the
/// processing plugin.
constexpr std::pair<const char*, bool> calibrations[] = {{"SetFPNCalibration", false},
                                                         {"SetLensCalibration", false},
                                                         {"SetFPPNCalibration", true},
                                                         {"SetLinearityCalibration", true},
                                                         {"SetLensCalibration", true}};

template <class T> Array<T> image(const Frame& frame, const char* name, const char* unit, const RawSourceData& layout) {
  tofgraph_channel channel{};
  channel.size = sizeof channel;
  channel.name = name;
  channel.unit = unit;
  channel.type = element_type<T>();
  channel.rank = 2;
  channel.extent[0] = layout.rows;
  channel.extent[1] = layout.columns;
  return Array<T>(frame.write(channel));
}

class PmdSdk final : public Backend {
 public:
  PmdSdk(const Stage& stage, const Settings& settings) : stage_(stage), settings_(settings), layout_(settings.layout) {}
  ~PmdSdk() override { close(); }

  Delivery open() override {
    if (!library_) library_ = std::make_shared<const PmdLibrary>(settings_.library);
    if (!stuck_.expired())
      throw NotFound("backend", fmt::format("a call of the vendor's library {} has not returned yet: the camera cannot "
                                            "be opened again before",
                                            library_->path()));
    session_ = std::make_shared<PmdSession>(library_, settings_);
    frame_.bytes.resize(session_->frame_bytes());
    try {
      apply_settings();
    } catch (...) {
      close();
      throw;
    }
    const double time = session_->number("IntegrationTime", 1e-6), own = session_->number("ModulationFrequency", 1);
    const double frequency = std::isfinite(own) ? own : settings_.nominal_frequency;
    session_->set_defaults(time, frequency);
    Delivery delivery;
    delivery.channels = settings_.vendor_images
                            ? std::vector<std::string>{"distance", "amplitude", "intensity", "flags"}
                            : std::vector<std::string>{"taps", "raw_headers"};
    delivery.known = TOFGRAPH_KNOWS_TIMESTAMP | (std::isfinite(time) ? TOFGRAPH_KNOWS_INTEGRATION_TIME + 0U : 0U) |
                     (std::isfinite(frequency) ? TOFGRAPH_KNOWS_MODULATION_FREQUENCY + 0U : 0U);
    delivery.serial = serial();
    delivery.text =
        fmt::format("camera{} through the vendor's library {} ({})",
                    delivery.serial.empty() ? "" : " with serial " + delivery.serial, library_->path(), unverified);
    return delivery;
  }

  void close() noexcept override {
    if (session_) {
      lost_frames_ += session_->frames().lost_frames();
      if (!PmdSession::close(session_)) stuck_ = session_;
    }
    session_.reset();
    started_ = false;
  }

  std::string why_not_adjustable() const override { return {}; }
  void set_integration_time(double time) override { session_->change_integration_time(time); }

  std::uint64_t lost_frames() const override {
    return lost_frames_ + (session_ ? session_->frames().lost_frames() : 0);
  }

  Got read(Frame& frame, std::chrono::milliseconds patience) override {
    if (!started_) session_->start();
    started_ = true;
    if (!session_->frames().take(frame_, patience)) return Got::nothing;
    tofgraph_metadata& metadata = frame.metadata();
    metadata.device_number = frame_.number;
    metadata.timestamp_ns = frame_.timestamp_ns;
    metadata.integration_time = frame_.integration_time;
    metadata.modulation_frequency = frame_.modulation_frequency;
    layout_.big_endian = session_->big_endian();
    if (settings_.vendor_images)
      write_images(frame);
    else
      write_raw(layout_, frame_.bytes, frame);
    return Got::frame;
  }

 private:
  void apply_settings() {
    if (!settings_.vendor_calibration) switch_calibrations_off();
    if (!settings_.roi.empty()) session_->command("roi", "SetROI " + settings_.roi, false);
    if (!settings_.exposure_mode.empty())
      session_->command("exposure_mode", "SetExposureMode " + settings_.exposure_mode, false);
    std::istringstream commands(settings_.commands);
    for (std::string text; std::getline(commands, text, ';');) {
      text.erase(0, text.find_first_not_of(' '));
      constexpr std::string_view processing = "processing ";
      const bool to_processing = text.starts_with(processing);
      if (!text.empty())
        session_->command("commands", to_processing ? text.substr(processing.size()) : text, to_processing);
    }
    if (std::isfinite(settings_.modulation_frequency))
      session_->set_number("modulation_frequency", "ModulationFrequency", "Hz", 1, settings_.modulation_frequency);
    if (std::isfinite(settings_.integration_time))
      session_->set_number("integration_time", "IntegrationTime", "s", 1e-6, settings_.integration_time);
  }

  void switch_calibrations_off() {
    std::string unknown;
    for (const auto& [command, processing] : calibrations) {
      if (!session_->try_command(fmt::format("{} Off", command), processing).empty())
        unknown +=
            fmt::format("{}{} ({} plugin)", unknown.empty() ? "" : ", ", command, processing ? "processing" : "source");
    }
    if (told_) return;
    told_ = true;
    if (!unknown.empty())
      stage_.warn("the camera does not take these commands, whether these calibrations are on is not known: " +
                  unknown);
    stage_.note(
        "the vendor's calibrations (FPN, FPPN, linearity, lens) are switched off: distances are those that the camera "
        "measures; vendor_calibration: true leaves them as they are");
  }

  std::string serial() const {
    try {
      return session_->command("commands", "GetSerialNumber", false);
    } catch (const SettingError&) {  // not every plugin supports it
      return {};
    }
  }

  /// Writes images. Only flag bits with equal meaning are kept; an invalid pixel has no length.
  void write_images(const Frame& frame) const {
    const std::size_t n = layout_.pixels();
    const auto distance = image<float>(frame, "distance", "m", layout_);
    const auto amplitude = image<float>(frame, "amplitude", "counts", layout_);
    const auto intensity = image<float>(frame, "intensity", "counts", layout_);
    const auto flags = image<std::uint16_t>(frame, "flags", "", layout_);
    const std::uint8_t* at = frame_.bytes.data();
    for (float* values : {distance.data(), amplitude.data(), intensity.data()}) {
      std::memcpy(values, at, n * sizeof(float));
      at += n * sizeof(float);
    }
    for (std::size_t i = 0; i < n; ++i) {
      unsigned vendor = 0;
      std::memcpy(&vendor, at + i * sizeof vendor, sizeof vendor);
      flags[i] = static_cast<std::uint16_t>(vendor & pmd::common_flags);
      if (std::isnan(distance[i])) flags[i] |= flag::invalid;
      if ((flags[i] & flag::invalid) != 0) distance[i] = std::numeric_limits<float>::quiet_NaN();
    }
  }

  const Stage& stage_;
  const Settings& settings_;
  RawSourceData layout_;
  std::shared_ptr<const PmdLibrary> library_;
  std::shared_ptr<PmdSession> session_;
  std::weak_ptr<PmdSession> stuck_;  // closed, but its thread is still waiting in the library
  RawFrame frame_;
  std::uint64_t lost_frames_ = 0;
  bool started_ = false, told_ = false;
};

}  // namespace

BackendPtr make_pmdsdk(const Stage& stage, const Settings& settings) {
  return std::make_unique<PmdSdk>(stage, settings);
}

}  // namespace tofgraph::camcube
