// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/scan.hpp"

#include <cmath>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Columns of one condition over their standard deviations.
Eigen::MatrixXd weighted(const Problem& problem, const Group& group, std::size_t condition) {
  std::vector<const std::vector<double>*> columns;
  for (const Column& column : group.columns) columns.push_back(&column[condition]);
  for (const Column* column : group.borrowed) columns.push_back(&(*column)[condition]);
  const Observations& data = problem.data[condition];
  const auto rows = columns.empty() ? 0 : static_cast<Eigen::Index>(columns.front()->size());
  Eigen::MatrixXd result(rows, static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index r = 0; r < rows; ++r) {
    const double variance = data.variance[group.first_row + static_cast<std::size_t>(r)];
    const double weight = 1 / std::sqrt(variance);
    for (Eigen::Index c = 0; c < result.cols(); ++c)
      result(r, c) = std::isinf(variance)  // the columns may be undefined there
                         ? 0
                         : weight * (*columns[static_cast<std::size_t>(c)])[static_cast<std::size_t>(r)];
  }
  return result;
}

/// Sums over the observables of weighted rows, one per superpixel.
Eigen::VectorXd by_superpixel(const Eigen::VectorXd& rows, Eigen::Index superpixels) {
  return rows.reshaped(superpixels, rows.size() / superpixels).rowwise().sum();
}

/// Products of projected columns and columns that represent one per superpixel, in D^-1: projected x columns.
Eigen::MatrixXd spread_cross(const Eigen::MatrixXd& projected, const Eigen::MatrixXd& columns, Eigen::Index n) {
  Eigen::MatrixXd cross(projected.cols(), columns.cols() * n);
  for (Eigen::Index h = 0; h < projected.cols(); ++h) {
    for (Eigen::Index c = 0; c < columns.cols(); ++c)
      cross.row(h).segment(c * n, n) = by_superpixel(projected.col(h).cwiseProduct(columns.col(c)), n).transpose();
  }
  return cross;
}

std::vector<Eigen::VectorXd> spread_diagonals(const Eigen::MatrixXd& columns, Eigen::Index n) {
  std::vector<Eigen::VectorXd> diagonals;
  for (Eigen::Index a = 0; a < columns.cols(); ++a) {
    for (Eigen::Index b = 0; b < columns.cols(); ++b)
      diagonals.push_back(by_superpixel(columns.col(a).cwiseProduct(columns.col(b)), n));
  }
  return diagonals;
}

/// Appends a column per superpixel of each map, for one condition only: for all conditions they would be large.
std::vector<Column> with_spread(std::span<const Column> own, std::span<const Column> maps, std::size_t condition,
                                std::size_t superpixels) {
  std::vector<Column> all;
  for (const Column& column : own) all.emplace_back(column.size())[condition] = column[condition];
  for (const Column& map : maps) {
    const std::vector<double>& rows = map[condition];
    for (std::size_t s = 0; s < superpixels; ++s) {
      std::vector<double>& there = all.emplace_back(map.size())[condition];
      there.resize(rows.size(), 0);
      for (std::size_t row = s; row < rows.size(); row += superpixels) there[row] = rows[row];
    }
  }
  return all;
}

/// Product of the transpose with the matrix, at half the cost.
Eigen::MatrixXd square_of(const Eigen::MatrixXd& columns) {
  Eigen::MatrixXd square = Eigen::MatrixXd::Zero(columns.cols(), columns.cols());
  square.selfadjointView<Eigen::Lower>().rankUpdate(columns.transpose());
  return square.selfadjointView<Eigen::Lower>();
}

}  // namespace

void CandidateGram::add_to(Eigen::MatrixXd& sum) const {
  if (!by_superpixel) {
    Eigen::MatrixXd rest = *whole;
    rest.noalias() -= taken.transpose() * taken;
    sum += rest;
    return;
  }
  const Eigen::Index n = diagonals.front().size(), count = taken.cols() / n;
  for (Eigen::Index a = 0; a < count; ++a) {
    for (Eigen::Index b = 0; b < count; ++b)
      sum.block(a * n, b * n, n, n).diagonal() += diagonals[static_cast<std::size_t>(a * count + b)];
  }
  sum.noalias() -= taken.transpose() * taken;
}

