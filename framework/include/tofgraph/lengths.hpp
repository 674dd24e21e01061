// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rule for invalid pixels: NaN in every length channel of the frame, and the flag `invalid`. Also the base class of
/// filters for a length image.
#pragma once

#include <tofgraph/stage.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph {

/// Returns whether a channel holds measured lengths: standard ones and those of other stages. The ground truth of a
/// simulation is excluded, since it is known where the camera measured nothing.
inline bool is_length(const tofgraph_channel& channel) {
  return channel.type == TOFGRAPH_TYPE_F32 && std::string_view(channel.unit) == "m" &&
         std::string_view(channel.name) != "true_depth";
}

/// Length channels of the input other than those whose pixels the stage invalidates itself.
class OtherLengths {
 public:
  /// @param own channels that the stage writes, with NaN at all invalid pixels
  void prepare(const Setup& setup, std::initializer_list<std::string_view> own) {
    for (const tofgraph_channel& channel : setup.channels()) {
      if (is_length(channel) && std::ranges::find(own, channel.name) == own.end()) names_.emplace_back(channel.name);
    }
  }

  /// Sets invalid pixels to NaN. A channel that needs no change is not touched, so that it stays shared.
  void invalidate(const Frame& frame, const Array<std::uint16_t>& flags) const {
    if (names_.empty()) return;
    thread_local std::vector<std::size_t> pixels;
    find_invalid(flags, pixels);
    for (const std::string& name : names_) {
      const Array<const float> lengths(frame.find(name.c_str()));
      const bool same_size = lengths.rows() == flags.rows() && lengths.columns() == flags.columns();
      if (pixels.empty() || !same_size) continue;
      const std::size_t each = lengths.size() / flags.size();  // points have three values
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
  /// Examines four pixels at a time, since most are valid.
  static void find_invalid(const Array<std::uint16_t>& flags, std::vector<std::size_t>& pixels) {
    pixels.resize(flags.size() + 1);
    std::size_t found = 0, i = 0;
    const auto look = [&](std::size_t pixel) {  // branch-free, because branches would be mispredicted
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

/// Rejects a sigma that belongs to another channel.
inline void check_sigma(const Setup& setup, bool present, const std::string& channel) {
  if (!present || setup.find("sigma")->of == channel) return;
  throw std::runtime_error(std::string("sigma is that of '") + setup.find("sigma")->of + "', expected that of '" +
                           channel + "'");
}

/// Sets pixels without a valid length, or flagged as invalid, to NaN and flags them. Branch-free for vectorisation.
/// @returns true if any pixel is valid
inline bool mark_invalid(const Array<float>& lengths, const Array<float>& deviations,
                         const Array<std::uint16_t>& bits) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  int valid = 0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const int measured = is_valid_length(lengths[i]), unmarked = (bits[i] & flag::invalid) == 0;
    const bool good = (measured & unmarked) != 0;
    lengths[i] = good ? lengths[i] : nan;
    bits[i] = static_cast<std::uint16_t>(bits[i] | (good ? 0 : flag::invalid));
    valid |= good ? 1 : 0;
  }
  for (std::size_t i = 0; i < deviations.size(); ++i) deviations[i] = lengths[i] == lengths[i] ? deviations[i] : nan;
  return valid != 0;
}

/// Filter of one length image: its ports, the choice of the length channel, and the rule for invalid pixels.
///
///     struct Smooth final : tofgraph::LengthFilter {
///       void prepare(tofgraph::Setup& setup) { prepare_lengths(setup); }
///       void process(Frame& frame) const {
///         const Lengths in = begin(frame);  // invalid pixels are NaN and flagged, in every length of the frame
///         for (float& length : in.image) length = ..;
///       }
///     };
struct LengthFilter : Filter {
  InOut<float> image{this, "depth|range|distance", {.text = "what is filtered", .adds = "denoised"}};
  InOut<float> sigma{
      this, "sigma", {.optional = true, .text = "standard deviation of the input; becomes that of the result"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created, or combined with the incoming flags"}};
  Param<Choice> channel{this,
                        "channel",
                        {.default_value = "auto",
                         .choices = "auto depth range distance",
                         .text = "what is filtered; auto: the first of these that exists"}};

 protected:
  /// Lengths of a frame; the array sigma is empty if there is none.
  struct Lengths {
    Array<float> image, sigma;
    Array<std::uint16_t> flags;
    bool any;  ///< true if a pixel is valid
  };

  void prepare_lengths(const Setup& setup) {
    check_sigma(setup, sigma.present(), image.channel());
    flags.provide(setup);
    others_.prepare(setup, {image.channel(), "sigma"});
  }

  Lengths begin(const Frame& frame) const {
    const Array<float> lengths = image(frame);
    Lengths all{lengths, sigma(frame, lengths.rows(), lengths.columns()),
                flags(frame, lengths.rows(), lengths.columns()), false};
    all.any = mark_invalid(all.image, all.sigma, all.flags);
    others_.invalidate(frame, all.flags);
    return all;
  }
  /// Sets the other lengths of pixels to NaN after they were flagged as invalid.
  void invalidate(const Frame& frame, const Array<std::uint16_t>& bits) const { others_.invalidate(frame, bits); }

 private:
  OtherLengths others_;
};

}  // namespace tofgraph
