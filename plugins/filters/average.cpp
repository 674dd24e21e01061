// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Temporal mean over frames. Highway compiles the plain loops for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/average.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <hwy/highway.h>
#include <tofgraph/lengths.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "config/log.hpp"
#include "plugins/filters/distance_repeat.hpp"

#ifndef TOFGRAPH_AVERAGE_ONCE
#define TOFGRAPH_AVERAGE_ONCE
namespace tofgraph {

/// Sums of each pixel over the frames in which it is not NaN. Lengths are relative to the pixel's first value, so that
/// the difference of two large sums keeps its digits, and wrapped distances are taken at the period nearest to it.
struct PixelSums {
  float *reference, *single, *wraps;  // single: sigma of the last frame in which the pixel was valid
  double *sum, *squares, *amplitude;
  std::int32_t *valid, *lit;  // number of terms in the sums of lengths and of amplitudes
  double period;              // m; 0: lengths do not wrap
};

/// Values of a pixel in a frame.
struct PixelValues {
  const float *lengths, *amplitudes, *deviations = nullptr;  // the last two: null if there are none

  PixelValues from(std::size_t pixel) const {
    const auto advanced = [&](const float* values) { return values == nullptr ? nullptr : values + pixel; };
    return {lengths + pixel, advanced(amplitudes), advanced(deviations)};
  }
};

/// Pixels processed together, so that their sums stay in the cache.
constexpr std::size_t average_block = 2048;

/// Means of each pixel.
struct PixelMeans {
  float *values, *deviations, *amplitudes;  // amplitudes: null if there are none
  std::uint16_t* flags;
};

}  // namespace tofgraph
#endif

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

/// Returns a or b. The operator ?: on floats compiles to a branch in image loops, which prevents vectorisation.
float Choose(bool first, float a, float b) {
  const std::uint32_t mask = first ? ~0U : 0U;
  return std::bit_cast<float>((std::bit_cast<std::uint32_t>(a) & mask) | (std::bit_cast<std::uint32_t>(b) & ~mask));
}

/// Adds a frame's pixels to the sums of a block and subtracts those of another.
template <bool wrapped>
void ExchangeLengths(const PixelSums& sums, const PixelValues& in, const PixelValues& out, std::size_t pixels) {
  float* __restrict reference = sums.reference;
  float* __restrict wraps = sums.wraps;
  double* __restrict sum = sums.sum, * __restrict squares = sums.squares, * __restrict amplitude = sums.amplitude;
  std::int32_t* __restrict valid = sums.valid, * __restrict lit = sums.lit;
  const double period = sums.period, frequency = period > 0 ? 1 / period : 0;
  const float *now = in.lengths, *old = out.lengths;
  for (std::size_t i = 0; i < pixels; ++i) {
    const bool comes = is_valid_length(now[i]), goes = is_valid_length(old[i]);
    const std::int32_t left = valid[i] - (goes ? 1 : 0);
    const float before = reference[i], origin = Choose(comes & (left == 0), now[i], before);
    const double lost = static_cast<double>(Choose(goes, old[i], before)) - static_cast<double>(before);
    const double added = static_cast<double>(Choose(comes, now[i], origin)) - static_cast<double>(origin);
    const double lost_wraps = wrapped ? std::nearbyint(lost * frequency) : 0;
    const double added_wraps = wrapped ? std::nearbyint(added * frequency) : 0;
    const double gone = lost - period * lost_wraps, come = added - period * added_wraps;
    reference[i] = origin;
    if (wrapped) wraps[i] += static_cast<float>(added_wraps - lost_wraps);
    sum[i] += come - gone;
    squares[i] += come * come - gone * gone;
    valid[i] = left + (comes ? 1 : 0);
  }
  float* __restrict single = sums.single;
  for (std::size_t i = 0; in.deviations != nullptr && i < pixels; ++i)
    single[i] = Choose(is_valid_length(now[i]), in.deviations[i], single[i]);
  if (in.amplitudes == nullptr) return;
  constexpr float most = std::numeric_limits<float>::max();
  now = in.amplitudes, old = out.amplitudes;
  for (std::size_t i = 0; i < pixels; ++i) {
    const bool comes = std::abs(now[i]) <= most, goes = std::abs(old[i]) <= most;
    amplitude[i] += static_cast<double>(Choose(comes, now[i], 0)) - static_cast<double>(Choose(goes, old[i], 0));
    lit[i] += (comes ? 1 : 0) - (goes ? 1 : 0);
  }
}

void Exchange(const PixelSums& sums, const PixelValues& in, const PixelValues& out, std::size_t pixels) {
  // Without the division into periods the loop is three times as fast.
  if (sums.period > 0)
    ExchangeLengths<true>(sums, in, out, pixels);
  else
    ExchangeLengths<false>(sums, in, out, pixels);
}

