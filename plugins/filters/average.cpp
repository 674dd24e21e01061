// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Temporal mean over frames. The loops are plain: Highway compiles them for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/average.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <hwy/highway.h>
#include <tofgraph/stage.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "plugins/filters/other_lengths.hpp"

#ifndef TOFGRAPH_AVERAGE_ONCE
#define TOFGRAPH_AVERAGE_ONCE
namespace tofgraph {

/// Sums of each pixel over the frames in which it is a number. Lengths count from the pixel's first value, so that the
/// difference of two large sums keeps its digits.
struct PixelSums {
  float* reference;
  double *sum, *squares, *amplitude;
  std::int32_t *valid, *lit;  // numbers in the sums of lengths and of amplitudes
};

/// Pixels that are done together, so that their sums stay in the cache.
constexpr std::size_t average_block = 2048;

/// What is given for each pixel.
struct PixelMeans {
  float *values, *deviations, *amplitudes;  // amplitudes: null where there are none
  std::uint16_t* flags;
  bool keep_single;  // deviations hold what came in: right for a single valid value
};

}  // namespace tofgraph
#endif

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

/// Adds a frame's pixels first .. last - 1, or with sign -1 takes them out.
void Add(const PixelSums& sums, const float* lengths, const float* amplitudes, int sign, std::size_t first,
         std::size_t last) {
  constexpr float most = std::numeric_limits<float>::max();
  float* __restrict reference = sums.reference;
  double* __restrict sum = sums.sum, * __restrict squares = sums.squares, * __restrict amplitude = sums.amplitude;
  std::int32_t* __restrict valid = sums.valid, * __restrict lit = sums.lit;
  const double factor = sign;
  for (std::size_t i = first; i < last; ++i) {
    const bool finite = std::abs(lengths[i]) <= most;
    const float origin = finite & (valid[i] == 0) ? lengths[i] : reference[i];
    const double value = static_cast<double>(finite ? lengths[i] : origin) - static_cast<double>(origin);
    reference[i] = origin;
    sum[i] += factor * value;
    squares[i] += factor * value * value;
    valid[i] += finite ? sign : 0;
  }
  if (amplitudes == nullptr) return;
  for (std::size_t i = first; i < last; ++i) {
    const bool finite = std::abs(amplitudes[i]) <= most;
    const std::uint32_t mask = finite ? ~0U : 0U;  // a choice of floats would be a jump
    amplitude[i] +=
        factor * static_cast<double>(std::bit_cast<float>(std::bit_cast<std::uint32_t>(amplitudes[i]) & mask));
    lit[i] += finite ? sign : 0;
  }
}

