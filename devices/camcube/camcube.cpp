// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Live camera: found, opened, read, and reopened when it comes back.
#include <fmt/format.h>
#include <tofgraph/stage.hpp>

#include <atomic>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "config/json_text.hpp"
#include "config/lost_frames.hpp"
#include "config/quantity.hpp"
#include "devices/camcube/backend.hpp"
#include "devices/camcube/camcube_parameters.hpp"
#include "devices/camcube/frame_counter.hpp"
#include "devices/camcube/integration_control.hpp"

namespace tofgraph {

using camcube::Backend;
using camcube::Fault;

/// Source for all backends, which deliver the same frames for the same raw data. A fault ends the run; with `reconnect`
/// only the frames concerned are lost, which leaves a gap in the frame counter.
struct CamCube final : CamCubeParameters {
  void prepare(Setup& setup) {
    try {
      find_camera(setup);
    } catch (const camcube::SettingError& error) {
      throw ConfigError(error.parameter, error.what());
    }
  }

  bool process(Frame& frame) {
    if (!started_) begin();
    while (!ending()) {
      try {
        if (later_) throw *std::exchange(later_, std::nullopt);
        switch (camera_->read(frame, patience)) {
          case Backend::Got::end:
            return false;
          case Backend::Got::frame:
            arrived(frame);
            if (control_) adjust(frame);
            return true;
          case Backend::Got::nothing:
            check_that_it_answers();
        }
      } catch (const Fault& fault) {
        if (!*reconnect)
          throw std::runtime_error(
              fmt::format("{}\n         reconnect: true goes on after such a fault", fault.what()));
        recover(fault);
      }
    }
    return false;
  }

