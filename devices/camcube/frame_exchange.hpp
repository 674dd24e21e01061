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

/// Frames and faults in the order in which they came. Nothing allocates once all frames have their size, but for
/// faults. [any thread]
class FrameExchange {
 public:
  /// @param frames that may wait @param bytes of each
  FrameExchange(std::size_t frames, std::size_t bytes) : waiting_(frames) {
    for (Waiting& one : waiting_) one.frame.bytes.resize(bytes);
  }

  /// Takes a frame; gives back the memory of another. Where all places are taken the oldest makes room.
  void offer(RawFrame& frame);
  /// Adds a fault that the reader receives after earlier frames. Of several between two frames the first is kept, or
  /// the first that lost the device.
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
  using MaybeFault = std::optional<std::pair<std::string, bool>>;  // text, device lost: an exception has one thread
  struct Waiting {
    RawFrame frame;
    MaybeFault before;  // this frame came
  };
  static void merge(MaybeFault& earlier, MaybeFault later);

  mutable std::mutex mutex_;  // all below
  std::condition_variable changed_;
  std::vector<Waiting> waiting_;  // a ring
  std::size_t first_ = 0, count_ = 0;
  MaybeFault last_fault_;  // behind the last frame
  std::uint64_t overtaken_ = 0;
  bool woken_ = false;
};

}  // namespace tofgraph::camcube
