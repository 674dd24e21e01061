// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/mixed_model.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <boost/math/tools/minima.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

struct Bounds {
  double least, most;
};

Bounds bounds_of(double RandomEffectSd::*shared) {
  const bool drift = shared == &RandomEffectSd::drift || shared == &RandomEffectSd::mean;
  return {settings.min_sd, shared == &RandomEffectSd::jitter        ? settings.max_jitter_sd
                           : shared == &RandomEffectSd::offset      ? settings.max_offset_sd
                           : shared == &RandomEffectSd::light       ? settings.max_light_sd
                           : drift                                  ? settings.max_drift_sd
                           : shared == &RandomEffectSd::drift_light ? settings.max_drift_light_sd
                                                                    : settings.max_session_sd};
}

/// Argument at which f is least, by Brent's method in ln x, at most `width` from `centre`.
template <class F> double minimise(F f, Bounds bounds, double centre, double width) {
  constexpr int bits = 10;  // in ln x: a few percent of x
  const double low = std::max(std::log(bounds.least), std::log(centre) - width),
               high = std::min(std::log(bounds.most), std::log(centre) + width);
  return std::exp(
      boost::math::tools::brent_find_minima([&](double x) { return f(std::exp(x)); }, low, high, bits).first);
}

/// Normal equations including the priors, their solution and its deviance.
struct Solved {
  Eigen::MatrixXd information;
  Eigen::VectorXd values;
  double deviance = 0;
};

/// Solves equations with a symmetric, positive matrix.
Eigen::VectorXd solved(const Eigen::Ref<const Eigen::MatrixXd>& matrix, const Eigen::VectorXd& right) {
  const Eigen::LLT<Eigen::MatrixXd> positive(matrix);
  if (positive.info() == Eigen::Success) return positive.solve(right);
  return Eigen::LDLT<Eigen::MatrixXd>(matrix).solve(right);  // singular but for rounding
}

double log_determinant_of(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  const Eigen::LLT<Eigen::MatrixXd> positive(matrix);
  if (positive.info() == Eigen::Success) return 2 * positive.matrixLLT().diagonal().array().log().sum();
  return Eigen::LDLT<Eigen::MatrixXd>(matrix).vectorD().array().log().sum();
}

/// @param centre means of the priors
Solved solved_with(const NormalEquations& equations, const Unknowns& unknowns, const Eigen::VectorXd& prior,
                   const Eigen::VectorXd& centre) {
  Solved result{equations.information, {}, 0};
  result.information.diagonal() += prior;
  const Eigen::VectorXd pull = prior.cwiseProduct(centre), score = equations.score + pull;
  result.values = solved(result.information, score);
  result.deviance = equations.square + pull.dot(centre) - result.values.dot(score) + equations.log_determinant;
  // Shared unknowns are random: the widths of their priors are estimated, so the determinants matter.
  if (const auto shared = static_cast<Eigen::Index>(unknowns.sd.size()); shared > 0)
    result.deviance += log_determinant_of(result.information.bottomRightCorner(shared, shared)) -
                       prior.tail(shared).array().log().sum();
  return result;
}

/// Cameras do not drift by metres: if a very wrong model makes shared unknowns that large, they are held at a few
/// standard deviations of the widest prior.
Solved solve_within_bounds(const NormalEquations& equations, const Unknowns& unknowns,
                           const RandomEffectSd& random_sd) {
  constexpr double firmly = 1e4;
  const Eigen::VectorXd free = unknowns.prior(random_sd);
  Eigen::VectorXd prior = free, centre = Eigen::VectorXd::Zero(unknowns.count());
  Solved result = solved_with(equations, unknowns, prior, centre);
  double held_cost = 0;
  const Eigen::Index first = unknowns.effects + unknowns.targets;
  for (bool within = false; !within;) {  // each round holds at least one more
    within = true;
    for (std::size_t u = 0; u < unknowns.sd.size(); ++u) {
      const Eigen::Index at = first + static_cast<Eigen::Index>(u);
      const double limit =
          settings.max_shared_widths * std::max(bounds_of(unknowns.sd[u]).most, random_sd.*unknowns.sd[u]);
      if (centre(at) != 0 || !(std::abs(result.values(at)) > limit)) continue;
      centre(at) = std::copysign(limit, result.values(at));
      prior(at) = firmly * (equations.information(at, at) + free(at));
      held_cost += free(at) * limit * limit;
      within = false;
    }
    if (!within) result = solved_with(equations, unknowns, prior, centre);
  }
  result.deviance += held_cost + std::pow(random_sd.jitter / unknowns.jitter, 2);
  return result;
}

