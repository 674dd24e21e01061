// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/scan.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tofgraph::diagnosis {
namespace {

constexpr double rounding = 1e-13;           ///< of a sum of products
constexpr double projected_already = 1e-10;  ///< least fraction of a column's information beyond the unknowns

/// Projection on the unknowns, which is subtracted from everything else.
struct Projection {
  Eigen::LDLT<Eigen::MatrixXd> factors;
  std::vector<std::vector<SharedColumn>> parts;  ///< one per condition
  Eigen::VectorXd fitted;                        ///< estimates of the unknowns from the residual
  Eigen::VectorXd pulled;                        ///< pull of the priors on the shared unknowns, which are last
  double square = 0;                             ///< remaining chi-square of the residual
};

Projection projection_of(const std::vector<ConditionGram>& shares, const Problem& problem, std::size_t own,
                         const RandomEffectSd& random_sd) {
  const Unknowns unknowns = problem.unknowns(own);
  Eigen::MatrixXd sum = unknowns.prior(random_sd).asDiagonal();
  Eigen::VectorXd score = Eigen::VectorXd::Zero(unknowns.count());
  Projection projection;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const std::vector<SharedColumn>& parts =
        projection.parts.emplace_back(shared_columns_of(problem, i, unknowns.effects));
    const Eigen::MatrixXd& block = shares[i].projected;
    const Eigen::Index residual = block.cols() - 1;
    projection.square += block(residual, residual);
    for (Eigen::Index a = 0; a < residual; ++a) {
      const Eigen::Index to = parts[static_cast<std::size_t>(a)].unknown;
      score(to) += block(a, residual);
      for (Eigen::Index b = 0; b < residual; ++b) sum(to, parts[static_cast<std::size_t>(b)].unknown) += block(a, b);
    }
  }
  projection.factors.compute(sum);
  projection.fitted = unknowns.count() > 0 ? Eigen::VectorXd(projection.factors.solve(score)) : Eigen::VectorXd(0);
  projection.square -= projection.fitted.dot(score);
  const auto shared = static_cast<Eigen::Index>(unknowns.sd.size());
  projection.pulled = unknowns.prior(random_sd).tail(shared).cwiseProduct(projection.fitted.tail(shared));
  return projection;
}

/// Scores of a group's columns, unknowns projected out: one row per condition, and one per shared random unknown,
/// whose sign is as random as that of a condition.
struct Projected {
  Eigen::MatrixXd scores;       ///< (conditions and shared unknowns) x columns
  Eigen::MatrixXd information;  ///< columns x columns
};

/// Sign-flip units of the conditions, then of the shared random unknowns.
std::vector<Eigen::Index> units_of(const Problem& problem, const State& state) {
  std::vector<Eigen::Index> units = runs_of(problem, state);
  const Eigen::Index first = 1 + std::ranges::max(units);
  for (std::size_t s = 0; s < problem.nuisances.sd.size(); ++s) units.push_back(first + static_cast<Eigen::Index>(s));
  return units;
}

Projected project(const std::vector<ConditionGram>& shares, const Projection& projection, std::size_t group) {
  const Eigen::Index columns = shares.front().candidates[group].columns(), unknowns = projection.fitted.size();
  Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(unknowns, columns);
  Projected result;
  result.information = Eigen::MatrixXd::Zero(columns, columns);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    shares[i].candidates[group].add_to(result.information);
    for (std::size_t a = 0; a < projection.parts[i].size(); ++a)
      cross.row(projection.parts[i][a].unknown) += shares[i].cross[group].row(static_cast<Eigen::Index>(a));
  }
  const Eigen::MatrixXd taken =
      unknowns > 0 ? Eigen::MatrixXd(projection.factors.solve(cross)) : Eigen::MatrixXd(0, columns);
  const Eigen::VectorXd before = result.information.diagonal();
  result.information -= cross.transpose() * taken;
  const Eigen::Index shared = projection.pulled.size();
  result.scores.resize(static_cast<Eigen::Index>(shares.size()) + shared, columns);
  result.scores.bottomRows(shared) = projection.pulled.asDiagonal() * taken.bottomRows(shared);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const ConditionGram& share = shares[i];
    const Eigen::Index residual = share.projected.cols() - 1;
    // Remaining residual in the products with this condition's projected columns and with the candidate columns.
    Eigen::VectorXd left = share.projected.col(residual).head(residual);
    Eigen::VectorXd score = share.cross[group].row(residual).transpose();
    for (Eigen::Index a = 0; a < residual; ++a) {
      const Eigen::Index at = projection.parts[i][static_cast<std::size_t>(a)].unknown;
      left -= projection.fitted(at) * share.projected.col(a).head(residual);
      score -= projection.fitted(at) * share.cross[group].row(a).transpose();
    }
    for (Eigen::Index a = 0; a < residual; ++a)
      score -= left(a) * taken.row(projection.parts[i][static_cast<std::size_t>(a)].unknown).transpose();
    result.scores.row(static_cast<Eigen::Index>(i)) = score.transpose();
  }
  for (Eigen::Index c = 0; c < columns; ++c) {  // e.g. a uniform intensity, which equals the contrast
    if (result.information(c, c) > projected_already * before(c)) continue;
    result.information.row(c).setZero();
    result.information.col(c).setZero();
    result.scores.col(c).setZero();
  }
  return result;
}