/// Mean, and sd (n - 1) / sqrt(n) of it, of at most a block.
void Give(const PixelSums& sums, const PixelMeans& means, std::size_t first, std::size_t last) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  float* __restrict values = means.values, * __restrict deviations = means.deviations;
  std::uint16_t* __restrict flags = means.flags;
  const std::int32_t* __restrict valid = sums.valid;
  const float* __restrict reference = sums.reference;
  const double* __restrict sum = sums.sum, * __restrict squares = sums.squares;
  float spread[average_block], mean[average_block];  // whole first, chosen from afterwards: no jumps in either loop
  for (std::size_t i = first; i < last; ++i) {
    const std::int32_t n = valid[i], some = n > 1 ? n : 1, free = n > 2 ? n - 1 : 1;
    const double inverse = 1.0 / some, left = squares[i] - sum[i] * sum[i] * inverse;
    // Rounding can leave a little less than 0.
    spread[i - first] = static_cast<float>(std::sqrt((left + std::abs(left)) / 2 * inverse / free));
    mean[i - first] = static_cast<float>(static_cast<double>(reference[i]) + sum[i] * inverse);
  }
  if (!means.keep_single) std::fill(deviations + first, deviations + last, nan);
  for (std::size_t i = first; i < last; ++i) {
    const float single = deviations[i], deviation = spread[i - first], value = mean[i - first];
    const float known = valid[i] > 0 ? single : nan;
    deviations[i] = valid[i] > 1 ? deviation : known;
    values[i] = valid[i] > 0 ? value : nan;
  }
  for (std::size_t i = first; i < last; ++i) {
    const int others = flags[i] & ~flag::invalid;
    flags[i] = static_cast<std::uint16_t>(others | (sums.valid[i] > 0 ? 0 : flag::invalid));
  }
  if (means.amplitudes == nullptr) return;
  float* __restrict amplitudes = means.amplitudes;
  for (std::size_t i = first; i < last; ++i) {
    const std::int32_t n = sums.lit[i], some = n > 1 ? n : 1;
    const float absent = n > 0 ? 0.0F : nan;
    amplitudes[i] = static_cast<float>(sums.amplitude[i] / some) + absent;
  }
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tofgraph {

HWY_EXPORT(Add);
HWY_EXPORT(Give);

/// Temporal mean, pixel by pixel, over the frames in which the pixel is valid. sigma becomes the standard deviation of
/// that mean as the frames themselves show it, sd (n-1) / sqrt(n); of a single valid value it stays what came in.
/// A pixel that is valid in no frame stays invalid. The other flags are those of any of the frames; metadata and all
/// other channels are those of the last.
struct Average final : Filter {
  InOut<float> image{this, "depth|range|distance", {.text = "what is averaged", .adds = "averaged"}};
  InOut<float> amplitude{
      this, "amplitude", {.text = "averaged too, over the frames in which it is a number", .optional = true}};
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
    const std::uint64_t come = setup.stream().frames, wanted = static_cast<std::uint64_t>(*frames);
    if (*running && *frames > 1000)
      throw ConfigError("frames", "a running mean keeps every frame of its window: at most 1000 are allowed");
    if (!*running && come > 0 && come < wanted) {
      throw ConfigError("frames", std::to_string(come) + " frames come in, not enough for one mean of " +
                                      std::to_string(wanted) + ": write frames: " + std::to_string(come) + " or less");
    }
    if (!*running) setup.set_frames(come / wanted, setup.stream().known);
    flags.provide(setup);
    sigma.provide(setup, image.channel());
    lengths_.prepare(setup, {image.channel(), "sigma"});
  }

  /// @returns false while the frames of a mean are being collected
  bool process(Frame& frame) {
    const Array<float> values = image(frame), amplitudes = amplitude(frame);
    const Array<std::uint16_t> bits = flags(frame, values.rows(), values.columns());
    if (valid_.size() != values.size()) clear(values.size());
    if (*running) {
      run(values, amplitudes, bits, sigma(frame, values.rows(), values.columns()));
    } else {
      collect(values, amplitudes, bits);
      if (++taken_ < *frames) return false;
      std::ranges::copy(joined_, bits.begin());
      const Array<float> deviations = sigma(frame, values.rows(), values.columns());
      for (std::size_t first = 0; first < values.size(); first += block)
        give(values, amplitudes, bits, deviations, first, std::min(first + block, values.size()));
      clear(values.size());
    }
    lengths_.invalidate(frame, bits);
    return true;
  }

  void finish() const {
    if (*running || taken_ == 0) return;
    warn("the last " + std::to_string(taken_) + " frames do not fill a mean of " + std::to_string(*frames) +
         " and are left out");
  }

 private:
  /// What is kept of each frame of a running mean.
  struct Taken {
    std::vector<float> values, amplitudes;
    std::vector<std::uint16_t> flags;
  };

  static constexpr std::size_t block = average_block;

  PixelSums sums() {
    return {reference_.data(), sum_.data(), squares_.data(), amplitude_.data(), valid_.data(), lit_.data()};
  }

  void clear(std::size_t pixels) {
    taken_ = 0;
    window_.clear();
    joined_.assign(pixels, 0);
    for (auto* values : {&sum_, &squares_, &amplitude_}) values->resize(pixels);
    reference_.resize(pixels);
    valid_.resize(pixels);
    lit_.resize(pixels);
    zero(0, pixels);
  }

  void zero(std::size_t first, std::size_t last) {
    for (auto* values : {&sum_, &squares_, &amplitude_}) std::fill(&(*values)[first], values->data() + last, 0.0);
    std::fill(reference_.data() + first, reference_.data() + last, 0.0F);
    std::fill(valid_.data() + first, valid_.data() + last, 0);
    std::fill(lit_.data() + first, lit_.data() + last, 0);
  }

  void add(const float* values, const float* amplitudes, int sign, std::size_t first, std::size_t last) {
    HWY_DYNAMIC_DISPATCH(Add)(sums(), values, amplitudes, sign, first, last);
  }
  void add(const Taken& taken, int sign, std::size_t first, std::size_t last) {
    add(taken.values.data(), taken.amplitudes.empty() ? nullptr : taken.amplitudes.data(), sign, first, last);
  }

  void give(const Array<float>& values, const Array<float>& amplitudes, const Array<std::uint16_t>& bits,
            const Array<float>& deviations, std::size_t first, std::size_t last) {
    const PixelMeans means{.values = values.data(),
                           .deviations = deviations.data(),
                           .amplitudes = amplitudes.data(),
                           .flags = bits.data(),
                           .keep_single = !sigma.made_here()};
    HWY_DYNAMIC_DISPATCH(Give)(sums(), means, first, last);
  }

  void collect(const Array<float>& values, const Array<float>& amplitudes, const Array<std::uint16_t>& bits) {
    add(values.data(), amplitudes.data(), 1, 0, values.size());
    for (std::size_t i = 0; i < values.size(); ++i) joined_[i] = static_cast<std::uint16_t>(joined_[i] | bits[i]);
  }

  /// The newest frame takes the place of the oldest, block by block.
  void run(const Array<float>& values, const Array<float>& amplitudes, const Array<std::uint16_t>& bits,
           const Array<float>& deviations) {
    const auto place = static_cast<std::size_t>(taken_ % *frames);
    const bool full = place < window_.size();
    if (!full)
      window_.push_back({std::vector<float>(values.size()), std::vector<float>(amplitudes.size()),
                         std::vector<std::uint16_t>(values.size())});
    Taken& slot = window_[place];
    for (std::size_t first = 0; first < values.size(); first += block) {
      const std::size_t last = std::min(first + block, values.size());
      if (full) add(slot, -1, first, last);
      std::copy(values.data() + first, values.data() + last, slot.values.data() + first);
      if (amplitudes) std::copy(amplitudes.data() + first, amplitudes.data() + last, slot.amplitudes.data() + first);
      std::copy(bits.data() + first, bits.data() + last, slot.flags.data() + first);
      if (is_due(first / block, values.size()))
        remake(first, last);
      else
        add(slot, 1, first, last);
      join(bits.data(), first, last);
      give(values, amplitudes, bits, deviations, first, last);
    }
    ++taken_;
  }

  /// Sums that values were taken out of keep what was rounded away, and count from a value of long ago: one block after
  /// the other is summed anew, each after at most as many frames as cost a quarter of a frame's sums.
  bool is_due(std::size_t index, std::size_t pixels) const {
    const auto blocks = static_cast<std::int64_t>((pixels + block - 1) / block), pause = (*frames + 3) / 4;
    return taken_ % pause == 0 && taken_ / pause % blocks == static_cast<std::int64_t>(index);
  }

  void remake(std::size_t first, std::size_t last) {
    zero(first, last);
    for (const Taken& taken : window_) add(taken, 1, first, last);
  }

  void join(std::uint16_t* bits, std::size_t first, std::size_t last) const {
    for (const Taken& taken : window_) {
      for (std::size_t i = first; i < last; ++i) bits[i] = static_cast<std::uint16_t>(bits[i] | taken.flags[i]);
    }
  }

  std::vector<float> reference_;
  std::vector<double> sum_, squares_, amplitude_;
  std::vector<std::int32_t> valid_, lit_;
  std::vector<Taken> window_;          // running only
  std::vector<std::uint16_t> joined_;  // otherwise
  std::int64_t taken_ = 0;             // frames so far; of a mean that is no running one
  OtherLengths lengths_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Average, "Temporal mean over frames, valid pixels only, with the deviation of the mean")
#endif
