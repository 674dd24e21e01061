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

/// The median of the valid pixels of a square window, clipped at the image's border; of an even number the mean of the
/// two in the middle. An invalid pixel stays invalid.
///
/// sigma becomes that of the median of n equal, normally distributed, independent values, s sqrt(q / (n - 1 + q)) with
/// q = pi / 2 and s^2 the mean of their variances: exact for one value and for many, within 2 % between.
struct Median final : LengthFilter {
  Param<std::int64_t> window{
      this, "window", {.default_value = "3", .min = 1, .max = 63, .text = "side of the square window in pixels, odd"}};
  Param<bool> fill{this,
                   "fill",
                   {.default_value = "false",
                    .text = "an invalid pixel takes the median of the filtered ones in its window, if at least half "
                            "of the window is valid, and is flagged as filled"}};

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
      lengths(r, c) = median_of(values);
      if (!deviations) continue;
      gather_window(noise.data(), lengths.rows(), lengths.columns(), r, c, radius(), values);
      constexpr float q = std::numbers::pi_v<float> / 2;
      if (values.size() != used) {  // one of the pixels does not know its noise
        deviations(r, c) = std::numeric_limits<float>::quiet_NaN();
        continue;
      }
      const auto n = static_cast<float>(used);
      float variance = 0;
      for (const float s : values) variance += s * s / n;
      deviations(r, c) = std::sqrt(variance * q / (n - 1 + q));
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Median, "The median of each pixel's window, valid pixels only")
