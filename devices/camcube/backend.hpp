// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Interface of the stage `camcube` to a camera, with a backend for each kind of access.
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
  double nominal_frequency = 0, nominal_frame_rate = 0;  ///< profile's values; NaN: not known
  double integration_range[2] = {};                      ///< valid ones, of the profile; NaN: not known
  double integration_time = 0, modulation_frequency = 0, frame_rate = 0;

  std::string device;                                              ///< usb: serial number or port; empty: the only one
  std::string protocol;                                            ///< usb: path of the description
  std::string library;                                             ///< pmdsdk: path; empty: where the vendor puts it
  std::string source_plugin, source_parameter, processing_plugin;  ///< pmdsdk
  std::string processing_parameter, roi, exposure_mode, commands;  ///< pmdsdk
  bool vendor_images = false, vendor_calibration = false;          ///< pmdsdk
  std::string file, scene;                                         ///< replay, simulated
  bool loop = false, at_recorded_pace = true;                      ///< replay
  std::int64_t condition = -1;                                     ///< simulated: the only one; -1: all
};

/// Properties of every frame.
struct Delivery {
  std::vector<std::string> channels;       ///< a subset of those that the stage declares
  std::vector<tofgraph_channel> recorded;  ///< others; their strings live as long as the backend
  std::uint64_t known = 0;                 ///< TOFGRAPH_KNOWS_..
  std::uint64_t frames = 0;                ///< 0: endless
  bool live = true;                        ///< it does not wait for who reads its frames
  std::string serial;                      ///< may be empty
  std::string text;                        ///< which camera it is and how it is reached, for people
};

class Backend {
 public:
  Backend() = default;
  Backend(const Backend&) = delete;
  Backend& operator=(const Backend&) = delete;
  virtual ~Backend() = default;

  /// For replays and simulations: chooses the camera of the recording or scene, and its exposures. Called once, before
  /// open(). @throws SettingError
  virtual void prepare(Setup&) {}
  /// Opens the device and gives it its settings; also again after close().
  /// @throws NotFound there is no camera @throws SettingError it is there and cannot be used so
  virtual Delivery open() = 0;
  virtual void close() noexcept = 0;

  enum class Got { frame, nothing, end };
  /// Waits for a frame at most so long. It sets all metadata but `number`; device_number counts from open() on, or is
  /// the device's own. @throws Fault
  virtual Got read(Frame& frame, std::chrono::milliseconds patience) = 0;
  /// Why the integration time cannot be changed while frames come, or nothing; after open().
  virtual std::string why_not_adjustable() const {
    return "a recording has the times that it was recorded with; remove it";
  }
  /// s, that can be asked for and told; after open().
  virtual double longest_integration_time() const { return std::numeric_limits<double>::infinity(); }
  /// For the frames to come, soon; whole microseconds within the camera's range, or the nearest that the camera has.
  /// Each frame says its own. @throws Fault
  virtual void set_integration_time(double) {}
  /// Frames that came faster than they were read, so far.
  virtual std::uint64_t overtaken() const { return 0; }
  /// Makes a running read() return soon. [any thread]
  virtual void stop() noexcept {}
};

using BackendPtr = std::unique_ptr<Backend>;
BackendPtr make_pmdsdk(const Stage& stage, const Settings& settings);
BackendPtr make_usb(const Stage& stage, const Settings& settings);
BackendPtr make_replay(const Stage& stage, const Settings& settings);
BackendPtr make_simulated(const Stage& stage, const Settings& settings);

/// s, in whole microseconds within the range of the profile.
double nearest_integration_time(const Settings& settings, double time);
/// Whole microseconds within the range of the profile. @throws SettingError that says the nearest valid time
void check_integration_time(const Settings& settings);

}  // namespace tofgraph::camcube
