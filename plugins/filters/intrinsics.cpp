// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Replaces the lens of the camera, and with it the rays. Images are not touched.
#include <tofgraph/stage.hpp>

#include <cmath>
#include <string>
#include <vector>

#include "physics/lens.hpp"

namespace tofgraph {

/// What is not given stays as the camera has it. Where the pixel pitch is known, new focal lengths in pixels also give
/// the focal length in metres: the mean of fx times the pitch in x and fy times the pitch in y.
struct Intrinsics final : Filter {
  InOut<float> rays{this, "rays", {.text = "unit vector of each pixel, made anew"}};
  Param<double> fx{this, "fx", {.unit = "px", .min = 1e-3, .text = "focal length in x"}};
  Param<double> fy{this, "fy", {.unit = "px", .min = 1e-3, .text = "focal length in y"}};
  Param<double> cx{this, "cx", {.unit = "px", .text = "principal point in x, a pixel's centre at integers from 0"}};
  Param<double> cy{this, "cy", {.unit = "px", .text = "principal point in y, a pixel's centre at integers from 0"}};
  Param<double> k1{this, "k1", {.text = "radial distortion, OpenCV's model"}};
  Param<double> k2{this, "k2", {.text = "radial distortion, OpenCV's model"}};
  Param<double> p1{this, "p1", {.text = "tangential distortion, OpenCV's model"}};
  Param<double> p2{this, "p2", {.text = "tangential distortion, OpenCV's model"}};
  Param<double> k3{this, "k3", {.text = "radial distortion, OpenCV's model"}};

  void prepare(Setup& setup) {
    tofgraph_camera camera = setup.camera();
    if (!change(camera))
      throw ConfigError("fx",
                        "nothing is replaced: give at least one of fx fy cx cy k1 k2 p1 p2 k3, e.g. fx: 316.75 px");
    std::vector<float> table(std::size_t{camera.width} * camera.height * 3);
    physics::pixel_rays(camera, table.data());
    camera.rays = table.data();
    report_outside(table);
    setup.set_camera(camera);
  }

  void process(Frame&) const {}  // the frames carry the new camera's rays

 private:
  /// @returns whether anything was given
  bool change(tofgraph_camera& camera) const {
    bool changed = false;
    const auto set = [&changed](const Param<double>& given, double& value) {
      if (given.given()) value = *given;
      changed = changed || given.given();
      return given.given();
    };
    const bool new_x = set(fx, camera.focal_px[0]), new_y = set(fy, camera.focal_px[1]);
    const double metres = (camera.focal_px[0] * camera.pitch[0] + camera.focal_px[1] * camera.pitch[1]) / 2;
    if ((new_x || new_y) && std::isfinite(metres)) camera.focal_length = metres;
    set(cx, camera.principal_point[0]);
    set(cy, camera.principal_point[1]);
    const Param<double>* const distortion[] = {&k1, &k2, &p1, &p2, &k3};
    for (std::size_t i = 0; i < 5; ++i) set(*distortion[i], camera.distortion[i]);
    return changed;
  }

  void report_outside(const std::vector<float>& table) const {
    std::size_t outside = 0;
    for (std::size_t i = 0; i < table.size(); i += 3) outside += std::isnan(table[i]) ? 1U : 0U;
    if (outside * 3 == table.size()) throw std::runtime_error("no pixel lies within this lens model");
    if (outside > 0) {
      warn(std::to_string(outside) + " of " + std::to_string(table.size() / 3) +
           " pixels lie outside the lens model and become invalid");
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Intrinsics, "Replaces the camera's lens and with it each pixel's ray")
