// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/intrinsics_plots.hpp"

#include "report/chart.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::calibration {
namespace {

constexpr int side = 370;  ///< px, side of a square plot

/// 98th percentile of the residual lengths, px.
double residual_limit(const Intrinsics& result) {
  std::vector<double> lengths;
  for (const SolvedView& view : result.solution.views)
    for (std::size_t i = 0; i < view.residuals.size(); ++i)
      if (view.used[i]) lengths.push_back(std::hypot(view.residuals[i][0], view.residuals[i][1]));
  return report::percentile_98(lengths);
}

/// Rounds to 1, 2 or 5 times a power of ten.
double round_number(double value) {
  const double power = std::pow(10, std::floor(std::log10(value))), digit = value / power;
  return power * (digit < 1.5 ? 1 : digit < 3.5 ? 2 : digit < 7.5 ? 5 : 10);
}

double bilinear(const Image& image, double u, double v) {
  const long x = physics::to_integer(std::floor(u), -1L), y = physics::to_integer(std::floor(v), -1L);
  if (x < 0 || y < 0 || x + 1 >= static_cast<long>(image.width) || y + 1 >= static_cast<long>(image.height))
    return std::numeric_limits<double>::quiet_NaN();
  const double a = u - static_cast<double>(x), b = v - static_cast<double>(y);
  return (1 - b) * ((1 - a) * image.at(x, y) + a * image.at(x + 1, y)) +
         b * ((1 - a) * image.at(x, y + 1) + a * image.at(x + 1, y + 1));
}

}  // namespace

std::string uncertainty_map(const Intrinsics& result, double range) {
  constexpr std::size_t places = 31;
  report::FieldMap map{.title = "uncertainty of projection", .unit = "sd / px", .rows = places, .columns = places};
  const ProjectionUncertainty uncertainty(result.solution);
  const auto width = static_cast<double>(result.views.observations.width);
  const auto height = static_cast<double>(result.views.observations.height);
  for (std::size_t i = 0; i < places; ++i)
    for (std::size_t k = 0; k < places; ++k)
      map.fields.push_back({.value = uncertainty.at((width - 1) * static_cast<double>(k) / (places - 1),
                                                    (height - 1) * static_cast<double>(i) / (places - 1), range)});
  map.signed_values = false;
  return report::field_map(map, side, side - 50);
}

std::string residual_vectors(const Intrinsics& result) {
  const double limit = residual_limit(result);
  const double length = 0.05 * static_cast<double>(result.views.observations.width);
  const double scale = round_number(length / limit);
  report::Series arrows{.name = {}, .style = report::Series::Style::thin_line}, heads{.name = {}};
  heads.style = report::Series::Style::points;
  heads.colour = 0;
  for (const SolvedView& view : result.solution.views) {
    const View& seen = result.views.observations.views[view.view];
    for (std::size_t i = 0; i < view.residuals.size(); ++i) {
      if (!view.used[i]) continue;
      const double u = seen.corners[i].u, v = seen.corners[i].v;
      arrows.add(u, v);
      arrows.add(u + scale * view.residuals[i][0], v + scale * view.residuals[i][1]);
      arrows.add(unknown, unknown);
      heads.marks.push_back(arrows.marks[arrows.marks.size() - 2]);
    }
  }
  return report::chart({.title = fmt::format("residuals, {:g} times; dots: ends", scale),
                        .x_label = "u / px",
                        .y_label = "v / px",
                        .series = {arrows, heads},
                        .y_down = true,
                        .equal_scales = true},
                       side, side);
}

std::string residual_cloud(const Intrinsics& result) {
  report::Series cloud{.name = {}, .style = report::Series::Style::points};
  for (const SolvedView& view : result.solution.views)
    for (std::size_t i = 0; i < view.residuals.size(); ++i)
      if (view.used[i]) cloud.add(view.residuals[i][0], view.residuals[i][1]);
  return report::chart({.title = "residuals",
                        .x_label = "u, seen minus predicted / px",
                        .y_label = "v / px",
                        .series = {cloud},
                        .y_down = true,
                        .equal_scales = true},
                       side, side);
}

