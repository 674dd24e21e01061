// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Sums of `statistics`, which can be merged; channel look-up; plane fit to points; edge pixels.
#pragma once

#include <tofgraph/array.hpp>
#include <tofgraph/stage.hpp>

#include <Eigen/Eigenvalues>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace tofgraph {

inline constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Channel of that name; null if there is none.
inline const tofgraph_channel* channel_of(const tofgraph_stream& stream, std::string_view name) {
  for (const tofgraph_channel& c :
       Strided<const tofgraph_channel>{stream.channels, stream.channel_size, stream.channel_count})
    if (name == c.name) return &c;
  return nullptr;
}

inline std::vector<std::string> channel_names(const tofgraph_stream& stream) {
  std::vector<std::string> names;
  for (const tofgraph_channel& c :
       Strided<const tofgraph_channel>{stream.channels, stream.channel_size, stream.channel_count})
    names.emplace_back(c.name);
  return names;
}

/// Statistics over valid pixels. mean, sd (n - 1), rms, min and max are in metres, NaN if there are too few pixels.
struct Summary {
  std::uint64_t count = 0;
  double mean = 0, squares = 0;  // squares: sum of (value - mean)^2
  double residuals = 0;          // sum of squared differences to the reference
  double min = std::numeric_limits<double>::infinity(), max = -std::numeric_limits<double>::infinity();

  double sd() const { return count > 1 ? std::sqrt(squares / static_cast<double>(count - 1)) : unknown; }
  double rms() const { return count > 0 ? std::sqrt(residuals / static_cast<double>(count)) : unknown; }

  /// Merges another summary, as if computed from all values at once (Chan, Golub, LeVeque 1979).
  void merge(const Summary& other) {
    if (other.count == 0) return;
    const auto mine = static_cast<double>(count), theirs = static_cast<double>(other.count);
    const double step = other.mean - mean;
    mean += step * theirs / (mine + theirs);
    squares += other.squares + step * step * mine * theirs / (mine + theirs);
    residuals += other.residuals;
    min = std::min(min, other.min);
    max = std::max(max, other.max);
    count += other.count;
  }
};

/// Pixels of a part of the image: all, flat or edge.
struct Part {
  std::string name;
  Summary all;
  std::vector<Summary> frames;

  void add(const Summary& frame) {
    frames.push_back(frame);
    all.merge(frame);
  }
};

inline Summary summary_of(const std::vector<double>& values) {
  Summary result;
  result.count = values.size();
  for (const double value : values) result.mean += value / static_cast<double>(values.size());
  for (const double value : values) {
    result.squares += (value - result.mean) * (value - result.mean);
    result.min = std::min(result.min, value);
    result.max = std::max(result.max, value);
  }
  return result;
}

/// In metres; null where it is unknown.
inline nlohmann::json as_json(const Summary& s) {
  const bool some = s.count > 0;
  return {{"count", s.count}, {"mean", some ? s.mean : unknown}, {"sd", s.sd()},
          {"rms", s.rms()},   {"min", some ? s.min : unknown},   {"max", some ? s.max : unknown}};
}

/// Sum of the squared distances of points to the best-fitting plane: the smallest eigenvalue of their scatter matrix.
/// @returns NaN for fewer than four points, which leave no residual, or if one of them is invalid
inline double squares_to_plane(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() <= 3) return unknown;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const auto& point : points) centre += point / static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& point : points) scatter += (point - centre) * (point - centre).transpose();
  if (!scatter.allFinite()) return unknown;
  return std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues()[0]);
}

/// Returns true for pixels within 3 pixels of a step of more than 30 mm between neighbours in `truth`, in m.
inline std::vector<bool> edges_of(const Array<const float>& truth) {
  constexpr std::size_t reach = 3;  // pixels
  constexpr float step = 0.030F;    // m
  std::vector<bool> edges(truth.size(), false);
  const auto mark = [&](std::size_t row, std::size_t column) {
    for (std::size_t r = row - std::min(row, reach); r < std::min(row + reach + 1, truth.rows()); ++r) {
      for (std::size_t c = column - std::min(column, reach); c < std::min(column + reach + 1, truth.columns()); ++c)
        edges[r * truth.columns() + c] = true;
    }
  };
  for (std::size_t r = 0; r < truth.rows(); ++r) {
    for (std::size_t c = 0; c < truth.columns(); ++c) {
      if (c + 1 < truth.columns() && std::abs(truth(r, c) - truth(r, c + 1)) > step) mark(r, c), mark(r, c + 1);
      if (r + 1 < truth.rows() && std::abs(truth(r, c) - truth(r + 1, c)) > step) mark(r, c), mark(r + 1, c);
    }
  }
  return edges;
}

}  // namespace tofgraph