/// Standard deviations along the random directions.
constexpr std::array<double RandomEffectSd::*, random_directions> along_directions = {
    &RandomEffectSd::jitter, &RandomEffectSd::offset, &RandomEffectSd::light};

/// Normal equations as a function of the standard deviation s of one random direction d: a condition's Gram matrix M at
/// s = 0 becomes M - s^2 / (1 + s^2 d^T M d) (M d)(M d)^T.
class VariedEquations {
 public:
  /// @param rest equations at s = 0 @param marginals Gram matrices at s = 0
  VariedEquations(NormalEquations rest, std::span<const Gram> marginals, const Unknowns& unknowns,
                  Eigen::Index direction)
      : rest_(std::move(rest)),
        along_(Eigen::MatrixXd::Zero(unknowns.count(), static_cast<Eigen::Index>(marginals.size()))),
        residual_(marginals.size()),
        size_(marginals.size()) {
    const Eigen::Index p = unknowns.effects, at = p + direction;
    std::vector<Shared> shared;
    for (Eigen::Index i = 0; i < along_.cols(); ++i) {
      const Gram& m = marginals[static_cast<std::size_t>(i)];
      along_.col(i).head(p) = m.col(at).head(p);
      shared.clear();
      unknowns.append_shared(static_cast<std::size_t>(i), shared);
      for (const Shared& one : shared) along_(p + one.unknown, i) += one.factor * m(p + one.direction, at);
      residual_(i) = m(p + gram_tail - 1, at);
      size_(i) = m(at, at);
    }
  }

  NormalEquations at(double s) const {
    const Eigen::VectorXd share = s * s / (1 + s * s * size_.array());
    NormalEquations sum = rest_;
    sum.information.noalias() -= along_ * share.asDiagonal() * along_.transpose();
    sum.score.noalias() -= along_ * share.cwiseProduct(residual_);
    sum.square -= (share.array() * residual_.array().square()).sum();
    sum.log_determinant += (s * s * size_.array()).log1p().sum();
    return sum;
  }

 private:
  NormalEquations rest_;
  Eigen::MatrixXd along_;            // M d: of the unknowns, one column a condition
  Eigen::VectorXd residual_, size_;  // M d of the residual, d^T M d
};

/// Maximum likelihood of the variances, one at a time until the deviance no longer falls.
class VarianceFit {
 public:
  VarianceFit(std::span<const Gram> grams, const Unknowns& unknowns)
      : grams_(grams), unknowns_(unknowns), marginals_(grams.size()), determinants_(grams.size()) {}

  /// Variances of least deviance, and that deviance.
  std::pair<RandomEffectSd, double> from(const RandomEffectSd& start) {
    best_ = start;
    deviance_ = solve_within_bounds(equations(best_), unknowns_, best_).deviance;
    for (int round = 0; round < settings.max_variance_rounds; ++round) {
      const double before = deviance_, width = round == 0 ? 3 : 1;  // of ln sd
      for (Eigen::Index d = 0; d < random_directions; ++d) vary(d, width);
      if (!unknowns_.sd.empty()) vary_shared(width);
      if (before - deviance_ < settings.variances_converged) break;
    }
    return {best_, deviance_};
  }

  Solution solution(const RandomEffectSd& random_sd) { return solve(equations(random_sd), unknowns_, random_sd); }