  void finish() {
    camera_->close();
    if (const std::uint64_t frames = camera_->lost_frames(); frames != 0) warn(config::lost_frames_text(frames));
  }
  void stop() {
    stopped_ = true;
    if (camera_) camera_->stop();
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds patience{50}, retry{100};
  static constexpr int max_faults = 8;  ///< consecutive faults without a frame before the device is reopened

  void find_camera(Setup& setup) {
    read_parameters();
    const std::string wanted = chosen_backend();
    std::string used = wanted;
    camcube::Delivery delivery;
    if (wanted == "replay" || wanted == "simulated") {
      camera_ = make(wanted);
      camera_->prepare(setup);
      take_camera(setup);
      prepare_control(setup);
      delivery = camera_->open();
    } else {
      take_camera(setup);
      prepare_control(setup);
      delivery = wanted == "auto" ? first_that_finds_a_camera(used) : (camera_ = make(wanted))->open();
    }
    provide(setup, delivery);
    is_device_ = used == "usb" || used == "pmdsdk";
    description_ = delivery.text;
    if (limits_) check_control(delivery);
    note(description_);
    nlohmann::json source = {{"backend", used}, {"live", delivery.live}};
    if (!delivery.serial.empty()) source["serial"] = delivery.serial;
    host->set_source(context, config::json_text(source).c_str());
  }

  /// Prepares the control of the integration time, which may change the initial time.
  void prepare_control(const Setup& setup) {
    if (!*auto_integration_time) return;
    if (!(*amplitude_low < *amplitude_high))
      throw ConfigError("amplitude_high", "must be greater than amplitude_low, e.g. amplitude_high: 8000 counts");
    camcube::ControlLimits limits{
        *amplitude_low, *amplitude_high, *amplitude_percentile / 100, setup.camera().full_well, {1e-6, 1}};
    for (int i : {0, 1})
      if (std::isfinite(settings_.integration_range[i])) limits.times[i] = settings_.integration_range[i];
    if (calibration.given()) {
      const double recommended = camcube::use_calibration(*calibration, settings_.camera, limits);
      if (!std::isfinite(settings_.integration_time)) settings_.integration_time = recommended;
    }
    limits_ = limits;
  }

  void check_control(const camcube::Delivery& delivery) {
    if (std::ranges::count(delivery.channels, "taps") == 0 || (delivery.known & TOFGRAPH_KNOWS_INTEGRATION_TIME) == 0)
      throw ConfigError("auto_integration_time",
                        "needs raw data (taps) whose integration time the camera tells; remove it");
    if (const std::string problem = camera_->why_not_adjustable(); !problem.empty())
      throw ConfigError("auto_integration_time", problem);
    const double longest = camera_->longest_integration_time();
    if (!(limits_->times[0] <= longest))
      throw ConfigError(
          "auto_integration_time",
          fmt::format("this camera can be told of times up to {}, those that may be chosen begin at {}",
                      config::format_quantity(longest, "s"), config::format_quantity(limits_->times[0], "s")));
    limits_->times[1] = std::min(limits_->times[1], longest);
    control_.emplace(*limits_);
  }

  /// Adjusts the integration time of the following frames. This frame is complete in any case.
  void adjust(const Frame& frame) {
    const Array<const std::uint16_t> image(frame.find("taps"));
    if (image.extent(0) != RawSourceData::images)
      throw std::runtime_error(
          fmt::format("auto_integration_time needs frames of {} phase images, there are {}; remove it",
                      RawSourceData::images, image.extent(0)));
    // For reopening: the time in use, not the requested one.
    settings_.integration_time = camcube::nearest_integration_time(settings_, frame.metadata().integration_time);
    const auto time = control_->next(image.span(), frame.metadata().integration_time);
    if (!time) return;
    try {
      camera_->set_integration_time(*time);
    } catch (const Fault& fault) {
      later_ = fault;
    }
  }

  void read_parameters() {
    const auto order = RawSourceData::order_of(*phase_order);
    if (!order) throw ConfigError("phase_order", RawSourceData::order_expected);
    settings_.layout.phase_order = *order;
    settings_.integration_time = *integration_time;
    settings_.modulation_frequency = *modulation_frequency;
    settings_.frame_rate = *frame_rate;
    settings_.device = *device;
    settings_.protocol = *protocol;
    settings_.library = *library;
    settings_.source_plugin = *source_plugin;
    settings_.source_parameter = *source_parameter;
    settings_.processing_plugin = *processing_plugin;
    settings_.processing_parameter = *processing_parameter;
    settings_.exposure_mode = *exposure_mode;
    settings_.commands = *commands;
    settings_.vendor_images = *deliver == "images";
    settings_.vendor_calibration = *vendor_calibration;
    settings_.file = *file;
    settings_.scene = *scene;
    settings_.condition = *condition;
    settings_.loop = *loop;
    settings_.at_recorded_pace = *pace == "recorded";
  }

  std::string chosen_backend() const {
    if (*backend != "auto") return *backend;
    if (file.given() && scene.given()) throw ConfigError("scene", "there is a 'file' too: remove one of the two");
    if (file.given() || scene.given()) return file.given() ? "replay" : "simulated";
    if (library.given()) return "pmdsdk";
    return device.given() || protocol.given() ? "usb" : "auto";
  }

  camcube::BackendPtr make(const std::string& name) const {
    if (name == "pmdsdk") return camcube::make_pmdsdk(*this, settings_);
    if (name == "usb") return camcube::make_usb(*this, settings_);
    if (name == "replay") return camcube::make_replay(*this, settings_);
    return camcube::make_simulated(*this, settings_);
  }

  void take_camera(const Setup& setup) {
    if (setup.stream().camera == nullptr) {
      if (!setup.use_profile("camcube2"))
        throw std::runtime_error("there is no profile camcube2: is tofgraph installed?");
      note("no camera is given: the profile camcube2 is used");
    }
    const tofgraph_camera& camera = setup.camera();
    settings_.camera = camera.name;
    settings_.layout.rows = camera.height;
    settings_.layout.columns = camera.width;
    settings_.nominal_frequency = camera.modulation_frequency;
    settings_.nominal_frame_rate = camera.frame_rate;
    std::copy(camera.integration_time, camera.integration_time + 2, settings_.integration_range);
    if (!roi.given()) return;
    const bool whole = roi->size() == 4 && std::ranges::all_of(*roi, [](double v) { return v == std::floor(v); });
    if (!whole || (*roi)[2] != camera.width || (*roi)[3] != camera.height)
      throw ConfigError("roi", fmt::format("expected [x, y, width, height] in whole px with the size of the camera's "
                                           "profile, {} x {} px, e.g. [0, 0, {}, {}]",
                                           camera.width, camera.height, camera.width, camera.height));
    settings_.roi = fmt::format("{} {} {} {}", (*roi)[0], (*roi)[1], (*roi)[2], (*roi)[3]);
  }

  camcube::Delivery first_that_finds_a_camera(std::string& used) {
    std::string tried;
    for (const char* name : {"pmdsdk", "usb"}) {
      camera_ = make(name);
      try {
        camcube::Delivery delivery = camera_->open();
        used = name;
        if (!tried.empty()) note("tried before:" + tried);
        return delivery;
      } catch (const camcube::NotFound& reason) {
        tried += fmt::format("\n         {}: {}", name, reason.what());
      }
    }
    throw ConfigError("backend", "no camera was found; tried:" + tried +
                                     "\n         without a camera: file: RECORDING or scene: SCENE.yaml; 'tofgraph "
                                     "devices' shows what is plugged in");
  }

  void provide(Setup& setup, const camcube::Delivery& delivery) {
    const auto has = [&](const char* name) { return std::ranges::count(delivery.channels, name) > 0; };
    if (has("taps")) taps.provide(setup);
    if (has("raw_headers")) headers.provide(setup);
    if (has("distance")) distance.provide(setup);
    if (has("amplitude")) amplitude.provide(setup);
    if (has("intensity")) intensity.provide(setup);
    if (has("flags")) flags.provide(setup);
    for (const tofgraph_channel& channel : delivery.recorded) setup.provide(channel);
    setup.set_frames(delivery.frames, delivery.known);
  }

  /// True if the user ends the run or another node has failed.
  bool ending() const { return stopped_.load() || stopping(); }

  void begin() {
    started_ = true;
    last_frame_ = waiting_since_ = Clock::now();
    note(description_);
  }

  void arrived(Frame& frame) {
    const auto now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - last_frame_).count();
    const double rate = std::isfinite(settings_.frame_rate) ? settings_.frame_rate : settings_.nominal_frame_rate;
    frame.metadata().device_number = counter_.number(frame.metadata().device_number, seconds, rate);
    last_frame_ = waiting_since_ = now;
    faults_ = 0;
  }

