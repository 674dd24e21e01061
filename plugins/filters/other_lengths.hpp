// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The rule for pixels that a stage flags as invalid: NaN in every length channel of the frame.
#pragma once

#include <tofgraph/stage.hpp>

#include <algorithm>
#include <cstring>
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
    if (names_.empty()) return;
    thread_local std::vector<std::size_t> pixels;
    find_invalid(flags, pixels);
    for (const std::string& name : names_) {
      const Array<const float> lengths(frame.find(name.c_str()));
      const bool same_size = lengths.rows() == flags.rows() && lengths.columns() == flags.columns();
      if (pixels.empty() || !same_size) continue;
      const std::size_t each = lengths.size() / flags.size();  // points have three
      const auto is_done = [&](std::size_t pixel) {
        return std::all_of(&lengths[pixel * each], &lengths[pixel * each] + each, [](float v) { return v != v; });
      };
      if (std::ranges::all_of(pixels, is_done)) continue;
      const Array<float> changed(frame.modify(name.c_str()));
      for (const std::size_t pixel : pixels)
        std::fill_n(&changed[pixel * each], each, std::numeric_limits<float>::quiet_NaN());
    }
  }

 private:
  /// Four pixels at a time: most are valid.
  static void find_invalid(const Array<std::uint16_t>& flags, std::vector<std::size_t>& pixels) {
    pixels.resize(flags.size() + 1);
    std::size_t found = 0, i = 0;
    const auto look = [&](std::size_t pixel) {  // without a branch, which could not be foreseen
      pixels[found] = pixel;
      found += flags[pixel] & flag::invalid;
    };
    for (; i + 4 <= flags.size(); i += 4) {
      std::uint64_t four = 0;
      std::memcpy(&four, &flags[i], sizeof four);
      if ((four & 0x0001000100010001U) == 0) continue;
      for (std::size_t k = 0; k < 4; ++k) look(i + k);
    }
    for (; i < flags.size(); ++i) look(i);
    pixels.resize(found);
  }

  std::vector<std::string> names_;
};

}  // namespace tofgraph
