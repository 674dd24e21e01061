// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Interface between the stage `camcube` and a camera, with one backend for each kind of access.
#pragma once

#include <tofgraph/frame.hpp>

#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "devices/camcube/errors.hpp"
#include "plugins/raw_source_data.hpp"

namespace tofgraph {
class Stage;
class Setup;
}  // namespace tofgraph

namespace tofgraph::camcube {

/// Settings requested by the user, and properties of the camera; times in s, frequencies in Hz, NaN: not requested.
struct Settings {
  std::string camera;  ///< name of the profile
  RawSourceData layout;
  double nominal_frequency = 0, nominal_frame_rate = 0;  ///< values of the profile; NaN: unknown
  double integration_range[2] = {};                      ///< valid range from the profile; NaN: unknown
  double integration_time = 0, modulation_frequency = 0, frame_rate = 0;

  std::string device;                                              ///< usb: serial number or port; empty: any
  std::string protocol;                                            ///< usb: path of the protocol description
  std::string library;                                             ///< pmdsdk: path; empty: vendor's default
  std::string source_plugin, source_parameter, processing_plugin;  ///< pmdsdk
  std::string processing_parameter, roi, exposure_mode, commands;  ///< pmdsdk
  bool vendor_images = false, vendor_calibration = false;          ///< pmdsdk
  std::string file, scene;                                         ///< replay, simulated
  bool loop = false, at_recorded_pace = true;                      ///< replay
  std::int64_t condition = -1;                                     ///< simulated: index of a single condition; -1: all
};

/// Properties of all frames.
struct Delivery {
  std::vector<std::string> channels;       ///< subset of the channels declared by the stage
  std::vector<tofgraph_channel> recorded;  ///< further channels; their strings live as long as the backend
  std::uint64_t known = 0;                 ///< TOFGRAPH_KNOWS_..
  std::uint64_t frames = 0;                ///< 0: endless
  bool live = true;                        ///< frames not read in time are lost
  std::string serial;                      ///< may be empty
  std::string text;                        ///< readable description of the camera and its connection
};

class Backend {
 public:
  Backend() = default;
  Backend(const Backend&) = delete;
  Backend& operator=(const Backend&) = delete;
  virtual ~Backend() = default;

  /// For replays and simulations: sets the camera of the recording or scene, and its exposures. Called once, before
  /// open(). @throws SettingError
  virtual void prepare(Setup&) {}
  /// Opens the device and applies its settings; also after close().
  /// @throws NotFound if there is no camera @throws SettingError if it cannot be used with these settings
  virtual Delivery open() = 0;
  virtual void close() noexcept = 0;

  enum class Got { frame, nothing, end };
  /// Waits for a frame, no longer than `patience`. Sets all metadata except `number`; device_number counts from open()
  /// on, or is the device's own counter. @throws Fault
  virtual Got read(Frame& frame, std::chrono::milliseconds patience) = 0;
  /// Reason why the integration time cannot be changed during acquisition, or nothing; after open().
  virtual std::string why_not_adjustable() const {
    return "a recording has the times that it was recorded with; remove it";
  }
  /// Longest time that can be set and is reported, s; after open().
  virtual double longest_integration_time() const { return std::numeric_limits<double>::infinity(); }
  /// Sets the time of one of the next frames: whole microseconds within the camera's range, or the nearest time that it
  /// supports. Each frame states its own. @throws Fault
  virtual void set_integration_time(double) {}
  /// Number of frames lost so far because they were not read in time.
  virtual std::uint64_t lost_frames() const { return 0; }
  /// Makes a running read() return promptly. [any thread]
  virtual void stop() noexcept {}
};

using BackendPtr = std::unique_ptr<Backend>;
BackendPtr make_pmdsdk(const Stage& stage, const Settings& settings);
BackendPtr make_usb(const Stage& stage, const Settings& settings);
BackendPtr make_replay(const Stage& stage, const Settings& settings);
BackendPtr make_simulated(const Stage& stage, const Settings& settings);

/// Nearest valid time: s, in whole microseconds within the range of the profile.
double nearest_integration_time(const Settings& settings, double time);
/// Requires whole microseconds within the range of the profile. @throws SettingError naming the nearest valid time
void check_integration_time(const Settings& settings);

}  // namespace tofgraph::camcube