/// Mean and its standard deviation sd (n - 1) / sqrt(n), for one block at most.
void Give(const PixelSums& sums, const PixelMeans& means, std::size_t first, std::size_t last) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  float* __restrict values = means.values, * __restrict deviations = means.deviations;
  std::uint16_t* __restrict flags = means.flags;
  const std::int32_t* __restrict valid = sums.valid;
  const float* __restrict reference = sums.reference, * __restrict singles = sums.single;
  const float* __restrict wraps = sums.wraps;
  const double* __restrict sum = sums.sum, * __restrict squares = sums.squares;
  const auto period = static_cast<float>(sums.period);
  float spread[average_block], mean[average_block];  // selected afterwards: no branches in either loop
  for (std::size_t i = first; i < last; ++i) {
    const std::int32_t n = valid[i], some = n > 1 ? n : 1, free = n > 2 ? n - 1 : 1;
    const auto count = static_cast<float>(some);
    // Only the difference needs all digits. Rounding can make it slightly negative.
    const auto left = static_cast<float>(some * squares[i] - sum[i] * sum[i]);
    spread[i - first] = std::sqrt((left + std::abs(left)) / 2 / (count * count * static_cast<float>(free)));
    // Lengths that do not wrap here may exceed the period: corrected or unwrapped ones.
    const float near = reference[i] + static_cast<float>(sum[i]) / count;
    const float above = Choose(near < 0, near + period, near), folded = Choose(above >= period, above - period, above);
    mean[i - first] = Choose(wraps[i] != 0, folded, near);
  }
  for (std::size_t i = first; i < last; ++i) {
    const float single = singles[i], deviation = spread[i - first], value = mean[i - first];
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
    amplitudes[i] = static_cast<float>(sums.amplitude[i]) / static_cast<float>(some) + absent;
  }
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tofgraph {

HWY_EXPORT(Exchange);
HWY_EXPORT(Give);

/// Temporal mean of each pixel over the frames in which it is valid. sigma becomes the standard deviation of that mean,
/// estimated from the frames: sd (n-1) / sqrt(n); for a single valid value its sigma is kept. A pixel valid in no frame
/// stays invalid. Distances are averaged modulo the distance at which they repeat, which keeps the mean of pixels near
/// its end correct. Other flags are combined over the frames; metadata and all other channels are those of the last.
struct Average final : Filter {
  InOut<float> image{this, "depth|range|distance", {.text = "channel to average", .adds = "averaged"}};
  InOut<float> amplitude{
      this, "amplitude", {.optional = true, .text = "also averaged, over the frames in which it is a number"}};
  InOut<float> sigma{this, "sigma", {.optional = true, .text = "created or replaced: sigma of the mean"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "combined over the frames"}};
  Param<std::int64_t> frames{
      this,
      "frames",
      {.default_value = "10", .min = 1, .max = 1e6, .text = "number of frames that are averaged into one"}};
  Param<bool> running{
      this, "running", {.default_value = "false", .text = "one mean for each incoming frame, over the last `frames`"}};
  Param<Choice> channel{this,
                        "channel",
                        {.default_value = "auto",
                         .choices = "auto depth range distance",
                         .text = "channel to average; auto: the first of these that exists"}};

  void prepare(Setup& setup) {
    const std::uint64_t come = setup.stream().frames, wanted = static_cast<std::uint64_t>(*frames);
    if (*running && *frames > 1000)
      throw ConfigError("frames", "a running mean keeps every frame of its window: at most 1000 are allowed");
    if (!*running && come > 0 && come < wanted) {
      throw ConfigError("frames", config::counted(come, "frame") + " in all, not enough for one mean of " +
                                      std::to_string(wanted) + ": write frames: " + std::to_string(come) + " or less");
    }
    if (!*running) setup.set_frames(come / wanted, setup.stream().known);
    flags.provide(setup);
    sigma.provide(setup, image.channel());
    repeat_.prepare(setup, image.channel());
    lengths_.prepare(setup, {image.channel(), "sigma"});
  }

  /// @returns false while the frames of a mean are being collected
  bool process(Frame& frame) {
    const Array<float> values = image(frame), amplitudes = amplitude(frame);
    const Array<std::uint16_t> bits = flags(frame, values.rows(), values.columns());
    if (valid_.size() != values.size()) clear(values.size());
    if (taken_ == 0) period_ = repeat_.of(frame);
    const PixelValues now{values.data(), amplitudes.data(), sigma.made_here() ? nullptr : sigma(frame).data()};
    if (*running) {
      run(now, values, amplitudes, bits, sigma(frame, values.rows(), values.columns()));
    } else {
      collect(now, bits);
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
    warn("the last " + config::counted(static_cast<std::uint64_t>(taken_), "frame") +
         " discarded: too few for a mean of " + std::to_string(*frames));
  }

 private:
  /// Data kept for each frame of a running mean.
  struct Taken {
    std::vector<float> values, amplitudes;
    std::vector<std::uint16_t> flags;

    PixelValues pixels() const { return {values.data(), amplitudes.empty() ? nullptr : amplitudes.data()}; }
  };

  static constexpr std::size_t block = average_block;

  PixelSums sums(std::size_t first) {
    return {.reference = &reference_[first],
            .single = &single_[first],
            .wraps = &wraps_[first],
            .sum = &sum_[first],
            .squares = &squares_[first],
            .amplitude = &amplitude_[first],
            .valid = &valid_[first],
            .lit = &lit_[first],
            .period = period_};
  }

  void clear(std::size_t pixels) {
    taken_ = 0;
    window_.clear();
    joined_.assign(pixels, 0);
    for (auto* values : {&sum_, &squares_, &amplitude_}) values->resize(pixels);
    for (auto* values : {&reference_, &wraps_}) values->resize(pixels);
    single_.assign(pixels, std::numeric_limits<float>::quiet_NaN());
    valid_.resize(pixels);
    lit_.resize(pixels);
    zero(0, pixels);
  }

  void zero(std::size_t first, std::size_t last) {
    for (auto* values : {&sum_, &squares_, &amplitude_}) std::fill(&(*values)[first], values->data() + last, 0.0);
    for (auto* values : {&reference_, &wraps_}) std::fill(&(*values)[first], values->data() + last, 0.0F);
    std::fill(valid_.data() + first, valid_.data() + last, 0);
    std::fill(lit_.data() + first, lit_.data() + last, 0);
  }

  void exchange(const PixelValues& in, const PixelValues& out, std::size_t first, std::size_t last) {
    HWY_DYNAMIC_DISPATCH(Exchange)(sums(first), in.from(first), out, last - first);
  }
  void add(const PixelValues& in, std::size_t first, std::size_t last) {
    static const std::vector<float> nothing(block, std::numeric_limits<float>::quiet_NaN());
    exchange(in, {nothing.data(), nothing.data()}, first, last);
  }

  void give(const Array<float>& values, const Array<float>& amplitudes, const Array<std::uint16_t>& bits,
            const Array<float>& deviations, std::size_t first, std::size_t last) {
    const PixelMeans means{.values = values.data(),
                           .deviations = deviations.data(),
                           .amplitudes = amplitudes.data(),
                           .flags = bits.data()};
    HWY_DYNAMIC_DISPATCH(Give)(sums(0), means, first, last);
  }

  void collect(const PixelValues& now, const Array<std::uint16_t>& bits) {
    for (std::size_t first = 0; first < bits.size(); first += block)
      add(now, first, std::min(first + block, bits.size()));
    for (std::size_t i = 0; i < bits.size(); ++i) joined_[i] = static_cast<std::uint16_t>(joined_[i] | bits[i]);
  }

  /// Replaces the oldest frame by the newest, block by block.
  void run(const PixelValues& now, const Array<float>& values, const Array<float>& amplitudes,
           const Array<std::uint16_t>& bits, const Array<float>& deviations) {
    const auto place = static_cast<std::size_t>(taken_ % *frames);
    const bool full = place < window_.size();
    if (!full)
      window_.push_back({std::vector<float>(values.size()), std::vector<float>(amplitudes.size()),
                         std::vector<std::uint16_t>(values.size())});
    Taken& slot = window_[place];
    for (std::size_t first = 0; first < values.size(); first += block) {
      const std::size_t last = std::min(first + block, values.size());
      if (full)
        exchange(now, slot.pixels().from(first), first, last);
      else
        add(now, first, last);
      std::copy(values.data() + first, values.data() + last, slot.values.data() + first);
      if (amplitudes) std::copy(amplitudes.data() + first, amplitudes.data() + last, slot.amplitudes.data() + first);
      std::copy(bits.data() + first, bits.data() + last, slot.flags.data() + first);
      if (is_due(first / block, values.size())) remake(first, last);
      join(bits.data(), first, last);
      give(values, amplitudes, bits, deviations, first, last);
    }
    ++taken_;
  }

  /// Returns whether a block's sums are due for recomputation: subtractions leave rounding errors, and the reference
  /// value becomes old. The blocks take turns; the interval limits the cost to a quarter of a frame's sums.
  bool is_due(std::size_t index, std::size_t pixels) const {
    const auto blocks = static_cast<std::int64_t>((pixels + block - 1) / block), pause = (*frames + 3) / 4;
    return taken_ % pause == 0 && taken_ / pause % blocks == static_cast<std::int64_t>(index);
  }

  void remake(std::size_t first, std::size_t last) {
    zero(first, last);
    for (const Taken& taken : window_) add(taken.pixels(), first, last);
  }

  void join(std::uint16_t* bits, std::size_t first, std::size_t last) const {
    for (const Taken& taken : window_) {
      for (std::size_t i = first; i < last; ++i) bits[i] = static_cast<std::uint16_t>(bits[i] | taken.flags[i]);
    }
  }

  std::vector<float> reference_, single_, wraps_;
  std::vector<double> sum_, squares_, amplitude_;
  std::vector<std::int32_t> valid_, lit_;
  std::vector<Taken> window_;          // only for a running mean
  std::vector<std::uint16_t> joined_;  // only for other means
  std::int64_t taken_ = 0;             // frames so far, of this mean or of all running ones
  double period_ = 0;                  // m, of the first frame; 0: lengths do not wrap
  DistanceRepeat repeat_;
  OtherLengths lengths_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Average, "Temporal mean over frames, valid pixels only, with the deviation of the mean")
#endif
