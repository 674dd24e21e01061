// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/smooth_field.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <tbb/parallel_for.h>

#include <cmath>
#include <numbers>

namespace tofgraph::diagnosis {
namespace {

/// Cosines over the superpixels, without the constant, whose squares sum to 1 on average; from two half waves on, their
/// variance falls with the fourth power of the number of half waves.
Eigen::MatrixXd cosines(std::size_t side) {
  std::vector<Eigen::VectorXd> columns;
  double sum = 0;
  const auto n = static_cast<Eigen::Index>(side);
  for (int x = 0; x <= settings.field_max_half_waves; ++x) {
    for (int y = 0; y <= settings.field_max_half_waves; ++y) {
      const double waves = std::hypot(x, y);
      if (waves == 0 || waves > settings.field_max_half_waves) continue;
      const double variance = std::pow(1 + waves * waves / 4, -2);
      Eigen::VectorXd& column = columns.emplace_back(n * n);
      for (Eigen::Index s = 0; s < n * n; ++s) {
        const auto at = [n](Eigen::Index i) {
          return std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n);
        };
        column(s) = std::sqrt(variance) * std::cos(x * at(s % n)) * std::cos(y * at(s / n));
      }
      sum += column.squaredNorm() / static_cast<double>(n * n);
    }
  }
  Eigen::MatrixXd all(n * n, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) all.col(static_cast<Eigen::Index>(c)) = columns[c] / std::sqrt(sum);
  return all;
}

}  // namespace

SmoothField::SmoothField(const std::vector<Observations>& data) {
  const std::size_t n = data.front().variance.size() / observables;
  const Eigen::MatrixXd waves = cosines(static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(n)))));
  std::vector<Field> fields(data.size());
  tbb::parallel_for(std::size_t{0}, data.size(), [&](std::size_t i) {
    Eigen::MatrixXd weighted = waves;
    for (std::size_t s = 0; s < n; ++s)
      weighted.row(static_cast<Eigen::Index>(s)) /= std::sqrt(data[i].variance[distance * n + s]);  // 0 where unknown
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(weighted.transpose() * weighted);
    const Eigen::VectorXd variance = solver.eigenvalues().cwiseMax(0);
    const auto kept = static_cast<Eigen::Index>((variance.array() > 1e-9 * variance.maxCoeff()).count());
    const Eigen::VectorXd largest = variance.tail(kept);
    fields[i] = {weighted * solver.eigenvectors().rightCols(kept) * largest.cwiseSqrt().cwiseInverse().asDiagonal(),
                 largest};
  });
  fields_ = std::make_shared<const std::vector<Field>>(std::move(fields));
}

SmoothField::SmoothField(const SmoothField& other, double sd) : fields_(other.fields_), sd_(sd) {}

Eigen::VectorXd SmoothField::taken(std::size_t condition) const {
  const Eigen::ArrayXd variance = sd_ * sd_ * (*fields_)[condition].variance.array();
  return variance / (1 + variance);
}

Eigen::VectorXd SmoothField::drawn(std::size_t condition, std::mt19937_64& generator) const {
  std::normal_distribution<double> normal;
  Eigen::VectorXd heights = sd_ * (*fields_)[condition].variance.cwiseSqrt();
  for (double& height : heights) height *= normal(generator);
  return modes(condition) * heights;
}

double SmoothField::log_determinant(std::size_t condition) const {
  return (1 + sd_ * sd_ * (*fields_)[condition].variance.array()).log().sum();
}

void SmoothField::whiten(std::size_t condition, Eigen::Ref<Eigen::MatrixXd> rows) const {
  const Eigen::MatrixXd& along = modes(condition);
  const Eigen::VectorXd less = 1 - (1 - taken(condition).array()).sqrt();
  const Eigen::MatrixXd parts = less.asDiagonal() * (along.transpose() * rows);
  rows.noalias() -= along * parts;
}

std::shared_ptr<const SmoothField> with_data(const std::shared_ptr<const SmoothField>& smooth_field,
                                             const std::vector<Observations>& data) {
  return smooth_field ? std::make_shared<const SmoothField>(SmoothField(data), smooth_field->sd()) : nullptr;
}

}  // namespace tofgraph::diagnosis