std::vector<SharedColumn> shared_columns_of(const Problem& problem, std::size_t condition, Eigen::Index own) {
  std::vector<SharedColumn> parts;
  for (Eigen::Index c = 0; c < own; ++c) parts.push_back({c, c, 1});
  std::vector<Shared> shared;
  problem.unknowns(0).append_shared(condition, shared);
  for (const Shared& one : shared) parts.push_back({own + one.direction, own + one.unknown, one.factor});
  return parts;
}

ConditionGram products_of(const Problem& problem, const State& state, const std::vector<double>& rows,
                          std::span<const Column> own, std::span<const Column> maps,
                          std::span<const Group* const> groups, std::size_t condition) {
  const std::size_t count = problem.design.superpixels();
  const Eigen::MatrixXd projected =
      maps.empty() ? weighted_columns(problem, state, rows, own, condition)
                   : weighted_columns(problem, state, rows, with_spread(own, maps, condition, count), condition);
  ConditionGram products{square_of(projected), {}, {}};
  const SmoothField* smooth_field = state.nuisances.smooth_field.get();
  const auto superpixels = static_cast<Eigen::Index>(count);
  for (const Group* group : groups) {
    Eigen::MatrixXd columns = weighted(problem, *group, condition);
    Eigen::MatrixXd there = projected.middleRows(static_cast<Eigen::Index>(group->first_row), columns.rows());
    const bool smooth = smooth_field != nullptr && group->first_row == distance;
    // For columns by superpixel the whole inverse is applied to the others, so that these stay diagonal.
    if (smooth) smooth_field->whiten(condition, (group->by_superpixel ? there : columns).topRows(superpixels));
    if (!group->by_superpixel) {
      products.cross.emplace_back(there.transpose() * columns);
      products.candidates.push_back(
          {false, std::make_shared<const Eigen::MatrixXd>(square_of(columns)), {}, Eigen::MatrixXd(0, columns.cols())});
      continue;
    }
    products.cross.push_back(spread_cross(there, columns, superpixels));
    CandidateGram& candidate =
        products.candidates.emplace_back(CandidateGram{true, nullptr, spread_diagonals(columns, superpixels), {}});
    candidate.taken.resize(0, columns.cols() * superpixels);
    if (!smooth) continue;
    candidate.taken = smooth_field->taken(condition).cwiseSqrt().asDiagonal() *
                      spread_cross(smooth_field->modes(condition), columns.topRows(superpixels), superpixels);
  }
  return products;
}

ConditionGram condition_gram_of(const ConditionGram& products, std::span<const SharedColumn> parts,
                                const RandomEffectSd& random_sd) {
  const Eigen::Index count = products.projected.cols() - gram_tail;
  double log_determinant = 0;
  const RandomMatrix downdate = downdate_factor(
      products.projected.block<random_directions, random_directions>(count, count), random_sd, log_determinant);
  std::vector<Eigen::Index> kept;
  Eigen::VectorXd factor(static_cast<Eigen::Index>(parts.size() + 1));
  for (const SharedColumn& part : parts) {
    factor(static_cast<Eigen::Index>(kept.size())) = part.factor;
    kept.push_back(part.column);
  }
  factor(static_cast<Eigen::Index>(kept.size())) = 1;
  kept.push_back(products.projected.cols() - 1);
  const Eigen::MatrixXd taken = downdate * products.projected.middleRows(count, random_directions);
  ConditionGram share;
  const Eigen::MatrixXd marginal = products.projected - taken.transpose() * taken;
  share.projected = factor.asDiagonal() * marginal(kept, kept) * factor.asDiagonal();
  for (std::size_t g = 0; g < products.candidates.size(); ++g) {
    const Eigen::MatrixXd& cross = products.cross[g];
    const Eigen::MatrixXd there = downdate * cross.middleRows(count, random_directions);
    share.cross.push_back(factor.asDiagonal() * Eigen::MatrixXd(cross - taken.transpose() * there)(kept, Eigen::all));
    CandidateGram candidate = products.candidates[g];
    Eigen::MatrixXd all(there.rows() + candidate.taken.rows(), there.cols());
    all << there, candidate.taken;
    candidate.taken = std::move(all);
    share.candidates.push_back(std::move(candidate));
  }
  return share;
}

}  // namespace tofgraph::diagnosis
