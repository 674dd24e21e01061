// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Base of distance models whose depth is linear in the distance: z = offset + slope D.
#pragma once

#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/non_linearity.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph {

/// Coefficients of every pixel, in the precision of the images: 2 um at 7.4 m.
struct LinearTable {
  std::vector<float> offset, slope;
};

/// The ports of such a model, and its arithmetic. A depth that would not be in front of the lens is invalid.
struct LinearModel : Filter {
  In<float> distance{this, "distance", {.text = "half of the travelled path", .refuses = "denoised non_linearity"}};
  Out<float> depth{
      this, "depth", {.text = "along z from the sensor plane", .from = "distance rays", .adds = "non_linearity"}};
  InOut<float> sigma{
      this,
      "sigma",
      {.optional = true, .text = "standard deviation of the distance; becomes that of the depth", .of = "depth"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created, or combined with the incoming flags"}};

 protected:
  void prepare_model(Setup& setup) {
    geometry = physics::geometry_of(setup.camera());
    if (sigma.present() && setup.find("sigma")->of != std::string_view("distance")) {
      throw std::runtime_error(std::string("sigma is that of '") + setup.find("sigma")->of +
                               "', expected that of 'distance'");
    }
    flags.provide(setup);
    lengths.prepare(setup, {"sigma"});
    rows = setup.camera().height;
    columns = setup.camera().width;
    for (std::size_t i = 0; i < rows * columns; ++i) rays.push_back(physics::unit_ray(setup.camera().rays + 3 * i));
  }

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
    const Array<const float> measured = distance(frame);
    if (measured.rows() != rows || measured.columns() != columns) {
      throw std::runtime_error("distance is " + std::to_string(measured.rows()) + " x " +
                               std::to_string(measured.columns()) + ", the camera has " + std::to_string(rows) + " x " +
                               std::to_string(columns));
    }
    const Array<float> corrected = depth(frame, rows, columns);
    const Array<float> deviation = sigma(frame);
    const Array<std::uint16_t> bits = flags(frame, rows, columns);
    const float *d = measured.data(), *offset = pixels.offset.data(), *slope = pixels.slope.data();
    float* z = corrected.data();
    std::uint16_t* flag_bits = bits.data();
    const auto lens = static_cast<float>(geometry.focal_length);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < measured.size(); ++i) {
      const float value = offset[i] + slope[i] * d[i];
      const bool good = value > lens && is_valid_length(d[i]) && (flag_bits[i] & flag::invalid) == 0;
      z[i] = good ? value : nan;
      flag_bits[i] = static_cast<std::uint16_t>(flag_bits[i] | (good ? 0 : flag::invalid));
    }
    lengths.invalidate(frame, bits);
    if (!deviation) return;
    for (std::size_t i = 0; i < measured.size(); ++i) deviation[i] = z[i] == z[i] ? deviation[i] * slope[i] : nan;
  }

  physics::Geometry geometry;
  std::size_t rows = 0, columns = 0;
  std::vector<physics::Vector3> rays;
  OtherLengths lengths;
};

}  // namespace tofgraph
