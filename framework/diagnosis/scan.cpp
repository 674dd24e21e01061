// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/scan.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tofgraph::diagnosis {
namespace {

/// Columns x columns of a group in C^-1. Of columns by superpixel it is kept as what it is made of: diagonals in D^-1,
/// one for each pair of columns, less what the random directions and a smooth residue take out.
struct Tried {
  bool by_superpixel = false;
  Eigen::MatrixXd whole;
  std::vector<Eigen::VectorXd> diagonals;
  Eigen::MatrixXd random;  ///< directions x columns
  Eigen::MatrixXd middle;

  Eigen::Index columns() const { return by_superpixel ? random.cols() : whole.cols(); }
  void add_to(Eigen::MatrixXd& sum) const {
    if (!by_superpixel) {
      sum += whole;
      return;
    }
    const Eigen::Index n = diagonals.front().size(), count = random.cols() / n;
    for (Eigen::Index a = 0; a < count; ++a) {
      for (Eigen::Index b = 0; b < count; ++b)
        sum.block(a * n, b * n, n, n).diagonal() += diagonals[static_cast<std::size_t>(a * count + b)];
    }
    sum.noalias() -= random.transpose() * (middle * random);
  }
};

/// What a condition says of the columns that are tried, in C^-1. Held are the columns of unknowns, then the residual.
struct Share {
  Eigen::MatrixXd held;                ///< held x held
  std::vector<Eigen::MatrixXd> cross;  ///< one a group: held x columns
  std::vector<Tried> tried;            ///< one a group
};

/// Columns of one condition over their standard deviations, from a row on.
Eigen::MatrixXd weighted(const Problem& problem, std::span<const Column> columns, std::size_t condition,
                         std::size_t first_row) {
  const Observations& data = problem.data[condition];
  const auto rows = columns.empty() ? 0 : static_cast<Eigen::Index>(columns.front()[condition].size());
  Eigen::MatrixXd result(rows, static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index r = 0; r < rows; ++r) {
    const double variance = data.variance[first_row + static_cast<std::size_t>(r)];
    for (Eigen::Index c = 0; c < result.cols(); ++c)
      result(r, c) =
          std::isinf(variance)
              ? 0
              : columns[static_cast<std::size_t>(c)][condition][static_cast<std::size_t>(r)] / std::sqrt(variance);
  }
  return result;
}

/// Sums of a row of weighted values over observables, for each superpixel.
Eigen::VectorXd by_superpixel(const Eigen::VectorXd& rows, Eigen::Index superpixels) {
  return rows.reshaped(superpixels, rows.size() / superpixels).rowwise().sum();
}

/// Held x columns in D^-1 of columns that stand for one a superpixel.
Eigen::MatrixXd spread_cross(const Eigen::MatrixXd& held, const Eigen::MatrixXd& columns, Eigen::Index n) {
  Eigen::MatrixXd cross(held.cols(), columns.cols() * n);
  for (Eigen::Index h = 0; h < held.cols(); ++h) {
    for (Eigen::Index c = 0; c < columns.cols(); ++c)
      cross.row(h).segment(c * n, n) = by_superpixel(held.col(h).cwiseProduct(columns.col(c)), n).transpose();
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

/// What the unknowns that are held take out of everything else.
struct Held {
  /// A column of a condition that stands for an unknown.
  struct Part {
    Eigen::Index column = 0;  ///< among the condition's own and random ones
    Eigen::Index unknown = 0;
    double factor = 1;
  };
  Eigen::LDLT<Eigen::MatrixXd> factors;
  std::vector<std::vector<Part>> parts;  ///< one a condition
  Eigen::VectorXd fitted;                ///< the unknowns' values for the residual
  Eigen::VectorXd pulled;                ///< how hard the priors of what is shared pull at it, the last unknowns
  double square = 0;                     ///< of the residual without them
};

/// The own columns, the light of the target, and what is shared.
std::vector<Held::Part> parts_of(const Problem& problem, std::size_t condition, Eigen::Index own) {
  std::vector<Held::Part> parts;
  for (Eigen::Index c = 0; c < own; ++c) parts.push_back({c, c, 1});
  const int target = problem.target[condition];
  if (target >= 0) parts.push_back({own + light_direction, own + target, 1});
  const auto targets = static_cast<Eigen::Index>(problem.targets.size());
  for (const Shared& shared : problem.nuisances.of_condition[condition])
    parts.push_back({own + shared.direction, own + targets + shared.unknown, shared.factor});
  return parts;
}

Share share_of(const Problem& problem, const std::vector<double>& rows, std::span<const Column> own,
               std::span<const Group* const> groups, const Variances& variances, std::size_t condition) {
  const Eigen::MatrixXd held = weighted_columns(problem, rows, own, condition);
  const Eigen::MatrixXd gram = held.transpose() * held;
  const auto count = static_cast<Eigen::Index>(own.size());
  double log_determinant = 0;
  const RandomMatrix middle =
      woodbury(gram.block<random_directions, random_directions>(count, count), variances, log_determinant);
  const std::vector<Held::Part> parts = parts_of(problem, condition, count);
  std::vector<Eigen::Index> kept;
  Eigen::VectorXd factor(static_cast<Eigen::Index>(parts.size() + 1));
  for (const Held::Part& part : parts) {
    factor(static_cast<Eigen::Index>(kept.size())) = part.factor;
    kept.push_back(part.column);
  }
  factor(static_cast<Eigen::Index>(kept.size())) = 1;
  kept.push_back(count + gram_tail - 1);
  const Eigen::MatrixXd random = gram.middleCols(count, random_directions);
  Share share;
  const Eigen::MatrixXd marginal = gram - random * middle * random.transpose();
  share.held = factor.asDiagonal() * marginal(kept, kept) * factor.asDiagonal();
  const Residue* residue = problem.allowed.residue.get();
  const auto superpixels = static_cast<Eigen::Index>(problem.design.superpixels());
  for (const Group* group : groups) {
    Eigen::MatrixXd columns = weighted(problem, group->columns, condition, group->first_row);
    Eigen::MatrixXd there = held.middleRows(static_cast<Eigen::Index>(group->first_row), columns.rows());
    const bool smooth = residue != nullptr && group->first_row == distance;
    // Of columns that stand for one a superpixel the whole inverse is put to the others, so that they stay diagonal.
    if (smooth) residue->whiten(condition, (group->by_superpixel ? there : columns).topRows(superpixels));
    const Eigen::MatrixXd cross =
        group->by_superpixel ? spread_cross(there, columns, superpixels) : Eigen::MatrixXd(there.transpose() * columns);
    const Eigen::MatrixXd random_cross = cross.middleRows(count, random_directions), shared = middle * random_cross;
    share.cross.push_back(factor.asDiagonal() * Eigen::MatrixXd(cross - random * shared)(kept, Eigen::all));
    if (!group->by_superpixel) {
      share.tried.push_back({false, columns.transpose() * columns - random_cross.transpose() * shared, {}, {}, {}});
      continue;
    }
    Tried tried{true, {}, spread_diagonals(columns, superpixels), random_cross, middle};
    if (smooth) {
      const Eigen::MatrixXd& modes = residue->modes(condition);
      tried.random.conservativeResize(random_directions + modes.cols(), Eigen::NoChange);
      tried.random.bottomRows(modes.cols()) = spread_cross(modes, columns.topRows(superpixels), superpixels);
      tried.middle = Eigen::MatrixXd::Zero(tried.random.rows(), tried.random.rows());
      tried.middle.topLeftCorner(random_directions, random_directions) = middle;
      tried.middle.diagonal().tail(modes.cols()) = residue->taken(condition);
    }
    share.tried.push_back(std::move(tried));
  }
  return share;
}

Held hold(const std::vector<Share>& shares, const Problem& problem, std::size_t own, const Variances& variances) {
  const Unknowns unknowns = problem.unknowns(own);
  Eigen::MatrixXd sum = unknowns.prior(variances).asDiagonal();
  Eigen::VectorXd score = Eigen::VectorXd::Zero(unknowns.count());
  Held held;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const std::vector<Held::Part>& parts = held.parts.emplace_back(parts_of(problem, i, unknowns.effects));
    const Eigen::MatrixXd& block = shares[i].held;
    const Eigen::Index residual = block.cols() - 1;
    held.square += block(residual, residual);
    for (Eigen::Index a = 0; a < residual; ++a) {
      const Eigen::Index to = parts[static_cast<std::size_t>(a)].unknown;
      score(to) += block(a, residual);
      for (Eigen::Index b = 0; b < residual; ++b) sum(to, parts[static_cast<std::size_t>(b)].unknown) += block(a, b);
    }
  }
  held.factors.compute(sum);
  held.fitted = unknowns.count() > 0 ? Eigen::VectorXd(held.factors.solve(score)) : Eigen::VectorXd(0);
  held.square -= held.fitted.dot(score);
  const auto shared = static_cast<Eigen::Index>(unknowns.sd.size());
  held.pulled = unknowns.prior(variances).tail(shared).cwiseProduct(held.fitted.tail(shared));
  return held;
}

/// Scores of a group's columns with what is held taken out: one row a condition, and one for each unknown that is
/// shared at random, which is as likely to be below zero as above, as conditions are.
struct Projected {
  Eigen::MatrixXd scores;       ///< conditions and what they share x columns
  Eigen::MatrixXd information;  ///< columns x columns
};

Projected project(const std::vector<Share>& shares, const Held& held, std::size_t group) {
  const Eigen::Index columns = shares.front().tried[group].columns(), unknowns = held.fitted.size();
  Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(unknowns, columns);
  Projected result;
  result.information = Eigen::MatrixXd::Zero(columns, columns);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    shares[i].tried[group].add_to(result.information);
    for (std::size_t a = 0; a < held.parts[i].size(); ++a)
      cross.row(held.parts[i][a].unknown) += shares[i].cross[group].row(static_cast<Eigen::Index>(a));
  }
  const Eigen::MatrixXd taken = unknowns > 0 ? Eigen::MatrixXd(held.factors.solve(cross)) : Eigen::MatrixXd(0, columns);
  result.information -= cross.transpose() * taken;
  const Eigen::Index shared = held.pulled.size();
  result.scores.resize(static_cast<Eigen::Index>(shares.size()) + shared, columns);
  result.scores.bottomRows(shared) = held.pulled.asDiagonal() * taken.bottomRows(shared);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const Share& share = shares[i];
    const Eigen::Index residual = share.held.cols() - 1;
    // What is left of the residual in this condition's held columns and in the tried ones.
    Eigen::VectorXd left = share.held.col(residual).head(residual);
    Eigen::VectorXd score = share.cross[group].row(residual).transpose();
    for (Eigen::Index a = 0; a < residual; ++a) {
      const Eigen::Index at = held.parts[i][static_cast<std::size_t>(a)].unknown;
      left -= held.fitted(at) * share.held.col(a).head(residual);
      score -= held.fitted(at) * share.cross[group].row(a).transpose();
    }
    for (Eigen::Index a = 0; a < residual; ++a)
      score -= left(a) * taken.row(held.parts[i][static_cast<std::size_t>(a)].unknown).transpose();
    result.scores.row(static_cast<Eigen::Index>(i)) = score.transpose();
  }
  return result;
}

