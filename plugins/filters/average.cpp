// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/stage.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <vector>

namespace tofgraph {

/// Sums of each pixel over the frames in which it is valid. Lengths count from the pixel's first value, so that the
/// difference of two large sums keeps its digits.
struct PixelSums {
  std::vector<float> reference;
  std::vector<double> sum, squares, amplitude;
  std::vector<std::int32_t> valid;

  void reset(std::size_t pixels) {
    reference.assign(pixels, 0);
    for (auto* sums : {&sum, &squares, &amplitude}) sums->assign(pixels, 0);
    valid.assign(pixels, 0);
  }
  /// Adds a frame, or with sign -1 takes it out. Without branches, so that it is vectorised.
  void add(const float* values, const float* amplitudes, int sign) {
    for (std::size_t i = 0; i < valid.size(); ++i) {
      const bool finite = std::abs(values[i]) <= std::numeric_limits<float>::max();
      reference[i] = finite && valid[i] == 0 ? values[i] : reference[i];
      const double value = finite ? static_cast<double>(values[i]) - static_cast<double>(reference[i]) : 0;
      sum[i] += sign * value;
      squares[i] += sign * value * value;
      valid[i] += finite ? sign : 0;
    }
    for (std::size_t i = 0; amplitudes != nullptr && i < valid.size(); ++i)
      amplitude[i] += sign * static_cast<double>(amplitudes[i]);
  }
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
    if (sums_.valid.size() != values.size()) clear(values.size());
    if (*running && taken_ == *frames) forget();
    taken_ = std::min(taken_ + 1, *frames);
    add(values, amplitudes, bits);
    if (!*running && taken_ < *frames) return false;
    give(values, amplitudes, sigma(frame, values.rows(), values.columns()), bits);
    if (!*running) clear(values.size());
    return true;
  }

 private:
  /// What is kept of each frame of a running mean.
  struct Taken {
    std::vector<float> values, amplitudes;
    std::vector<std::uint16_t> flags;
  };

  void clear(std::size_t pixels) {
    taken_ = 0;
    sums_.reset(pixels);
    joined_.assign(pixels, 0);
  }

  void add(const Array<float>& values, const Array<float>& amplitudes, const Array<std::uint16_t>& bits) {
    sums_.add(values.data(), amplitudes.data(), 1);
    if (!*running) {
      for (std::size_t i = 0; i < values.size(); ++i) joined_[i] = static_cast<std::uint16_t>(joined_[i] | bits[i]);
      return;
    }
    Taken kept = std::move(spare_);
    kept.values.assign(values.begin(), values.end());
    kept.amplitudes.assign(amplitudes.begin(), amplitudes.end());
    kept.flags.assign(bits.begin(), bits.end());
    window_.push_back(std::move(kept));
  }

  /// Takes the oldest frame of a running mean out.
  void forget() {
    const Taken& oldest = window_.front();
    sums_.add(oldest.values.data(), oldest.amplitudes.empty() ? nullptr : oldest.amplitudes.data(), -1);
    spare_ = std::move(window_.front());
    window_.pop_front();
  }

  void give(const Array<float>& values, const Array<float>& amplitudes, const Array<float>& deviations,
            const Array<std::uint16_t>& bits) const {
    for (const Taken& taken : window_) {
      for (std::size_t i = 0; i < values.size(); ++i) bits[i] = static_cast<std::uint16_t>(bits[i] | taken.flags[i]);
    }
    for (std::size_t i = 0; i < values.size(); ++i) bits[i] = static_cast<std::uint16_t>(bits[i] | joined_[i]);
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double n = sums_.valid[i], inverse = 1 / std::max(n, 1.0);
      const bool any = n > 0;
      values[i] = any ? static_cast<float>(sums_.reference[i] + sums_.sum[i] * inverse) : nan;
      bits[i] = static_cast<std::uint16_t>(any ? bits[i] & ~flag::invalid : bits[i] | flag::invalid);
      const double variance =
          std::max(sums_.squares[i] - sums_.sum[i] * sums_.sum[i] * inverse, 0.0) / std::max(n - 1, 1.0);
      const float single = sigma.made_here() ? nan : deviations[i];
      deviations[i] = n > 1 ? static_cast<float>(std::sqrt(variance * inverse)) : any ? single : nan;
    }
    const double frames_taken = static_cast<double>(taken_);
    for (std::size_t i = 0; i < amplitudes.size(); ++i)
      amplitudes[i] = static_cast<float>(sums_.amplitude[i] / frames_taken);
  }

  PixelSums sums_;
  std::deque<Taken> window_;           // running only
  Taken spare_;                        // memory of the last frame that left the window
  std::vector<std::uint16_t> joined_;  // otherwise
  std::int64_t taken_ = 0;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Average, "Temporal mean over frames, valid pixels only, with the deviation of the mean")
