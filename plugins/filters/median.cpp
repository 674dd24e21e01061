// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tofgraph/lengths.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "plugins/filters/neighbourhood.hpp"

namespace tofgraph {

/// Median of the valid pixels of a square window, clipped at the image's border; for an even number the mean of the two
/// middle values. An invalid pixel stays invalid.
///
/// sigma becomes that of the median of n normally distributed, independent values, s sqrt(q / (n - 1 + q)): s the
/// harmonic mean of their deviations, q = acos(v / (v + s^2)) (v + s^2) / s^2, pi / 2 on a flat surface. v is 1.4 times
/// the variance of the surface in the window, estimated as the variance of the lengths minus that of their noise; 1
/// would be right for normally distributed steps, 1.9 for uniform ones, and slopes lie in between. Accurate to 4 % of
/// the spread on a flat surface and to 10 % on slopes of at most 2 s per pixel; at edges up to twice the spread.
struct Median final : LengthFilter {
  Param<std::int64_t> window{
      this, "window", {.default_value = "3", .min = 1, .max = 63, .text = "side of the square window in pixels, odd"}};
  Param<bool> fill{this,
                   "fill",
                   {.default_value = "false",
                    .text = "an invalid pixel takes the median of the filtered ones in its window, if at least half "
                            "of the window is valid, and is flagged as filled",
                    .live = true}};

  void prepare(Setup& setup) {
    check_window(*setup.find(image.channel()), "window", *window);
    prepare_lengths(setup);
  }

  void process(Frame& frame) const {
    const Lengths in = begin(frame);
    if (!in.any) return;
    const Array<float>&lengths = in.image, &deviations = in.sigma;
    const Array<std::uint16_t>& bits = in.flags;
    const std::vector<float> before(lengths.begin(), lengths.end()), noise(deviations.begin(), deviations.end());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, lengths.rows(), 16),
                      [&](const tbb::blocked_range<std::size_t>& rows) {
                        std::vector<float> values;
                        for (std::size_t r = rows.begin(); r < rows.end(); ++r)
                          filter_row(r, before, noise, lengths, deviations, values);
                      });
    if (*fill) fill_invalid(lengths, deviations, bits, radius());
  }

 private:
  std::size_t radius() const { return static_cast<std::size_t>(*window / 2); }

  void filter_row(std::size_t r, const std::vector<float>& before, const std::vector<float>& noise,
                  const Array<float>& lengths, const Array<float>& deviations, std::vector<float>& values) const {
    for (std::size_t c = 0; c < lengths.columns(); ++c) {
      if (std::isnan(lengths(r, c))) continue;
      gather_window(before.data(), lengths.rows(), lengths.columns(), r, c, radius(), values);
      const std::size_t used = values.size();
      const float spread = variance_of(values);
      lengths(r, c) = median_of(values);
      if (!deviations) continue;
      gather_window(noise.data(), lengths.rows(), lengths.columns(), r, c, radius(), values);
      const bool known = values.size() == used;  // else a pixel's noise is unknown
      deviations(r, c) = known ? deviation_of_median(values, spread) : std::numeric_limits<float>::quiet_NaN();
    }
  }

  /// Variance of the values about their mean; 0 for a single value.
  static float variance_of(const std::vector<float>& values) {
    const auto n = static_cast<float>(values.size());
    float sum = 0, squares = 0;
    for (const float v : values) sum += v - values.front();
    for (const float v : values) squares += std::pow(v - values.front() - sum / n, 2.0F);
    return squares / std::max(n - 1, 1.0F);
  }

  /// sigma of the median. @param noise deviations of the values @param spread variance of the values, including noise
  static float deviation_of_median(const std::vector<float>& noise, float spread) {
    constexpr float slopes = 1.4F;
    const auto n = static_cast<float>(noise.size());
    float variance = 0, inverse = 0;
    for (const float s : noise) {
      variance += s * s / n;
      inverse += 1 / s;
    }
    const float level = n / inverse * (n / inverse), surface = slopes * std::max(spread - variance, 0.0F);
    if (!(level > 0)) return 0;
    const float q = std::acos(surface / (surface + level)) * (surface + level) / level;
    return std::sqrt(level * q / (n - 1 + q));
  }
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Median, "The median of each pixel's window, valid pixels only")