  void check_that_it_answers() const {
    if (!is_device_ || Clock::now() - waiting_since_ < std::chrono::duration<double>(*timeout)) return;
    throw Fault(fmt::format("no frame came for {}: the camera does not answer", config::format_quantity(*timeout, "s")),
                true);
  }

  void recover(const Fault& fault) {
    warn(fault.what());
    counter_.interrupted();
    if (fault.lost || ++faults_ > max_faults) open_again();
  }

  /// Tries until the camera is back or the run ends.
  void open_again() {
    camera_->close();
    std::string said;
    while (!ending()) {
      try {
        camera_->open();
        warn("the camera is back");
        break;
      } catch (const std::exception& reason) {
        if (said != reason.what()) warn(fmt::format("waiting for the camera: {}", reason.what()));
        said = reason.what();
        camera_->close();
      }
      std::this_thread::sleep_for(retry);
    }
    if (control_) control_.emplace(*limits_);  // a request that did not take effect yet is lost
    faults_ = 0;
    waiting_since_ = Clock::now();
  }

  camcube::Settings settings_;
  camcube::BackendPtr camera_;
  std::string description_;
  camcube::FrameCounter counter_;
  std::optional<camcube::ControlLimits> limits_;
  std::optional<camcube::IntegrationControl> control_;
  std::optional<Fault> later_;  // reported after the frame before it
  std::atomic<bool> stopped_{false};
  bool started_ = false, is_device_ = false;  // device: must answer within the timeout
  int faults_ = 0;
  Clock::time_point last_frame_, waiting_since_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::CamCube,
               "A live camera: a PMD CamCube (not verified on hardware), a recording or a simulation in its place")
