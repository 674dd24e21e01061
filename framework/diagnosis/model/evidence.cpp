// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/evidence.hpp"

#include <array>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

/// Common part of a condition, in standard deviations of each kind: board, camera, light.
std::array<double, random_directions> common(const Model& model, std::size_t i, std::size_t row) {
  const RandomEffectSd& sd = model.state.random_sd;
  return {sd.jitter * model.state.jitter_response(model.problem, i, row),
          sd.offset * model.problem.offset_response(i, row),
          sd.light * model.state.light_response(model.problem, i, row)};
}

/// Variance of one superpixel alone; what is smooth over the image and differs between conditions counts as that.
double own_variance(const Model& model, std::size_t observable, std::size_t i, std::size_t row) {
  const double smooth_field =
      observable == distance && model.state.nuisances.smooth_field ? model.state.nuisances.smooth_field->sd() : 0;
  return model.problem.data[i].variance[row] + smooth_field * smooth_field;
}

double square(const std::array<double, random_directions>& parts) {
  double sum = 0;
  for (const double part : parts) sum += part * part;
  return sum;
}

/// Means over the superpixels of a condition; what is common to them does not average out.
Evidence::Mean mean_of(const Model& model, const Rows& simulated, const Rows& extended, std::size_t observable,
                       std::size_t i) {
  const Problem& problem = model.problem;
  if (!problem.design.shows_board(i)) return {NAN, NAN, NAN, NAN};
  const std::size_t n = problem.design.superpixels();
  const int target = problem.target[i];
  const bool of_light = observable == amplitude || observable == intensity;
  const double light = of_light && target >= 0 ? model.state.log_reflectivity[static_cast<std::size_t>(target)] : 0;
  Evidence::Mean mean;
  std::array<double, random_directions> shared{};
  double count = 0, noise = 0;
  for (std::size_t row = observable * n; row < (observable + 1) * n; ++row) {
    const double variance = own_variance(model, observable, i, row);
    if (std::isinf(variance)) continue;
    const double scale = observable == distance ? 1 / problem.design.shift(i)[row] : 1;  // half paths become depths
    mean.measured += scale * (problem.data[i].value[row] - light);
    mean.simulated += scale * (simulated[i][row] - light);
    mean.extended += scale * (extended[i][row] - light);
    noise += scale * scale * variance;
    const auto parts = common(model, i, row);
    for (std::size_t k = 0; k < parts.size(); ++k) shared[k] += scale * parts[k];
    ++count;
  }
  if (count == 0) return {NAN, NAN, NAN, NAN};
  return {mean.measured / count, mean.simulated / count, mean.extended / count,
          std::sqrt(noise + square(shared)) / count};
}

}  // namespace

Evidence evidence(const Model& simulated, const Model& extended, std::size_t observable) {
  const Rows before = expected(simulated.problem, simulated.state), after = expected(extended.problem, extended.state);
  const Problem& problem = extended.problem;
  const std::size_t conditions = problem.data.size(), n = problem.design.superpixels();
  Evidence result;
  const Rows none(conditions, std::vector<double>(n, NAN));
  result.before = result.after = result.sd = none;
  for (std::size_t i = 0; i < conditions; ++i) {
    result.means.push_back(mean_of(extended, before, after, observable, i));
    for (std::size_t s = 0; s < n && problem.design.shows_board(i); ++s) {
      const std::size_t row = observable * n + s;
      const double variance = own_variance(extended, observable, i, row);
      if (std::isinf(variance)) continue;
      const double scale = observable == distance ? 1 / problem.design.shift(i)[row] : 1;
      result.before[i][s] = scale * (problem.data[i].value[row] - before[i][row]);
      result.after[i][s] = scale * (problem.data[i].value[row] - after[i][row]);
      result.sd[i][s] = scale * std::sqrt(variance + square(common(extended, i, row)));
    }
  }
  for (std::size_t s = 0; s < n; ++s) {
    double sum_before = 0, sum_after = 0, variance = 0, count = 0;
    for (std::size_t i = 0; i < conditions; ++i) {
      if (!std::isfinite(result.sd[i][s])) continue;
      sum_before += result.before[i][s];
      sum_after += result.after[i][s];
      variance += result.sd[i][s] * result.sd[i][s];
      ++count;
    }
    const bool seen = count > 0;
    result.map_before.push_back(seen ? sum_before / count : NAN);
    result.map_after.push_back(seen ? sum_after / count : NAN);
    result.map_sd.push_back(seen ? std::sqrt(variance) / count : NAN);
  }
  return result;
}

}  // namespace tofgraph::diagnosis
