// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A frame counter that goes on when its camera comes back.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace tofgraph::camcube {

/// The device's own counter, as long as it grows. A camera that begins anew after an interruption goes on behind a gap
/// of the frames that it would have made meanwhile, at least one.
class FrameCounter {
 public:
  /// @param device the device's counter @param seconds since the frame before @param frame_rate Hz; NaN: not known
  std::uint64_t number(std::uint64_t device, double seconds, double frame_rate) {
    if (interrupted_ && last_ && device + offset_ <= *last_) {
      const double frames = std::round(seconds * frame_rate) - 1;
      const std::uint64_t lost = std::isfinite(frames) && frames > 1 ? static_cast<std::uint64_t>(frames) : 1;
      offset_ = *last_ + 1 + lost - device;  // may wrap around: the sum is right
    }
    interrupted_ = false;
    last_ = device + offset_;
    return *last_;
  }
  /// Frames are missing, and the device may count anew.
  void interrupted() { interrupted_ = true; }

 private:
  std::uint64_t offset_ = 0;
  std::optional<std::uint64_t> last_;
  bool interrupted_ = false;
};

}  // namespace tofgraph::camcube
