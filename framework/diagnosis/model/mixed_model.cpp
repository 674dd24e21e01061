// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/mixed_model.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <boost/math/tools/minima.hpp>

#include <algorithm>
#include <array>
#include <cmath>

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

/// The least value of f over ln x.
template <class F> double minimise(F f, Bounds bounds, double centre, double width) {
  constexpr int bits = 10;  // of ln x: some percent of x
  const double low = std::max(std::log(bounds.least), std::log(centre) - width),
               high = std::min(std::log(bounds.most), std::log(centre) + width);
  return std::exp(
      boost::math::tools::brent_find_minima([&](double x) { return f(std::exp(x)); }, low, high, bits).first);
}

/// Degrees of freedom that the priors leave of the unknowns.
struct Factors {
  Eigen::LDLT<Eigen::MatrixXd> factors;
  Eigen::VectorXd values;
  double deviance = 0;
};

/// @param centre of the priors
Factors factorised(const NormalEquations& equations, const Unknowns& unknowns, const Eigen::VectorXd& prior,
                   const Eigen::VectorXd& centre) {
  Eigen::MatrixXd information = equations.information;
  information.diagonal() += prior;
  const Eigen::VectorXd pull = prior.cwiseProduct(centre), score = equations.score + pull;
  Factors result{Eigen::LDLT<Eigen::MatrixXd>(information), {}, 0};
  result.values = result.factors.solve(score);
  result.deviance = equations.square + pull.dot(centre) - result.values.dot(score) + equations.log_determinant;
  // What is shared is random: its priors' widths are estimated, so their determinants count.
  if (const auto shared = static_cast<Eigen::Index>(unknowns.sd.size()); shared > 0) {
    const Eigen::LDLT<Eigen::MatrixXd> block(information.bottomRightCorner(shared, shared));
    result.deviance += block.vectorD().array().log().sum() - prior.tail(shared).array().log().sum();
  }
  return result;
}

/// Cameras do not wander by metres: where a model is so wrong that this would pay, what is shared is held at a few of
/// the widest prior's standard deviations.
Factors factorise(const NormalEquations& equations, const Unknowns& unknowns, const RandomEffectSd& random_sd) {
  constexpr double firmly = 1e4;
  const Eigen::VectorXd free = unknowns.prior(random_sd);
  Eigen::VectorXd prior = free, centre = Eigen::VectorXd::Zero(unknowns.count());
  Factors result = factorised(equations, unknowns, prior, centre);
  double held_cost = 0;
  const Eigen::Index first = unknowns.effects + unknowns.targets;
  for (bool within = false; !within;) {  // each round holds one at least
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
    if (!within) result = factorised(equations, unknowns, prior, centre);
  }
  result.deviance += held_cost;
  return result;
}

Eigen::Vector<double, random_directions> scale_of(const RandomEffectSd& random_sd) {
  return {random_sd.jitter, random_sd.offset, random_sd.light};
}

}  // namespace

Eigen::VectorXd Unknowns::prior(const RandomEffectSd& random_sd) const {
  Eigen::VectorXd result = Eigen::VectorXd::Constant(count(), 1 / (settings.prior_width * settings.prior_width));
  for (std::size_t u = 0; u < sd.size(); ++u)
    result(effects + targets + static_cast<Eigen::Index>(u)) = 1 / std::pow(random_sd.*sd[u], 2);
  return result;
}

RandomMatrix downdate_factor(const RandomMatrix& gram, const RandomEffectSd& random_sd, double& log_determinant) {
  const auto scale = scale_of(random_sd);
  const RandomMatrix inner = RandomMatrix::Identity() + scale.asDiagonal() * gram * scale.asDiagonal();
  const RandomMatrix lower = Eigen::LLT<RandomMatrix>(inner).matrixL();
  log_determinant = 2 * lower.diagonal().array().log().sum();
  return lower.triangularView<Eigen::Lower>().solve(RandomMatrix(scale.asDiagonal()));
}

Gram marginal(const Gram& gram, const RandomEffectSd& random_sd, double& log_determinant) {
  const Eigen::Index g = gram.cols() - gram_tail;
  const RandomMatrix factor =
      downdate_factor(gram.block<random_directions, random_directions>(g, g), random_sd, log_determinant);
  const Eigen::Matrix<double, random_directions, Eigen::Dynamic> taken =
      factor.lazyProduct(gram.middleRows<random_directions>(g));
  return gram - taken.transpose().lazyProduct(taken);
}

