// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Queue between the thread of a device and that of the source: short, keeps the newest frames.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "devices/camcube/errors.hpp"

namespace tofgraph::camcube {

/// Current time in ns since 1970.
std::int64_t now_ns();

/// Raw source data of one frame, or equivalent data.
struct RawFrame {
  std::vector<std::uint8_t> bytes;
  std::uint64_t number = 0;                               ///< counter of the device
  std::int64_t timestamp_ns = 0;                          ///< start of the exposure, since 1970
  double integration_time = 0, modulation_frequency = 0;  ///< s, Hz
};

/// Frames and faults in order of arrival. Allocates only for faults once all frames have their size. [any
/// thread]
class FrameExchange {
 public:
  /// @param frames maximum number waiting @param bytes of each
  FrameExchange(std::size_t frames, std::size_t bytes) : waiting_(frames) {
    for (Waiting& one : waiting_) one.frame.bytes.resize(bytes);
  }

  /// Accepts a frame and returns the memory of another one in it. If the queue is full, the oldest frame is dropped.
  void offer(RawFrame& frame);
  /// Adds a fault that the reader receives after earlier frames. Between two frames only one is kept: the first, or the
  /// first that lost the device.
  void fail(const Fault& fault);
  /// Waits for a frame. @returns false on timeout or after wake() @throws Fault
  bool take(RawFrame& frame, std::chrono::milliseconds patience);
  /// Makes take() return immediately from now on.
  void wake();
  /// Removes frames and faults, for a restart.
  void clear();
  /// Number of frames dropped because they were not read in time.
  std::uint64_t lost_frames() const;

 private:
  using MaybeFault = std::optional<std::pair<std::string, bool>>;  // text, device lost; an exception is not shared
  struct Waiting {
    RawFrame frame;
    MaybeFault before;  // preceding this frame
  };
  static void merge(MaybeFault& earlier, MaybeFault later);

  mutable std::mutex mutex_;  // guards the members below
  std::condition_variable changed_;
  std::vector<Waiting> waiting_;  // ring buffer
  std::size_t first_ = 0, count_ = 0;
  MaybeFault last_fault_;  // after the last frame
  std::uint64_t lost_frames_ = 0;
  bool woken_ = false;
};

}  // namespace tofgraph::camcube
