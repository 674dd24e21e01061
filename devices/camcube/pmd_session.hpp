// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A camera opened through the vendor's library, and the thread that waits in it: the library's call for the next frame
/// blocks, possibly forever.
#pragma once

#include <atomic>
#include <memory>

#include "devices/camcube/backend.hpp"
#include "devices/camcube/frame_exchange.hpp"
#include "devices/camcube/pmd_library.hpp"

namespace tofgraph::camcube {

class PmdSession : public std::enable_shared_from_this<PmdSession> {
 public:
  /// Opens the camera. @throws NotFound with the library's reason
  PmdSession(std::shared_ptr<const PmdLibrary> library, const Settings& settings);
  ~PmdSession();
  PmdSession(const PmdSession&) = delete;
  PmdSession& operator=(const PmdSession&) = delete;

  /// Sends a command to the source plugin, or to the processing plugin. @returns the answer
  /// @throws SettingError naming the parameter
  std::string command(const char* parameter, const std::string& text, bool processing) const;
  /// As command(), for commands that not every camera knows. @returns the error, or nothing
  std::string try_command(const std::string& text, bool processing) const;
  /// Sets the integration time in whole microseconds or the modulation frequency in whole hertz.
  /// @param nearest accepts the nearest valid value @throws SettingError naming the nearest valid value
  void set_number(const char* parameter, const char* what, const char* unit, double factor, double value,
                  bool nearest = false) const;
  /// Current setting, in s or Hz; NaN if the library does not provide it.
  double number(const char* what, double factor) const;

  /// Starts the acquisition in a separate thread.
  void start();
  /// Ends the thread when its call returns; the thread then closes the camera. Waits at most one second.
  /// @returns whether the call returned in that time
  static bool close(const std::shared_ptr<PmdSession>& session) noexcept;

  FrameExchange& frames() { return frames_; }
  /// Size of a frame: raw source data, or four images of 4 bytes per pixel.
  std::size_t frame_bytes() const;
  void set_defaults(double integration_time, double modulation_frequency) {
    integration_time_ = integration_time;
    modulation_frequency_ = modulation_frequency;
  }
  /// Sets the time of following frames; applied between two frames by the thread that uses the library. [any thread]
  void change_integration_time(double time) { wanted_time_.store(time); }
  bool big_endian() const { return big_endian_.load(); }

 private:
  void work();
  void take_wanted_time();
  void fetch(RawFrame& frame);
  void fetch_raw(RawFrame& frame);
  void fetch_images(RawFrame& frame) const;
  void check(int result, const std::string& what) const;

  std::shared_ptr<const PmdLibrary> library_;
  const RawSourceData layout_;
  const bool images_;
  pmd::Handle handle_ = 0;
  double integration_time_ = 0, modulation_frequency_ = 0;
  FrameExchange frames_;
  std::atomic<bool> stopping_{false}, big_endian_{true};
  std::atomic<double> wanted_time_{0};  ///< s; 0: unchanged
  std::mutex mutex_;                    // guards the two members below
  std::condition_variable ended_;
  bool running_ = false;
};

}  // namespace tofgraph::camcube