NormalEquations assemble(std::span<const Gram> marginals, std::span<const double> log_determinants,
                         const Unknowns& unknowns, std::span<const double> weight) {
  const Eigen::Index p = unknowns.effects, random = p, residual = p + gram_tail - 1, all = unknowns.count();
  NormalEquations sum{Eigen::MatrixXd::Zero(all, all), Eigen::VectorXd::Zero(all), 0, 0};
  std::vector<Shared> shared;
  for (std::size_t i = 0; i < marginals.size(); ++i) {
    const double w = weight[i];
    if (w == 0) continue;
    const Gram& m = marginals[i];
    sum.information.topLeftCorner(p, p) += w * m.topLeftCorner(p, p);
    sum.score.head(p) += w * m.col(residual).head(p);
    sum.square += w * m(residual, residual);
    sum.log_determinant += w * log_determinants[i];
    shared.clear();
    if (unknowns.target[i] >= 0) shared.push_back({light_direction, unknowns.target[i], 1});
    if (!unknowns.shared.empty()) {
      for (const Shared& one : unknowns.shared[i])
        shared.push_back({one.direction, unknowns.targets + one.unknown, one.factor});
    }
    for (std::size_t one = 0; one < shared.size(); ++one) {
      const Shared& a = shared[one];
      const Eigen::Index at = p + a.unknown;
      const double factor = w * a.factor;
      const auto column = m.col(random + a.direction);
      sum.information.col(at).head(p) += factor * column.head(p);
      sum.score(at) += factor * m(random + a.direction, residual);
      for (std::size_t other = one; other < shared.size(); ++other) {
        const Shared& b = shared[other];
        const auto [least, most] = std::minmax(a.unknown, b.unknown);  // the lower half
        sum.information(p + most, p + least) += factor * b.factor * column(random + b.direction);
      }
    }
  }
  auto block = sum.information.bottomRightCorner(all - p, all - p);
  block.triangularView<Eigen::StrictlyUpper>() = block.transpose().eval();
  sum.information.bottomLeftCorner(all - p, p) = sum.information.topRightCorner(p, all - p).transpose();
  return sum;
}

Solution solve(const NormalEquations& equations, const Unknowns& unknowns, const RandomEffectSd& random_sd) {
  const Factors factors = factorise(equations, unknowns, random_sd);
  const Eigen::Index all = unknowns.count();
  Solution result{factors.values, factors.factors.solve(Eigen::MatrixXd::Identity(all, all)), factors.deviance, 0};
  const double prior = 1 / (settings.prior_width * settings.prior_width);
  for (Eigen::Index j = 0; j < unknowns.effects; ++j)
    result.dimension += std::clamp(1 - prior * result.covariance(j, j), 0.0, 1.0);
  return result;
}

bool is_at_bound(const RandomEffectSd& random_sd, double RandomEffectSd::*which) {
  return random_sd.*which > 0.98 * bounds_of(which).most;
}

Profile profile(std::span<const Gram> grams, const Unknowns& unknowns, std::span<const double> weight,
                const RandomEffectSd& start) {
  std::vector<Gram> marginals(grams.size());
  std::vector<double> determinants(grams.size());
  const auto at = [&](const RandomEffectSd& random_sd) {
    for (std::size_t i = 0; i < grams.size(); ++i) {
      if (weight[i] != 0) marginals[i] = marginal(grams[i], random_sd, determinants[i]);
    }
    return assemble(marginals, determinants, unknowns, weight);
  };
  RandomEffectSd best = start;
  for (const double width : {3.0, 1.0}) {
    const auto vary = [&](double RandomEffectSd::*which, const auto& equations) {
      RandomEffectSd varied = best;
      const auto deviance = [&](double x) {
        varied.*which = x;
        return factorise(equations(varied), unknowns, varied).deviance;
      };
      best.*which = minimise(deviance, bounds_of(which), best.*which, width);
    };
    vary(&RandomEffectSd::jitter, at);
    if (start.offset > 0) vary(&RandomEffectSd::offset, at);
    vary(&RandomEffectSd::light, at);
    if (unknowns.sd.empty()) continue;
    const NormalEquations fixed = at(best);  // what is shared is in the priors alone
    const auto vary_shared = [&](double RandomEffectSd::*which) {
      if (std::ranges::find(unknowns.sd, which) != unknowns.sd.end())
        vary(which, [&](const RandomEffectSd&) -> const NormalEquations& { return fixed; });
    };
    best.mean = settings.drift_mean_sd;
    vary_shared(&RandomEffectSd::drift);
    best.mean = best.drift;
    vary_shared(&RandomEffectSd::drift_light);
    vary_shared(&RandomEffectSd::session);
    vary_shared(&RandomEffectSd::session_light);
  }
  return {best, solve(at(best), unknowns, best)};
}

}  // namespace tofgraph::diagnosis
