// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Between the thread of a device and that of the source: few frames, the newest are kept.
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

/// Now, in ns since 1970.
std::int64_t now_ns();

/// Raw source data of one frame, or what stands for it.
struct RawFrame {
  std::vector<std::uint8_t> bytes;
  std::uint64_t number = 0;                               ///< the device's counter
  std::int64_t timestamp_ns = 0;                          ///< start of the exposure, since 1970
  double integration_time = 0, modulation_frequency = 0;  ///< s, Hz
};

/// Nothing allocates once all frames have their size. [any thread]
class FrameExchange {
 public:
  /// @param frames that may wait @param bytes of each
  FrameExchange(std::size_t frames, std::size_t bytes) : waiting_(frames) {
    for (RawFrame& frame : waiting_) frame.bytes.resize(bytes);
  }

  /// Takes a frame; gives back the memory of another. Where all places are taken the oldest makes room.
  void offer(RawFrame& frame);
  /// What went wrong, for the reader once it has read what came before; the first of several is kept.
  void fail(const Fault& fault);
  /// Waits for a frame. @returns false when none came in time, or after wake() @throws Fault
  bool take(RawFrame& frame, std::chrono::milliseconds patience);
  /// Makes take() return now and from now on.
  void wake();
  /// Forgets frames and faults, for a new beginning.
  void clear();
  /// Frames that made room, as nobody read them in time.
  std::uint64_t overtaken() const;

 private:
  mutable std::mutex mutex_;  // all below
  std::condition_variable changed_;
  std::vector<RawFrame> waiting_;  // a ring
  std::size_t first_ = 0, count_ = 0;
  std::optional<std::pair<std::string, bool>> fault_;  // text, device lost: an exception belongs to one thread
  std::uint64_t overtaken_ = 0;
  bool woken_ = false;
};

}  // namespace tofgraph::camcube