/// A group's columns in coordinates in which its information is the unit matrix.
struct Whitened {
  Eigen::MatrixXd scores;  ///< conditions x columns
  double statistic(const Eigen::VectorXd& signs) const { return (scores.transpose() * signs).norm(); }
};

Whitened whiten(const Projected& projected, Score& score) {
  score.information = projected.information;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(projected.information);
  const double prior = 1 / (prior_width * prior_width);
  const Eigen::ArrayXd values = solver.eigenvalues().array().max(0);
  score.dimension = (values / (values + prior)).sum();
  score.norm = values.size() > 0 ? std::sqrt(values.maxCoeff()) : 0;
  const Eigen::MatrixXd root = solver.eigenvectors() * (values + prior).sqrt().inverse().matrix().asDiagonal();
  Whitened result{projected.scores * root};
  score.shares = projected.scores;
  const Eigen::VectorXd total = result.scores.colwise().sum();
  score.gain = total.squaredNorm();
  score.values = root * total;
  // What each condition adds along the direction that was found.
  const Eigen::ArrayXd shares = (result.scores * total).array() / std::max(score.gain, 1e-300);
  score.carriers = 1 / std::max(shares.square().sum(), 1e-300);
  return result;
}

std::vector<Eigen::VectorXd> random_signs(Eigen::Index conditions, std::size_t draws, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::vector<Eigen::VectorXd> signs(draws, Eigen::VectorXd(conditions));
  for (Eigen::VectorXd& s : signs) {
    for (double& sign : s) sign = (generator() & 1U) != 0 ? 1 : -1;
  }
  return signs;
}

