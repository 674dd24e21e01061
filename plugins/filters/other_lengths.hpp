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
      const bool same_size = lengths.rows() == flags.rows() && lengths.columns() == flags.columns();
      if (flags.size() == 0 || !same_size || !is_missing(lengths, flags)) continue;
      const Array<float> changed(frame.modify(name.c_str()));
      each_value(changed, flags,
                 [](float& value, bool invalid) { value = invalid ? std::numeric_limits<float>::quiet_NaN() : value; });
    }
  }

 private:
  /// Calls call(value, whether its pixel is invalid). Without branches, so that it is vectorised.
  template <class T, class Call>
  static void each_value(const Array<T>& lengths, const Array<std::uint16_t>& flags, Call&& call) {
    T* value = lengths.data();
    const std::uint16_t* bits = flags.data();
    const std::size_t pixels = flags.size(), each = lengths.size() / pixels;  // points have three
    if (each == 1) {
      for (std::size_t i = 0; i < pixels; ++i) call(value[i], (bits[i] & flag::invalid) != 0);
      return;
    }
    for (std::size_t i = 0; i < pixels; ++i) {
      for (std::size_t k = 0; k < each; ++k) call(value[each * i + k], (bits[i] & flag::invalid) != 0);
    }
  }

  /// Whether an invalid pixel still has a length.
  static bool is_missing(const Array<const float>& lengths, const Array<std::uint16_t>& flags) {
    int found = 0;
    each_value(lengths, flags, [&found](const float& value, bool invalid) {
      found |= static_cast<int>(invalid) & static_cast<int>(value == value);
    });
    return found != 0;
  }

  std::vector<std::string> names_;
};

}  // namespace tofgraph
