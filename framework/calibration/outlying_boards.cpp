// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/outlying_boards.hpp"

#include <tofgraph/physics/robust.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

namespace tofgraph::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t min_distances = 6;
constexpr double min_error = 5e-3, min_spreads = 6;  // m; standard deviations
constexpr double placing_sd = 0.3e-3;                // m, positioning uncertainty of a board

/// Design matrix of the boards' depth errors z - T: one column for each smooth cause, scaled by its prior standard
/// deviation.
MatrixXd columns_of(const Boards& boards, double range) {
  const auto n = static_cast<Eigen::Index>(boards.boards.size());
  const auto targets = static_cast<Eigen::Index>(boards.targets.size());
  const double per_radian = range / (2 * std::numbers::pi);
  const double scale = range / 7.495;  // scales the harmonics, which are those of cameras at 20 MHz
  constexpr double crosstalk = 2500;   // counts/s
  MatrixXd columns = MatrixXd::Zero(n, 14 + targets);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Board& b = boards.boards[static_cast<std::size_t>(i)];
    const double path = std::isfinite(b.measured.mean) ? b.measured.mean : b.distance;
    const double phase = path / per_radian;
    Eigen::Index c = 0;
    columns(i, c++) = 1;
    columns(i, c++) = 10e-3 * (b.distance - 2);
    for (const auto& [order, sd] : {std::pair{1, 4.8e-3}, {2, 4.8e-3}, {4, 9.5e-3}, {8, 2.4e-3}}) {
      columns(i, c++) = scale * sd * std::cos(order * phase);
      columns(i, c++) = scale * sd * std::sin(order * phase);
    }
    const double time = b.condition.integration_time, light = b.amplitude;
    if (std::isfinite(time)) columns(i, c) = 20e-3 * std::log(time / 1e-3);
    ++c;
    if (std::isfinite(light) && light > 0) {
      columns(i, c) = 20e-3 * std::log(light / 1000);
      if (std::isfinite(time)) {
        columns(i, c + 1) = per_radian * crosstalk * time / light * std::cos(phase);
        columns(i, c + 2) = per_radian * crosstalk * time / light * std::sin(phase);
      }
    }
    c += 3;
    columns(i, c + static_cast<Eigen::Index>(boards.target_of(b))) = 5e-3;
  }
  return columns;
}

/// Fit to a subset of the boards, with the priors of the columns.
class BoardFit {
 public:
  BoardFit(MatrixXd columns, VectorXd values, std::vector<double> distances)
      : columns_(std::move(columns)), values_(std::move(values)), distances_(std::move(distances)) {}

  /// @returns m, robust standard deviation of boards relative to fits to those at other distances
  double usual_error(const std::vector<Eigen::Index>& used) const {
    double sd = 1e-3;
    for (int round = 0; round < 6; ++round) {
      const double next =
          std::max(physics::sd_of_deviations * physics::median(left_out_sizes(used, sd)) * sd, placing_sd);
      const bool settled = std::abs(next / sd - 1) < 1e-2;
      sd = next;
      if (settled) break;
    }
    return sd;
  }

  /// Error of a board relative to a fit to others, m, and in standard deviations.
  struct Error {
    double error, spreads;
  };
  Error error_of(Eigen::Index board, const std::vector<Eigen::Index>& others, double sd) const {
    const MatrixXd a = columns_(others, Eigen::all) / sd;
    const VectorXd x = columns_.row(board), y = values_(others) / sd;
    const Eigen::LDLT<MatrixXd> normal = normal_of(a);
    const double error = values_[board] - x.dot(normal.solve(a.transpose() * y));
    return {error, std::abs(error) / std::sqrt(sd * sd + x.dot(normal.solve(x)))};
  }

  double distance(Eigen::Index board) const { return distances_[static_cast<std::size_t>(board)]; }

 private:
  static Eigen::LDLT<MatrixXd> normal_of(const MatrixXd& a) {
    return Eigen::LDLT<MatrixXd>(MatrixXd(a.transpose() * a) + MatrixXd::Identity(a.cols(), a.cols()));
  }