void flip(const std::vector<Whitened>& groups, std::vector<Score>& scores, std::size_t draws, std::uint64_t seed) {
  const std::size_t n = groups.size();
  std::vector<std::vector<double>> drawn(draws, std::vector<double>(n));
  const std::vector<Eigen::VectorXd> signs = random_signs(groups.front().scores.rows(), draws, seed);
  // Groups of different size are compared by how far they are beyond what noise gives.
  const auto beyond = [&](std::size_t g, double statistic) { return statistic - std::sqrt(scores[g].dimension); };
  tbb::parallel_for(std::size_t{0}, draws, [&](std::size_t d) {
    for (std::size_t g = 0; g < n; ++g) drawn[d][g] = beyond(g, groups[g].statistic(signs[d]));
  });
  for (std::size_t g = 0; g < n; ++g) {
    const double seen = beyond(g, std::sqrt(scores[g].gain));
    std::size_t any = 1, own = 1;
    for (const std::vector<double>& draw : drawn) {
      any += *std::ranges::max_element(draw) >= seen ? 1U : 0U;
      own += draw[g] >= seen ? 1U : 0U;
    }
    scores[g].p_value = static_cast<double>(any) / static_cast<double>(draws + 1);
    scores[g].own_p_value = static_cast<double>(own) / static_cast<double>(draws + 1);
  }
}

}  // namespace

