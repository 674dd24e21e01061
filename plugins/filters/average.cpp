// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/stage.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <vector>

namespace tofgraph {

/// Sums of one pixel over the frames in which it is valid. Lengths count from the pixel's first value, so that the
/// difference of two large sums keeps its digits.
struct PixelSums {
  double reference = 0, sum = 0, squares = 0, amplitude = 0;
  std::uint32_t valid = 0, seen = 0;  // frames with a valid length; frames at all
};

/// Temporal mean, pixel by pixel, over the frames in which the pixel is valid. sigma becomes the standard deviation of
/// that mean as the frames themselves show it, sd (n-1) / sqrt(n); of a single valid value it stays what came in.
/// A pixel that is valid in no frame stays invalid. The other flags are those of any of the frames; metadata and all
/// other channels are those of the last.
struct Average final : Filter {
  InOut<float> image{this, "depth|range|distance", {.text = "what is averaged", .adds = "averaged"}};
  InOut<float> amplitude{this, "amplitude", {.text = "averaged too, over all frames", .optional = true}};
  InOut<float> sigma{this, "sigma", {.text = "made, or replaced: of the mean", .optional = true}};
  InOut<std::uint16_t> flags{this, "flags", {.text = "joined over the frames", .optional = true}};
  Param<std::int64_t> frames{
      this, "frames", {.fallback = "10", .min = 1, .max = 1e6, .text = "how many frames make one"}};
  Param<bool> running{
      this, "running", {.fallback = "false", .text = "one for each frame that comes in, over the last `frames`"}};
  Param<Choice> channel{this,
                        "channel",
                        {.fallback = "auto",
                         .choices = "auto depth range distance",
                         .text = "what is averaged; auto: the first of them that is there"}};

  void prepare(Setup& setup) {
    if (*running && *frames > 1000) {
      throw ConfigError("frames", "a running mean keeps every frame of its window: at most 1000 are allowed");
    }
    if (!*running) setup.set_frames(setup.stream().frames / static_cast<std::uint64_t>(*frames), setup.stream().known);
    flags.provide(setup);
    sigma.provide(setup, image.channel());
  }

  /// @returns false while the frames of a mean are being collected
  bool process(Frame& frame) {
    const Array<float> values = image(frame);
    const Array<float> amplitudes = amplitude(frame);
    const Array<std::uint16_t> bits = flags(frame, values.rows(), values.columns());
    if (sums_.size() != values.size()) {
      sums_.assign(values.size(), {});
      joined_.assign(values.size(), 0);
    }
    if (*running && taken_ == *frames) forget();
    taken_ = std::min(taken_ + 1, *frames);
    add(values, amplitudes, bits);
    if (!*running && taken_ < *frames) return false;
    give(values, amplitudes, sigma(frame, values.rows(), values.columns()), bits);
    if (!*running) {
      taken_ = 0;
      std::ranges::fill(sums_, PixelSums{});
      std::ranges::fill(joined_, 0);
    }
    return true;
  }

 private:
  /// What is kept of each frame of a running mean.
  struct Taken {
    std::vector<float> values, amplitudes;
    std::vector<std::uint16_t> flags;
  };

  void add(const Array<float>& values, const Array<float>& amplitudes, const Array<std::uint16_t>& bits) {
    if (*running) {
      window_.push_back(
          {{values.begin(), values.end()}, {amplitudes.begin(), amplitudes.end()}, {bits.begin(), bits.end()}});
    } else {
      for (std::size_t i = 0; i < values.size(); ++i) joined_[i] |= bits[i];
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
      PixelSums& pixel = sums_[i];
      ++pixel.seen;
      if (amplitudes) pixel.amplitude += amplitudes[i];
      if (!std::isfinite(values[i])) continue;
      if (pixel.valid++ == 0) pixel.reference = values[i];
      const double value = values[i] - pixel.reference;
      pixel.sum += value;
      pixel.squares += value * value;
    }
  }

  /// Takes the oldest frame of a running mean out.
  void forget() {
    const Taken& oldest = window_.front();
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      PixelSums& pixel = sums_[i];
      --pixel.seen;
      if (!oldest.amplitudes.empty()) pixel.amplitude -= oldest.amplitudes[i];
      if (!std::isfinite(oldest.values[i])) continue;
      const double value = oldest.values[i] - pixel.reference;
      pixel.sum -= value;
      pixel.squares -= value * value;
      if (--pixel.valid == 0) pixel.sum = pixel.squares = 0;
    }
    window_.pop_front();
  }

  void give(const Array<float>& values, const Array<float>& amplitudes, const Array<float>& deviations,
            const Array<std::uint16_t>& bits) const {
    for (const Taken& taken : window_) {
      for (std::size_t i = 0; i < values.size(); ++i) bits[i] |= taken.flags[i];
    }
    for (std::size_t i = 0; i < values.size(); ++i) bits[i] |= joined_[i];
    for (std::size_t i = 0; i < values.size(); ++i) {
      const PixelSums& pixel = sums_[i];
      const double n = pixel.valid;
      if (amplitudes) amplitudes[i] = static_cast<float>(pixel.amplitude / pixel.seen);
      if (pixel.valid == 0) {
        values[i] = deviations[i] = std::numeric_limits<float>::quiet_NaN();
        bits[i] |= flag::invalid;
        continue;
      }
      values[i] = static_cast<float>(pixel.reference + pixel.sum / n);
      bits[i] &= static_cast<std::uint16_t>(~flag::invalid);
      const double variance = std::max(pixel.squares - pixel.sum * pixel.sum / n, 0.0) / (n - 1);
      if (pixel.valid > 1)
        deviations[i] = static_cast<float>(std::sqrt(variance / n));
      else if (sigma.made_here())
        deviations[i] = std::numeric_limits<float>::quiet_NaN();
    }
  }

  std::vector<PixelSums> sums_;
  std::deque<Taken> window_;           // running only
  std::vector<std::uint16_t> joined_;  // otherwise
  std::int64_t taken_ = 0;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Average, "Temporal mean over frames, valid pixels only, with the deviation of the mean")