std::string coverage_map(const Intrinsics& result) {
  constexpr std::size_t fields = 10;
  const Observations& o = result.views.observations;
  report::FieldMap map{.title = "corners seen", .unit = "", .rows = fields, .columns = fields};
  map.fields.resize(fields * fields);
  for (const SolvedView& view : result.solution.views) {
    for (const Corner& c : o.views[view.view].corners) {
      const auto column = static_cast<std::size_t>((c.u + 0.5) / static_cast<double>(o.width) * fields);
      const auto row = static_cast<std::size_t>((c.v + 0.5) / static_cast<double>(o.height) * fields);
      map.fields[std::min(row, fields - 1) * fields + std::min(column, fields - 1)].value += 1;
    }
  }
  map.signed_values = false;
  map.write_values = true;
  return report::field_map(map, side, side - 50);
}

std::string distance_residuals(const Intrinsics& result) {
  report::Series curve{.style = report::Series::Style::points};
  for (const SolvedView& view : result.solution.views) {
    if (view.distance_residuals.empty()) continue;
    double mean = 0, square = 0;
    const auto n = static_cast<double>(view.distance_residuals.size());
    for (const double r : view.distance_residuals) mean += (r + view.range_shift) / n;
    for (const double r : view.distance_residuals) square += std::pow(r + view.range_shift - mean, 2) / n;
    double range = 0;
    for (const double t : view.pose.translation) range += t * t;
    curve.add(std::sqrt(range), mean * 1e3, std::sqrt(square) * 1e3);
  }
  return report::chart({.title = "distances of the board",
                        .x_label = "range / m",
                        .y_label = "measured minus predicted / mm",
                        .series = {curve}});
}

std::string boards_from_above(const Intrinsics& result, bool from_side) {
  double hx = 0, hy = 0;
  for (const BoardPoint& p : result.views.observations.points) {
    hx = std::max(hx, std::abs(p.x));
    hy = std::max(hy, std::abs(p.y));
  }
  report::Series boards{.name = {}, .style = report::Series::Style::thin_line}, camera{.name = {}};
  for (const SolvedView& view : result.solution.views) {
    const auto& r = view.pose.rotation;
    const auto& t = view.pose.translation;
    for (const auto& [x, y] : {std::pair{-hx, -hy}, {hx, -hy}, {hx, hy}, {-hx, hy}, {-hx, -hy}}) {
      const std::size_t row = from_side ? 1 : 0;
      boards.add(r[6] * x + r[7] * y + t[2], r[3 * row] * x + r[3 * row + 1] * y + t[row]);
    }
    boards.add(unknown, unknown);
  }
  camera.style = report::Series::Style::points;
  camera.add(0, 0);
  return report::chart({.title = from_side ? "from the side" : "from above",
                        .x_label = "z / m",
                        .y_label = from_side ? "y / m" : "x / m",
                        .series = {boards, camera},
                        .y_down = true,
                        .equal_scales = true},
                       560, 330);
}

std::array<std::string, 2> undistorted_preview(const Intrinsics& result) {
  const Image& image = result.views.images[result.solution.views.front().view].image;
  const LensParameters& lens = result.solution.lens;
  Image straight{image.width, image.height, {}};
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    const std::size_t column = i % image.width, row = i / image.width;
    const double x = (static_cast<double>(column) - lens[lens::cx]) / lens[lens::fx];
    const double y = (static_cast<double>(row) - lens[lens::cy]) / lens[lens::fy];
    double pixel[2];
    project_plane<double>(lens.data(), x, y, pixel);
    straight.values.push_back(bilinear(image, pixel[0], pixel[1]));
  }
  const auto picture = [&](const Image& shown, const char* title) {
    report::FieldMap map{.title = title,
                         .unit = "counts",
                         .rows = shown.height,
                         .columns = shown.width,
                         .fields = report::fields_of(shown.values)};
    map.signed_values = false;
    return report::field_map(map, side + 60, side);
  };
  return {picture(image, "as seen"), picture(straight, "without distortion")};
}

}  // namespace tofgraph::calibration
