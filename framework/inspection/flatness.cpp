// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inspection/flatness.hpp"

#include "io/unknown.hpp"

#include <tofgraph/physics/lens.hpp>
#include <tofgraph/physics/non_linearity.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::inspection {
namespace {

constexpr double tolerance = 0.0004;  ///< relative: usual error of the length after calibration
constexpr double no_ray = 0.05;       ///< relative deviation assigned to a block without a ray

/// Least-squares fit of a plane: n with n . u = 1 / r for points at ranges r along rays u.
class PlaneFit {
 public:
  void add(physics::Vector3 u, double range, double noise) {
    const double weight = range * range * range * range / (noise * noise), inverse = 1 / range;
    const double c[3] = {u.x, u.y, u.z};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) a_[i][j] += weight * c[i] * c[j];
      b_[i] += weight * c[i] * inverse;
    }
  }
  physics::Vector3 normal() const {
    const auto minor = [this](int i, int j, int k, int l) { return a_[i][k] * a_[j][l] - a_[i][l] * a_[j][k]; };
    const double determinant =
        a_[0][0] * minor(1, 2, 1, 2) - a_[0][1] * minor(1, 2, 0, 2) + a_[0][2] * minor(1, 2, 0, 1);
    const double i00 = minor(1, 2, 1, 2), i01 = -minor(0, 2, 1, 2), i02 = minor(0, 1, 1, 2), i11 = minor(0, 2, 0, 2),
                 i12 = -minor(0, 1, 0, 2), i22 = minor(0, 1, 0, 1);
    return (1 / determinant) * physics::Vector3{i00 * b_[0] + i01 * b_[1] + i02 * b_[2],
                                                i01 * b_[0] + i11 * b_[1] + i12 * b_[2],
                                                i02 * b_[0] + i12 * b_[1] + i22 * b_[2]};
  }

 private:
  double a_[3][3] = {}, b_[3] = {};
};

}  // namespace

FlatnessTest::FlatnessTest(const Observation& observation, Surfaces surfaces)
    : observation_(observation), surfaces_(std::move(surfaces)) {
  try {
    geometry_ = physics::geometry_of(observation.camera->view());
  } catch (const std::invalid_argument&) {  // distances are then treated as ranges
  }
}

Assumption FlatnessTest::stated() const {
  Assumption stated;
  stated.channel = observation_.channel;
  std::copy_n(observation_.camera->view().distortion, 5, stated.distortion.begin());
  return stated;
}

bool FlatnessTest::is_perspective() const { return observation_.camera->view().lens_model == TOFGRAPH_LENS_OPENCV; }

bool FlatnessTest::has_further() const {
  return std::ranges::any_of(observation_.camera->view().further_distortion, [](double k) { return k != 0; });
}

std::optional<physics::Vector3> FlatnessTest::ray_of(const Block& block, const Assumption& assumption,
                                                     const tofgraph_camera& camera, const physics::Lens& lens) const {
  const double middle_x = static_cast<double>(observation_.width - 1) / 2,
               middle_y = static_cast<double>(observation_.height - 1) / 2;
  const double x = static_cast<double>(block.column) - middle_x, y = static_cast<double>(block.row) - middle_y;
  const std::array<int, 4>& m = assumption.orientation.matrix;
  const auto p = physics::image_point(camera, lens, m[0] * x + m[1] * y + middle_x, m[2] * x + m[3] * y + middle_y);
  if (!p) return std::nullopt;
  const double norm = std::sqrt(p->x * p->x + p->y * p->y + 1);
  return physics::Vector3{p->x / norm, p->y / norm, 1 / norm};
}

double FlatnessTest::range_of(double length, physics::Vector3 ray, const Assumption& assumption) const {
  length = (length - assumption.offset) * assumption.scale;
  if (assumption.channel == "range") return length;
  const double focal = observation_.camera->view().focal_length;
  if (assumption.channel == "depth") return (length - (focal > 0 ? focal : 0)) / ray.z;
  return geometry_ ? physics::optimized_bistatic_newton(*geometry_, ray, length) : length;
}