 private:
  NormalEquations equations(const RandomEffectSd& random_sd) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, grams_.size(), 256), [&](const auto& some) {
      for (std::size_t i = some.begin(); i < some.end(); ++i)
        marginals_[i] = marginal(grams_[i], random_sd, determinants_[i]);
    });
    return assemble(marginals_, determinants_, unknowns_);
  }

  /// @param of returns the normal equations at some variances
  template <class Equations> void vary(double RandomEffectSd::*which, double width, const Equations& of) {
    RandomEffectSd varied = best_;
    const auto deviance = [&](double x) {
      varied.*which = x;
      return solve_within_bounds(of(varied), unknowns_, varied).deviance;
    };
    varied.*which = minimise(deviance, bounds_of(which), best_.*which, width);
    const double now = deviance(varied.*which);
    if (now < deviance_) deviance_ = now, best_ = varied;
  }
  /// Varies the standard deviation along a random direction, unless it is held at 0.
  void vary(Eigen::Index direction, double width) {
    double RandomEffectSd::*const which = along_directions[static_cast<std::size_t>(direction)];
    if (best_.*which == 0) return;
    RandomEffectSd without = best_;
    without.*which = 0;
    NormalEquations rest = equations(without);
    const VariedEquations varied(std::move(rest), marginals_, unknowns_, direction);
    vary(which, width, [&](const RandomEffectSd& sd) { return varied.at(sd.*which); });
  }
  /// Variances of shared unknowns, which affect the priors only.
  void vary_shared(double width) {
    const NormalEquations fixed = equations(best_);
    for (double RandomEffectSd::*which : {&RandomEffectSd::drift, &RandomEffectSd::drift_light,
                                          &RandomEffectSd::session, &RandomEffectSd::session_light}) {
      if (std::ranges::find(unknowns_.sd, which) != unknowns_.sd.end())
        vary(which, width, [&](const RandomEffectSd&) -> const NormalEquations& { return fixed; });
    }
  }

  std::span<const Gram> grams_;
  const Unknowns& unknowns_;
  std::vector<Gram> marginals_;
  std::vector<double> determinants_;
  RandomEffectSd best_;
  double deviance_ = 0;
};

}  // namespace

Eigen::VectorXd Unknowns::prior(const RandomEffectSd& random_sd) const {
  Eigen::VectorXd result = Eigen::VectorXd::Constant(count(), 1 / (settings.prior_width * settings.prior_width));
  for (std::size_t u = 0; u < sd.size(); ++u)
    result(effects + targets + static_cast<Eigen::Index>(u)) = 1 / std::pow(random_sd.*sd[u], 2);
  return result;
}

RandomMatrix downdate_factor(const RandomMatrix& gram, const RandomEffectSd& random_sd, double& log_determinant) {
  Eigen::Vector<double, random_directions> scale;
  for (Eigen::Index d = 0; d < random_directions; ++d)
    scale(d) = random_sd.*along_directions[static_cast<std::size_t>(d)];
  const RandomMatrix inner = RandomMatrix::Identity() + scale.asDiagonal() * gram * scale.asDiagonal();
  const RandomMatrix lower = Eigen::LLT<RandomMatrix>(inner).matrixL();
  log_determinant = 2 * lower.diagonal().array().log().sum();
  return lower.triangularView<Eigen::Lower>().solve(RandomMatrix(scale.asDiagonal()));
}

Gram marginal(const Gram& gram, const RandomEffectSd& random_sd, double& log_determinant) {
  const Eigen::Index g = gram.cols() - gram_tail;
  const RandomMatrix factor =
      downdate_factor(gram.block<random_directions, random_directions>(g, g), random_sd, log_determinant);
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, random_directions>;
  const Columns taken = factor.lazyProduct(gram.middleRows<random_directions>(g)).transpose();
  Gram left(gram.rows(), gram.cols());
  for (Eigen::Index j = 0; j < gram.cols(); ++j)  // by columns, so that the compiler vectorises
    left.col(j) = gram.col(j) - (taken.col(0) * taken(j, 0) + taken.col(1) * taken(j, 1) + taken.col(2) * taken(j, 2));
  return left;
}