/// Matrix R with R R^T equal to the inverse of an information including the prior.
/// @param dimension output: number of directions that the data determine
Eigen::MatrixXd root_of_inverse(const Eigen::MatrixXd& information, double& dimension) {
  constexpr double prior = 1 / (settings.prior_width * settings.prior_width);
  const Eigen::Index n = information.rows();
  Eigen::MatrixXd with_prior = information;
  with_prior.diagonal().array() += prior;
  const Eigen::LLT<Eigen::MatrixXd> factors(with_prior);
  // Rounding errors must be small compared with the prior, which alone determines the remaining directions.
  const double largest = n > 0 ? with_prior.diagonal().maxCoeff() : 0;
  if (factors.info() == Eigen::Success && largest * rounding < prior) {
    Eigen::MatrixXd root = Eigen::MatrixXd::Identity(n, n);
    factors.matrixU().solveInPlace<Eigen::OnTheLeft>(root);
    dimension = static_cast<double>(n) - prior * root.squaredNorm();
    return root;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(information);
  const Eigen::ArrayXd values = solver.eigenvalues().array().max(0);
  dimension = (values / (values + prior)).sum();
  return solver.eigenvectors() * (values + prior).sqrt().inverse().matrix().asDiagonal();
}

/// Scores of a group in coordinates in which its information is the unit matrix.
struct Whitened {
  Eigen::MatrixXd scores;  ///< conditions x columns
  double dimension = 0;
  /// Statistic beyond the expectation for noise, by which groups of different size are compared.
  double beyond(const Eigen::VectorXd& signs) const {
    return (scores.transpose() * signs).norm() - std::sqrt(dimension);
  }
};

Whitened whiten(const Projected& projected, Score& score) {
  score.information = projected.information;
  const Eigen::MatrixXd root = root_of_inverse(projected.information, score.dimension);
  Whitened result{projected.scores * root, score.dimension};
  score.shares = projected.scores;
  const Eigen::VectorXd total = result.scores.colwise().sum();
  score.gain = total.squaredNorm();
  score.values = root * total;
  // Contributions of the conditions, or of units that flip together, along the fitted direction.
  const Eigen::VectorXd shares = result.scores * total / std::max(score.gain, 1e-300);
  Eigen::VectorXd of_units = Eigen::VectorXd::Zero(score.units.empty() ? 0 : 1 + std::ranges::max(score.units));
  for (std::size_t row = 0; row < score.units.size(); ++row)
    of_units(score.units[row]) += shares(static_cast<Eigen::Index>(row));
  score.effective_sample_size = 1 / std::max(of_units.squaredNorm(), 1e-300);
  return result;
}

std::vector<Eigen::VectorXd> random_signs(const std::vector<Eigen::Index>& units, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  Eigen::VectorXd of_units(1 + std::ranges::max(units));
  std::vector<Eigen::VectorXd> signs(settings.sign_flips);
  for (Eigen::VectorXd& s : signs) {
    for (double& sign : of_units) sign = (generator() & 1U) != 0 ? 1 : -1;
    s = of_units(units);
  }
  return signs;
}

void flip(const std::vector<Whitened>& groups, std::vector<Score>& scores, std::uint64_t seed) {
  constexpr std::size_t draws = settings.sign_flips;
  const std::size_t n = groups.size();
  std::vector<std::vector<double>> drawn(draws, std::vector<double>(n));
  const std::vector<Eigen::VectorXd> signs = random_signs(scores.front().units, seed);
  tbb::parallel_for(std::size_t{0}, draws, [&](std::size_t d) {
    for (std::size_t g = 0; g < n; ++g) drawn[d][g] = groups[g].beyond(signs[d]);
  });
  for (std::size_t g = 0; g < n; ++g) {
    const double seen = std::sqrt(scores[g].gain) - std::sqrt(scores[g].dimension);
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
  return score.p_value < settings.significance ||
         (score.effective_sample_size < settings.min_effective_sample_size &&
          score.gain - score.dimension > settings.certain_gain * score.run_length);
}

double chance_of(const Score& one, const Score& score, std::span<const std::vector<Eigen::Index>> groups,
                 std::uint64_t seed) {
  std::vector<Whitened> all;
  for (const std::vector<Eigen::Index>& columns : groups) {
    Score scored;
    all.push_back(whiten({score.shares(Eigen::all, columns), score.information(columns, columns)}, scored));
  }
  const double seen = std::sqrt(one.gain) - std::sqrt(one.dimension);
  const std::vector<Eigen::VectorXd> signs = random_signs(score.units, seed);
  std::vector<std::uint8_t> as_much(signs.size(), 0);
  tbb::parallel_for(std::size_t{0}, signs.size(), [&](std::size_t d) {
    as_much[d] = std::ranges::any_of(all, [&](const Whitened& group) { return group.beyond(signs[d]) >= seen; });
  });
  return static_cast<double>(1 + std::ranges::count(as_much, 1)) / static_cast<double>(signs.size() + 1);
}

Scanner::Scanner(const Problem& problem, const ModelFit& fit, std::span<const Group* const> groups,
                 std::span<const Column> maps)
    : problem_(problem),
      own_(fit.jacobian.size() + maps.size() * problem.design.superpixels()),
      groups_(groups.size()),
      run_length_(run_length(problem, fit.state)),
      units_(units_of(problem, fit.state)),
      products_(problem.data.size()) {
  const auto rows = expected(problem, fit.state);
  tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t i) {
    products_[i] = products_of(problem, fit.state, rows[i], fit.jacobian, maps, groups, i);
  });
}