Flatness FlatnessTest::operator()(const Assumption& assumption) const {
  tofgraph_camera camera = observation_.camera->view();
  std::ranges::copy(assumption.distortion, camera.distortion);
  if (!assumption.further) std::ranges::fill(camera.further_distortion, 0.0);
  for (double& focal : camera.focal_px) focal *= assumption.focal_scale;
  const physics::Lens lens(camera);
  struct Point {
    physics::Vector3 ray;
    double range = io::unknown;
  };
  Flatness result;
  std::vector<Point> points;
  std::vector<PlaneFit> fits(surfaces_.count);
  for (const Block& block : surfaces_.blocks) {
    Point& point = points.emplace_back();
    result.points.push_back({io::unknown, io::unknown, io::unknown});
    const auto ray = ray_of(block, assumption, camera, lens);
    if (!ray) continue;
    const double range = range_of(block.length, *ray, assumption);
    if (!(range > 0)) continue;
    point = {*ray, range};
    result.points.back() = range * *ray;
    fits[block.surface].add(*ray, range, std::hypot(block.noise * assumption.scale, tolerance * range));
  }
  std::vector<physics::Vector3> normals;
  for (const PlaneFit& fit : fits) normals.push_back(fit.normal());
  std::vector<double> squares(surfaces_.count), lengths(surfaces_.count), counts(surfaces_.count);
  double square = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Block& block = surfaces_.blocks[i];
    const double length = (block.length - assumption.offset) * assumption.scale, noise = block.noise * assumption.scale;
    double rest = no_ray * length;
    if (std::isfinite(points[i].range)) {
      const double n_u = physics::dot(normals[block.surface], points[i].ray);
      const double found = points[i].range * (points[i].range * n_u - 1);  // plane minus range, to first order
      rest = std::isfinite(found) ? std::clamp(-found, -length, length) : rest;
    }
    result.rest.push_back(rest);
    const double excess = rest * rest - noise * noise;
    square += excess;
    squares[block.surface] += excess;
    lengths[block.surface] += length;
    ++counts[block.surface];
    result.chi2 += rest * rest / (noise * noise + tolerance * tolerance * length * length);
  }
  result.count = points.size();
  result.rms = points.empty() ? io::unknown : std::sqrt(std::max(square, 0.0) / static_cast<double>(points.size()));
  for (std::size_t s = 0; s < surfaces_.count; ++s)
    result.surface_rms.push_back(std::sqrt(std::max(squares[s], 0.0) / counts[s]) / (lengths[s] / counts[s]));
  return result;
}

void FlatnessTest::keep(const std::vector<bool>& keep) {
  std::vector<std::size_t> number(surfaces_.count);
  std::size_t count = 0;
  for (std::size_t s = 0; s < surfaces_.count; ++s) number[s] = keep[s] ? count++ : 0;
  std::erase_if(surfaces_.blocks, [&](const Block& block) { return !keep[block.surface]; });
  for (Block& block : surfaces_.blocks) block.surface = number[block.surface];
  surfaces_.count = count;
}

bool moves_enough(const Flatness& stated, const Flatness& corrected) {
  double square = 0;
  for (std::size_t i = 0; i < stated.points.size(); ++i) {
    const physics::Vector3 a = stated.points[i], b = corrected.points[i], step = a + (-1.0) * b;
    const bool before = std::isfinite(a.x), after = std::isfinite(b.x);
    if (before != after) return true;  // a ray is gained or lost
    if (before) square += physics::dot(step, step);
  }
  return std::sqrt(square / static_cast<double>(stated.count)) > 0.9 * (stated.rms - corrected.rms);
}

std::vector<Orientation> other_orientations(bool square) {
  std::vector<Orientation> all = {
      {"left_right", 0, {-1, 0, 0, 1}}, {"top_bottom", 0, {1, 0, 0, -1}}, {"none", 180, {-1, 0, 0, -1}}};
  if (!square) return all;
  // Clockwise by 90 degrees, y down: (x, y) -> (-y, x).
  all.push_back({"none", 90, {0, -1, 1, 0}});
  all.push_back({"none", 270, {0, 1, -1, 0}});
  all.push_back({"left_right", 90, {0, -1, -1, 0}});
  all.push_back({"left_right", 270, {0, 1, 1, 0}});
  return all;
}

}  // namespace tofgraph::inspection