  /// Absolute errors of all boards, each relative to a fit without its distance, in standard deviations.
  std::vector<double> left_out_sizes(const std::vector<Eigen::Index>& used, double sd) const {
    const MatrixXd a = columns_(used, Eigen::all) / sd;
    const VectorXd y = values_(used) / sd;
    const MatrixXd hat = a * normal_of(a).solve(a.transpose());
    const VectorXd rest = y - hat * y;
    std::map<double, std::vector<Eigen::Index>> levels;
    for (std::size_t k = 0; k < used.size(); ++k) levels[distance(used[k])].push_back(static_cast<Eigen::Index>(k));
    std::vector<double> sizes;
    for (const auto& [distance, level] : levels) {
      const auto m = static_cast<Eigen::Index>(level.size());
      const MatrixXd inverse = (MatrixXd::Identity(m, m) - hat(level, level)).inverse();
      const VectorXd error = inverse * rest(level);
      for (Eigen::Index j = 0; j < m; ++j) sizes.push_back(std::abs(error[j]) / std::sqrt(inverse(j, j)));
    }
    return sizes;
  }

  MatrixXd columns_;
  VectorXd values_;
  std::vector<double> distances_;
};

/// Board that deviates most from the fit to the others; each distance is held out in turn, so that an adjacent outlier
/// cannot mask another one.
std::optional<OutlyingBoard> worst_of(const BoardFit& fit, const std::vector<Eigen::Index>& used) {
  std::map<double, std::vector<Eigen::Index>> levels;
  for (const Eigen::Index i : used) levels[fit.distance(i)].push_back(i);
  if (levels.size() < min_distances) return std::nullopt;
  std::optional<OutlyingBoard> worst;
  double most = min_spreads;
  for (const auto& [distance, level] : levels) {
    std::vector<Eigen::Index> others;
    for (const Eigen::Index i : used)
      if (fit.distance(i) != distance) others.push_back(i);
    const double usual = fit.usual_error(others);
    for (const Eigen::Index i : level) {
      const BoardFit::Error error = fit.error_of(i, others, usual);
      if (!(error.spreads > most && std::abs(error.error) > min_error)) continue;
      most = error.spreads;
      worst = {static_cast<std::size_t>(i), error.error, usual};
    }
  }
  return worst;
}

/// True if the adjacent boards of the same target and integration time fit: a deviation shared by several successive
/// boards is a property of the camera that the columns do not model.
bool stands_alone(const Boards& boards, const BoardFit& fit, const std::vector<Eigen::Index>& used,
                  const OutlyingBoard& board) {
  const Board& own = boards.boards[board.board];
  double below = -1, above = std::numeric_limits<double>::infinity();
  Eigen::Index before = -1, after = -1;
  for (const Eigen::Index i : used) {
    const Board& other = boards.boards[static_cast<std::size_t>(i)];
    if (other.condition.target != own.condition.target ||
        other.condition.integration_time != own.condition.integration_time)
      continue;
    if (other.distance < own.distance && other.distance > below) {
      below = other.distance;
      before = i;
    }
    if (other.distance > own.distance && other.distance < above) {
      above = other.distance;
      after = i;
    }
  }
  constexpr double share = 1.0 / 3;
  return std::ranges::all_of(std::array{before, after}, [&](Eigen::Index neighbour) {
    if (neighbour < 0) return true;
    std::vector<Eigen::Index> others;
    for (const Eigen::Index i : used)
      if (fit.distance(i) != fit.distance(neighbour) && fit.distance(i) != own.distance) others.push_back(i);
    return std::abs(fit.error_of(neighbour, others, board.usual).error) < share * std::abs(board.error);
  });
}

}  // namespace

std::vector<OutlyingBoard> outlying_boards(const Boards& boards, double unambiguous_range) {
  const auto n = static_cast<Eigen::Index>(boards.boards.size());
  VectorXd values(n);
  std::vector<double> distances;
  std::vector<Eigen::Index> used;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Board& board = boards.boards[static_cast<std::size_t>(i)];
    values[i] = -board.error();
    distances.push_back(board.distance);
    used.push_back(i);
  }
  const BoardFit fit(columns_of(boards, unambiguous_range), std::move(values), std::move(distances));
  std::vector<OutlyingBoard> result;
  while (4 * result.size() < boards.boards.size()) {
    const std::optional<OutlyingBoard> worst = worst_of(fit, used);
    if (!worst || !stands_alone(boards, fit, used, *worst)) break;
    result.push_back(*worst);
    std::erase(used, static_cast<Eigen::Index>(worst->board));
  }
  return result;
}

}  // namespace tofgraph::calibration