std::vector<double> marginalise(std::vector<Gram>& grams, const RandomEffectSd& random_sd) {
  std::vector<double> determinants(grams.size());
  for (std::size_t i = 0; i < grams.size(); ++i) grams[i] = marginal(grams[i], random_sd, determinants[i]);
  return determinants;
}

void Unknowns::append_shared(std::size_t condition, std::vector<Shared>& to) const {
  if (target[condition] >= 0) to.push_back({light_direction, target[condition], 1});
  if (shared.empty()) return;
  for (const Shared& one : shared[condition]) to.push_back({one.direction, targets + one.unknown, one.factor});
}

NormalEquations assemble(std::span<const Gram> marginals, std::span<const double> log_determinants,
                         const Unknowns& unknowns, std::span<const double> weight) {
  const Eigen::Index p = unknowns.effects, random = p, residual = p + gram_tail - 1, all = unknowns.count();
  NormalEquations sum{Eigen::MatrixXd::Zero(all, all), Eigen::VectorXd::Zero(all), 0, 0};
  std::vector<Shared> shared;
  for (std::size_t i = 0; i < marginals.size(); ++i) {
    const double w = weight.empty() ? 1 : weight[i];
    if (w == 0) continue;
    const Gram& m = marginals[i];
    for (Eigen::Index j = 0; j < p; ++j) sum.information.col(j).head(j + 1) += w * m.col(j).head(j + 1);
    sum.score.head(p) += w * m.col(residual).head(p);
    sum.square += w * m(residual, residual);
    sum.log_determinant += w * log_determinants[i];
    shared.clear();
    unknowns.append_shared(i, shared);
    for (std::size_t one = 0; one < shared.size(); ++one) {
      const Shared& a = shared[one];
      const Eigen::Index at = p + a.unknown;
      const double factor = w * a.factor;
      const auto column = m.col(random + a.direction);
      sum.information.col(at).head(p) += factor * column.head(p);
      sum.score(at) += factor * m(random + a.direction, residual);
      for (std::size_t other = one; other < shared.size(); ++other) {
        const Shared& b = shared[other];
        const auto [least, most] = std::minmax(a.unknown, b.unknown);  // lower triangle: mostly along a column
        sum.information(p + most, p + least) += factor * b.factor * column(random + b.direction);
      }
    }
  }
  auto effects = sum.information.topLeftCorner(p, p), block = sum.information.bottomRightCorner(all - p, all - p);
  effects.triangularView<Eigen::StrictlyLower>() = effects.transpose().eval();
  block.triangularView<Eigen::StrictlyUpper>() = block.transpose().eval();
  sum.information.bottomLeftCorner(all - p, p) = sum.information.topRightCorner(p, all - p).transpose();
  return sum;
}

Solution solve(const NormalEquations& equations, const Unknowns& unknowns, const RandomEffectSd& random_sd) {
  const Solved solved = solve_within_bounds(equations, unknowns, random_sd);
  const Eigen::Index all = unknowns.count();
  Solution result{solved.values,
                  Eigen::LDLT<Eigen::MatrixXd>(solved.information).solve(Eigen::MatrixXd::Identity(all, all)),
                  solved.deviance, 0};
  const double prior = 1 / (settings.prior_width * settings.prior_width);
  for (Eigen::Index j = 0; j < unknowns.effects; ++j)
    result.dimension += std::clamp(1 - prior * result.covariance(j, j), 0.0, 1.0);
  return result;
}

bool is_at_bound(const RandomEffectSd& random_sd, double RandomEffectSd::*which) {
  return random_sd.*which > 0.98 * bounds_of(which).most;
}

Profile profile(std::span<const Gram> grams, const Unknowns& unknowns, const RandomEffectSd& start) {
  VarianceFit fit(grams, unknowns);
  std::pair best = fit.from(start);
  if (RandomEffectSd usual; best.first.jitter > 2 * usual.jitter) {
    usual.offset = std::min(usual.offset, start.offset);
    usual.mean = start.mean, usual.contrast = start.contrast;
    if (std::pair other = fit.from(usual); other.second < best.second) best = other;
  }
  return {best.first, fit.solution(best.first)};
}

}  // namespace tofgraph::diagnosis
