// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tofgraph/physics/unwrapping.hpp>
#include <tofgraph/stage.hpp>

#include <limits>
#include <string_view>

namespace tofgraph {

/// Period of the wrapped distances of a stream, for filters that average them over frames.
class DistanceRepeat {
 public:
  /// Word among the applied stages of a distance that does not repeat at the frame's modulation frequency.
  static constexpr std::string_view unwrapped = "unwrapped";

  /// @param channel of the lengths; ranges and depths are assumed to be unwrapped
  void prepare(const Setup& setup, std::string_view channel) {
    if (channel != "distance") return;
    const std::string_view applied = setup.find(channel)->applied;
    if (applied.find(unwrapped) != std::string_view::npos) return;
    steps_ = physics::exposures_of(setup.exposures());
    if (const tofgraph_camera* camera = setup.stream().camera; camera != nullptr)
      nominal_ = camera->modulation_frequency;
  }

  /// Distance after which the frame's lengths repeat, m; 0: never, or unknown.
  double of(const Frame& frame) const {
    return steps_.empty() ? 0 : physics::repeat_of(steps_, frame.metadata().modulation_frequency, nominal_);
  }

 private:
  physics::Exposures steps_;                                   // of the frames; empty: lengths do not wrap
  double nominal_ = std::numeric_limits<double>::quiet_NaN();  // Hz, the camera's frequency
};

}  // namespace tofgraph
