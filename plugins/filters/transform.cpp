// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/stage.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "io/calibration.hpp"

namespace tofgraph {

/// Computes p_world = R p_camera + t - shift for every point. R is given by the rows of a 3 x 3 matrix or by angles
/// about the fixed axes, first x, then y, then z: R = R_z R_y R_x, right-handed. The points are float32, t and shift
/// float64: with a shift to a round number nearby, points keep their precision in frames such as UTM.
struct Transform final : Filter {
  InOut<float> points{this, "points", {.refuses = "transform", .adds = "T_world_camera"}};
  InOut<float> normals{
      this, "normals", {.shape = "H W 3", .unit = "", .optional = true, .text = "turned with the points"}};
  Param<std::vector<double>> rotation{
      this, "rotation", {.default_value = "[1, 0, 0, 0, 1, 0, 0, 0, 1]", .text = "R of T_world_camera, row by row"}};
  Param<std::vector<double>> angles{
      this,
      "angles",
      {.unit = "rad", .default_value = "[0 deg, 0 deg, 0 deg]", .text = "instead: about x, then y, then z"}};
  Param<std::vector<double>> translation{
      this, "translation", {.unit = "m", .default_value = "[0 mm, 0 mm, 0 mm]", .text = "t of T_world_camera"}};
  Param<std::vector<double>> shift{
      this,
      "shift",
      {.unit = "m",
       .default_value = "[0 m, 0 m, 0 m]",
       .text = "subtracted from the moved points in double precision, e.g. [500000 m, 5400000 m, 0 m]; what leaves is "
               "relative to it, a viewpoint too"}};

  Param<InputFile> pose{
      this, "pose", {.text = "instead: T_world_camera as found by tofgraph pose; the world is the pattern's frame"}};

  void prepare(const Setup& setup) {
    if (!pose->empty()) return read_pose(setup.camera());
    if (rotation->size() != 9)
      throw ConfigError("rotation", "has " + std::to_string(rotation->size()) + " numbers, expected nine");
    if (angles->size() != 3)
      throw ConfigError("angles", "has " + std::to_string(angles->size()) + " numbers, expected three");
    if (translation->size() != 3)
      throw ConfigError("translation", "has " + std::to_string(translation->size()) + " numbers, expected three");
    if (shift->size() != 3)
      throw ConfigError("shift", "has " + std::to_string(shift->size()) + " numbers, expected three");
    if (rotation.given() && angles.given()) throw ConfigError("angles", "give either rotation or angles");
    if (rotation.given()) check_rotation("rotation", *rotation);
    const std::array<double, 9> r = rotation.given() ? matrix(*rotation) : from_angles();
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t k = 0; k < 3; ++k) t_world_camera_[row][k] = r[3 * row + k];
      t_world_camera_[row][3] = (*translation)[row] - (*shift)[row];
    }
    warn_of_lost_digits();
  }

  void process(Frame& frame) const {
    const auto all = points(frame);
    const auto& t = t_world_camera_;
    for (std::size_t i = 0; i < all.size(); i += 3) {
      const double x = all[i], y = all[i + 1], z = all[i + 2];
      for (std::size_t k = 0; k < 3; ++k)
        all[i + k] = static_cast<float>(t[k][0] * x + t[k][1] * y + t[k][2] * z + t[k][3]);
    }
    const auto directions = normals(frame);
    for (std::size_t i = 0; i < directions.size(); i += 3) {
      const double x = directions[i], y = directions[i + 1], z = directions[i + 2];
      for (std::size_t k = 0; k < 3; ++k)
        directions[i + k] = static_cast<float>(t[k][0] * x + t[k][1] * y + t[k][2] * z);
    }
  }

 private:
  void read_pose(const tofgraph_camera& camera) {
    if (rotation.given() || angles.given() || translation.given())
      throw ConfigError("pose", "gives rotation and translation: give either these or pose");
    io::Calibrated r, t;
    try {
      io::CalibrationReader file(std::string(*pose), "pose", camera.name);
      r = file.need("rotation", "", 9, "{value: [1, 0, 0, 0, 1, 0, 0, 0, 1]}");
      t = file.need("translation", "m", 3, "{value: [0 mm, 0 mm, 500 mm]}");
      if (file.has("rms")) static_cast<void>(file.need("rms", "px", 1, "{value: 0.05 px}"));
      file.finish();
    } catch (const std::exception& problem) {
      throw ConfigError("pose", problem.what());
    }
    check_rotation("pose", r.value);
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t k = 0; k < 3; ++k) t_world_camera_[row][k] = r.value[3 * row + k];
      t_world_camera_[row][3] = t.value[row] - (*shift)[row];
    }
    warn_of_lost_digits();
  }

  static constexpr double max_step = 0.2e-3;  // m, between neighbouring values of float32

  /// Distance to the next float32, m.
  static double step_at(double coordinate) {
    const auto value = static_cast<float>(std::abs(coordinate));
    return static_cast<double>(std::nextafter(value, std::numeric_limits<float>::infinity())) - value;
  }

  static std::string shown(const char* format, double number) {
    char text[64];
    std::snprintf(text, sizeof text, format, number);
    return text;
  }

  void warn_of_lost_digits() const {
    std::string steps, round;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double t = t_world_camera_[axis][3], step = step_at(t), all = t + (*shift)[axis];
      const bool coarse = step > max_step;
      if (coarse)
        steps += (steps.empty() ? "" : ", ") + std::string("xyz").substr(axis, 1) + " in steps of " +
                 shown("%.3g mm", 1e3 * step);
      round += (axis == 0 ? "" : ", ") + shown("%.0f m", coarse ? std::round(all / 1000) * 1000 : (*shift)[axis]);
    }
    if (steps.empty()) return;
    warn("float32 holds these coordinates only coarsely, " + steps + ": add shift: [" + round +
         "], which is subtracted in double precision; what leaves is relative to it");
  }

  static std::array<double, 9> matrix(const std::vector<double>& values) {
    std::array<double, 9> m{};
    std::copy_n(values.begin(), 9, m.begin());
    return m;
  }

  std::array<double, 9> from_angles() const {
    const double a = (*angles)[0], b = (*angles)[1], c = (*angles)[2];
    const double ca = std::cos(a), sa = std::sin(a), cb = std::cos(b), sb = std::sin(b), cc = std::cos(c),
                 sc = std::sin(c);
    return {cc * cb,
            cc * sb * sa - sc * ca,
            cc * sb * ca + sc * sa,
            sc * cb,
            sc * sb * sa + cc * ca,
            sc * sb * ca - cc * sa,
            -sb,
            cb * sa,
            cb * ca};
  }

  /// Checks that R is a rotation: orthonormal rows, no mirror.
  static void check_rotation(const char* parameter, const std::vector<double>& r) {
    double worst = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        const double product = r[3 * i] * r[3 * j] + r[3 * i + 1] * r[3 * j + 1] + r[3 * i + 2] * r[3 * j + 2];
        worst = std::max(worst, std::abs(product - (i == j ? 1 : 0)));
      }
    }
    if (worst > 1e-4)
      throw ConfigError(parameter, "is not a rotation: its rows are not unit vectors at right angles (off by " +
                                       std::to_string(worst) + ")");
    const double determinant =
        r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) + r[2] * (r[3] * r[7] - r[4] * r[6]);
    if (determinant < 0) throw ConfigError(parameter, "is a reflection, not a rotation: its determinant is -1");
  }

  std::array<std::array<double, 4>, 3> t_world_camera_{};
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Transform, "Moves the points into another frame: p_world = T_world_camera p_camera")
