// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/injection.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace tofgraph::diagnosis {

std::vector<Observations> injected(const Problem& problem, const State& state, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  State whole = state;
  update_grid_bias(problem, whole);            // as captures are reduced: all over the superpixels
  const auto rows = expected(problem, whole);  // on the boards as they are
  std::vector<Observations> result = problem.data;
  Eigen::VectorXd shared(static_cast<Eigen::Index>(problem.nuisances.sd.size()));  // a wander, sessions
  for (std::size_t u = 0; u < problem.nuisances.sd.size(); ++u) {
    const bool drawn = problem.nuisances.sd[u] != &RandomEffectSd::contrast;  // which is what it is
    const double sd = drawn ? state.random_sd.*problem.nuisances.sd[u] : 0;
    shared(static_cast<Eigen::Index>(u)) = sd > 0 ? sd * normal(generator) : 0;
  }
  for (std::size_t i = 0; i < result.size(); ++i) {
    const RandomEffectSd& sd = state.random_sd;
    const double jitter = sd.jitter * normal(generator);
    const double offset = sd.offset * normal(generator);
    double light = sd.light * normal(generator), uniform = 0;
    for (const Shared& one : problem.nuisances.of_condition[i])
      if (one.direction != contrast_direction)
        (one.direction == uniform_direction ? uniform : light) += one.factor * shared(one.unknown);
    Eigen::VectorXd smooth_field;  // of the distances, which come first
    if (state.nuisances.smooth_field) smooth_field = state.nuisances.smooth_field->drawn(i, generator);
    for (std::size_t row = 0; row < rows[i].size(); ++row) {
      if (std::isinf(result[i].variance[row])) continue;
      const auto at = static_cast<Eigen::Index>(row);
      result[i].value[row] =
          rows[i][row] + jitter * problem.design.shift(i)[row] + offset * problem.offset_response(i, row) +
          light * whole.light_response(problem, i, row) + uniform * problem.uniform_response(i, row) +
          std::sqrt(result[i].variance[row]) * (normal(generator) + (at < smooth_field.size() ? smooth_field(at) : 0));
    }
  }
  return result;
}

Term random_term(const Candidate& candidate, double factor, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform;
  Term term{&candidate, {}};
  for (const FreeParameter& p : candidate.free()) {
    double value = 0;
    if (!p.nonlinear)
      value = p.off + (p.minimum < p.off && uniform(generator) < 0.5 ? -1 : 1) * factor * p.typical;
    else if (p.unit == "rad" && p.maximum - p.minimum > 6.28)
      value = p.minimum + uniform(generator) * (p.maximum - p.minimum);
    else
      value = p.typical * (0.7 + 0.6 * uniform(generator));
    term.values.push_back(std::clamp(value, p.minimum, p.maximum));
  }
  return term;
}

}  // namespace tofgraph::diagnosis
