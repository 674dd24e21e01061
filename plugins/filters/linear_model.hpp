// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Base of distance models with a depth linear in the distance: z = offset + slope D.
#pragma once

#include <tofgraph/physics/non_linearity.hpp>

#include <limits>
#include <vector>

#include "plugins/filters/distance_model.hpp"

namespace tofgraph {

/// Coefficients of every pixel, in the precision of the images: 2 um at 7.4 m.
struct LinearTable {
  std::vector<float> offset, slope;
};

/// Arithmetic of such a model. A depth behind the lens is invalid.
struct LinearModel : DistanceModel {
 protected:
  /// Fills a table from model(ray).
  template <class Model> LinearTable table(Model&& model) const {
    LinearTable result;
    for (const physics::Vector3& ray : rays) {
      const physics::LinearDepth pixel = model(ray);
      result.offset.push_back(static_cast<float>(pixel.offset));
      result.slope.push_back(static_cast<float>(pixel.slope));
    }
    return result;
  }

  void apply(const Frame& frame, const LinearTable& pixels) const {
    const Array<const float> input = measured(frame);
    const Array<float> corrected = depth(frame, rows, columns);
    const Array<float> deviation = sigma(frame);
    const Array<std::uint16_t> bits = flags(frame, rows, columns);
    const float *d = input.data(), *offset = pixels.offset.data(), *slope = pixels.slope.data();
    float* z = corrected.data();
    std::uint16_t* flag_bits = bits.data();
    const auto lens = static_cast<float>(geometry.focal_length);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < input.size(); ++i) {
      const float value = offset[i] + slope[i] * d[i];
      const bool good = value > lens && is_valid_length(d[i]) && (flag_bits[i] & flag::invalid) == 0;
      z[i] = good ? value : nan;
      flag_bits[i] = static_cast<std::uint16_t>(flag_bits[i] | (good ? 0 : flag::invalid));
    }
    lengths.invalidate(frame, bits);
    if (!deviation) return;
    for (std::size_t i = 0; i < input.size(); ++i) deviation[i] = z[i] == z[i] ? deviation[i] * slope[i] : nan;
  }
};

}  // namespace tofgraph
