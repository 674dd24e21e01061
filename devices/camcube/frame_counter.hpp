// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Frame counter that continues when its camera comes back.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace tofgraph::camcube {

/// The device's own counter while it increases. If a camera restarts its counter after an interruption, the numbers
/// continue after a gap of the frames that it would have delivered meanwhile, at least one.
class FrameCounter {
 public:
  /// @param device the device's counter @param seconds since the previous frame @param frame_rate Hz; NaN: unknown
  std::uint64_t number(std::uint64_t device, double seconds, double frame_rate) {
    if (interrupted_ && last_ && device + offset_ <= *last_) {
      const double frames = std::round(seconds * frame_rate) - 1;
      const std::uint64_t lost = std::isfinite(frames) && frames > 1 ? static_cast<std::uint64_t>(frames) : 1;
      offset_ = *last_ + 1 + lost - device;  // may wrap around: the sum is correct
    }
    interrupted_ = false;
    last_ = device + offset_;
    return *last_;
  }
  /// Records that frames are missing and the device may restart its counter.
  void interrupted() { interrupted_ = true; }

 private:
  std::uint64_t offset_ = 0;
  std::optional<std::uint64_t> last_;
  bool interrupted_ = false;
};

}  // namespace tofgraph::camcube