Scan Scanner::scan(const RandomEffectSd& random_sd, double dimension, std::optional<std::uint64_t> seed) const {
  std::vector<ConditionGram> shares(products_.size());
  tbb::parallel_for(std::size_t{0}, shares.size(), [&](std::size_t i) {
    shares[i] =
        condition_gram_of(products_[i], shared_columns_of(problem_, i, static_cast<Eigen::Index>(own_)), random_sd);
  });
  const Projection projection = projection_of(shares, problem_, own_, random_sd);
  Scan result;
  result.square = projection.square;
  for (const Observations& data : problem_.data)
    result.freedom +=
        static_cast<double>(std::ranges::count_if(data.variance, [](double v) { return std::isfinite(v); }));
  result.freedom -= dimension + static_cast<double>(problem_.targets.size());
  result.scores.resize(groups_);
  std::vector<Whitened> whitened(groups_);
  for (Score& score : result.scores) score.units = units_, score.run_length = run_length_;
  tbb::parallel_for(std::size_t{0}, groups_,
                    [&](std::size_t g) { whitened[g] = whiten(project(shares, projection, g), result.scores[g]); });
  if (seed && groups_ > 0) flip(whitened, result.scores, *seed);
  return result;
}

Scan scan(const Problem& problem, const ModelFit& fit, std::span<const Group* const> groups,
          std::optional<std::uint64_t> seed) {
  return Scanner(problem, fit, groups).scan(fit.state.random_sd, fit.dimension, seed);
}

double lack_of_fit(const Problem& problem, const ModelFit& fit) {
  const Scan rest = scan(problem, fit, {});
  return rest.square / rest.freedom;
}

Score score_of(const Problem& problem, const ModelFit& fit, const Group& group, std::optional<std::uint64_t> seed,
               std::span<const Column> maps) {
  const Group* const only = &group;
  const Scanner scanner(problem, fit, std::span(&only, 1), maps);
  return scanner.scan(fit.state.random_sd, fit.dimension, seed).scores[0];
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
