// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The rule for pixels that a stage flags as invalid: NaN in every length channel of the frame.
#pragma once

#include <tofgraph/stage.hpp>

#include <algorithm>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph {

/// Measured lengths: those of the table of channels, and of stages that have their own. The truth of a simulation
/// stays known where the camera measured nothing.
inline bool is_length(const tofgraph_channel& channel) {
  return channel.type == TOFGRAPH_F32 && std::string_view(channel.unit) == "m" &&
         std::string_view(channel.name) != "true_depth";
}

/// The length channels that arrive at a stage beside those whose pixels it invalidates itself.
class OtherLengths {
 public:
  /// @param own channels that the stage writes, all invalid pixels as NaN
  void prepare(const Setup& setup, std::initializer_list<std::string_view> own) {
    for (const tofgraph_channel& channel : setup.channels()) {
      if (is_length(channel) && std::ranges::find(own, channel.name) == own.end()) names_.emplace_back(channel.name);
    }
  }

  /// Makes invalid pixels NaN. A channel that has them so already is not touched, so that it stays shared.
  void invalidate(const Frame& frame, const Array<std::uint16_t>& flags) const {
    for (const std::string& name : names_) {
      const Array<const float> lengths(frame.find(name.c_str()));
      if (flags.size() == 0 || !is_missing(lengths, flags)) continue;
      const Array<float> changed(frame.modify(name.c_str()));
      const std::size_t each = changed.size() / flags.size();  // points have three
      for (std::size_t i = 0; i < flags.size(); ++i) {
        if ((flags[i] & flag::invalid) != 0)
          std::fill_n(changed.data() + each * i, each, std::numeric_limits<float>::quiet_NaN());
      }
    }
  }

 private:
  /// Whether an invalid pixel still has a length. Without branches, so that it is vectorised.
  static bool is_missing(const Array<const float>& lengths, const Array<std::uint16_t>& flags) {
    const std::size_t each = lengths.size() / flags.size();
    int found = 0;
    if (each == 1) {
      for (std::size_t i = 0; i < flags.size(); ++i)
        found |= (flags[i] & flag::invalid) & static_cast<int>(lengths[i] == lengths[i]);
    } else {
      for (std::size_t i = 0; i < lengths.size(); ++i)
        found |= (flags[i / each] & flag::invalid) & static_cast<int>(lengths[i] == lengths[i]);
    }
    return found != 0;
  }

  std::vector<std::string> names_;
};

}  // namespace tofgraph
