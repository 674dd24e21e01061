// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Ear clipping: D. Eberly, Triangulation by Ear Clipping (2002). A corner is an ear if its triangle lies inside the
// polygon; removing it leaves a polygon with one corner less.
#include "simulation/mesh_polygons.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::simulation {
namespace {

struct FlatPoint {
  double x, y;
  bool operator==(const FlatPoint&) const = default;
};

/// Twice the signed area of a triangle; positive: counter-clockwise.
double doubled_area(FlatPoint a, FlatPoint b, FlatPoint c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool are_opposite(double a, double b) { return (a > 0 && b < 0) || (a < 0 && b > 0); }

/// Projects the polygon along the dominant axis of its normal, counter-clockwise (Newell's normal).
std::vector<FlatPoint> flattened(std::span<const Vertex> vertices, std::span<const std::uint32_t> polygon) {
  std::array<double, 3> normal{};
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vertex &p = vertices[polygon[i]], &q = vertices[polygon[(i + 1) % polygon.size()]];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
      normal[axis] += (double{p[u]} - q[u]) * (double{p[v]} + q[v]);
    }
  }
  std::size_t widest = 0;
  for (std::size_t axis = 1; axis < 3; ++axis)
    if (std::abs(normal[axis]) > std::abs(normal[widest])) widest = axis;
  const std::size_t u = (widest + 1) % 3, v = (widest + 2) % 3;
  const double turn = normal[widest] < 0 ? -1 : 1;
  std::vector<FlatPoint> points;
  for (const std::uint32_t corner : polygon) points.push_back({vertices[corner][u], turn * vertices[corner][v]});
  return points;
}

class EarClipper {
 public:
  EarClipper(std::span<const Vertex> vertices, std::span<const std::uint32_t> polygon)
      : corners_(polygon.begin(), polygon.end()), points_(flattened(vertices, polygon)) {
    FlatPoint low = points_[0], high = points_[0];
    for (const FlatPoint& p : points_) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    const double width = high.x - low.x, height = high.y - low.y;
    flat_ = 1e-12 * (width * width + height * height);
  }

  bool clip(std::vector<TriangleIndices>& triangles) {
    std::size_t place = 0, failed = 0;
    while (corners_.size() > 2) {
      if (failed == corners_.size()) return false;
      place %= corners_.size();
      const std::size_t before = previous(place), after = next(place);
      const double area = doubled_area(points_[before], points_[place], points_[after]);
      if (area > flat_ ? !is_ear(before, place, after) : area < -flat_) {
        ++failed;
        ++place;
        continue;
      }
      if (area > flat_) triangles.push_back({corners_[before], corners_[place], corners_[after]});
      corners_.erase(corners_.begin() + static_cast<std::ptrdiff_t>(place));
      points_.erase(points_.begin() + static_cast<std::ptrdiff_t>(place));
      failed = 0;
    }
    return true;
  }

 private:
  std::size_t previous(std::size_t i) const { return i == 0 ? corners_.size() - 1 : i - 1; }
  std::size_t next(std::size_t i) const { return i + 1 == corners_.size() ? 0 : i + 1; }

  /// True if no other corner lies in the triangle and its third side crosses no edge. Coincident corners, such as those
  /// of a doubled edge to a hole, are ignored.
  bool is_ear(std::size_t before, std::size_t place, std::size_t after) const {
    const FlatPoint a = points_[before], b = points_[place], c = points_[after];
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const FlatPoint p = points_[i], q = points_[next(i)];
      const bool crosses = are_opposite(doubled_area(a, c, p), doubled_area(a, c, q)) &&
                           are_opposite(doubled_area(p, q, a), doubled_area(p, q, c));
      if (crosses) return false;
      if (i == before || i == place || i == after || p == a || p == b || p == c) continue;
      if (doubled_area(a, b, p) >= 0 && doubled_area(b, c, p) >= 0 && doubled_area(c, a, p) >= 0) return false;
    }
    return true;
  }

  std::vector<std::uint32_t> corners_;
  std::vector<FlatPoint> points_;
  double flat_ = 0;  ///< doubled area below which corners count as collinear
};

}  // namespace

bool triangulate(std::span<const Vertex> vertices, std::span<const std::uint32_t> polygon,
                 std::vector<TriangleIndices>& triangles) {
  return EarClipper(vertices, polygon).clip(triangles);
}

}  // namespace tofgraph::simulation