bool significant(const Score& score) {
  return score.p_value < significance || (score.carriers < few && score.gain - score.dimension > certain);
}

double chance_of(const Score& one, const Score& score, std::span<const std::vector<Eigen::Index>> groups,
                 std::size_t flips, std::uint64_t seed) {
  struct Flipped {
    Whitened whitened;
    double dimension = 0;
  };
  std::vector<Flipped> all;
  for (const std::vector<Eigen::Index>& columns : groups) {
    Score scored;
    Whitened whitened = whiten({score.shares(Eigen::all, columns), score.information(columns, columns)}, scored);
    all.push_back({std::move(whitened), scored.dimension});
  }
  const double seen = std::sqrt(one.gain) - std::sqrt(one.dimension);
  const std::vector<Eigen::VectorXd> signs = random_signs(score.shares.rows(), flips, seed);
  std::vector<std::uint8_t> as_much(flips, 0);
  tbb::parallel_for(std::size_t{0}, flips, [&](std::size_t d) {
    as_much[d] = std::ranges::any_of(all, [&](const Flipped& group) {
      return group.whitened.statistic(signs[d]) - std::sqrt(group.dimension) >= seen;
    });
  });
  return static_cast<double>(1 + std::ranges::count(as_much, 1)) / static_cast<double>(flips + 1);
}

Scan scan(const Problem& problem, const Fit& fit, std::span<const Column> own, std::span<const Group* const> groups,
          std::size_t flips, std::uint64_t seed) {
  const auto rows = expected(problem, fit.state);
  std::vector<Share> shares(rows.size());
  tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t i) {
    shares[i] = share_of(problem, rows[i], own, groups, fit.state.variances, i);
  });
  const Held held = hold(shares, problem, own.size(), fit.state.variances);
  Scan result;
  result.square = held.square;
  for (const Observations& data : problem.data)
    result.freedom +=
        static_cast<double>(std::ranges::count_if(data.variance, [](double v) { return std::isfinite(v); }));
  result.freedom -= fit.dimension + static_cast<double>(problem.targets.size());
  result.scores.resize(groups.size());
  std::vector<Whitened> whitened(groups.size());
  tbb::parallel_for(std::size_t{0}, groups.size(),
                    [&](std::size_t g) { whitened[g] = whiten(project(shares, held, g), result.scores[g]); });
  if (flips > 0 && !groups.empty()) flip(whitened, result.scores, flips, seed);
  return result;
}

Score score_of(const Problem& problem, const Fit& fit, std::span<const Column> own, const Group& group,
               std::size_t flips, std::uint64_t seed) {
  const Group* const only = &group;
  return scan(problem, fit, own, std::span(&only, 1), flips, seed).scores[0];
}

double false_discovery_limit(std::vector<double> p_values, double q) {
  std::ranges::sort(p_values);
  double limit = 0;
  for (std::size_t i = 0; i < p_values.size(); ++i) {
    if (p_values[i] <= q * static_cast<double>(i + 1) / static_cast<double>(p_values.size())) limit = p_values[i];
  }
  return limit;
}

}  // namespace tofgraph::diagnosis
