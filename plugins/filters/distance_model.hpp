// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Ports of the models that convert distance to depth.
#pragma once

#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/geometry.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace tofgraph {

/// Common part of filters that convert `distance` to `depth` by a model of its errors.
struct DistanceModel : Filter {
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
    try {
      geometry = physics::geometry_of(setup.camera());
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(
          std::string(error.what()) +
          "; without such data leave this stage out and write point_cloud assume=range, which takes "
          "distances for ranges");
    }
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

  /// Distances of a frame, rows x columns. @throws std::runtime_error if the size is not the camera's
  Array<const float> measured(const Frame& frame) const {
    const Array<const float> image = distance(frame);
    if (image.rows() != rows || image.columns() != columns) {
      throw std::runtime_error("distance is " + std::to_string(image.rows()) + " x " + std::to_string(image.columns()) +
                               ", the camera has " + std::to_string(rows) + " x " + std::to_string(columns));
    }
    return image;
  }

  physics::Geometry geometry;
  std::size_t rows = 0, columns = 0;
  std::vector<physics::Vector3> rays;
  OtherLengths lengths;
};

}  // namespace tofgraph
