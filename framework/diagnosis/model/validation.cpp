// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/validation.hpp"

#include "diagnosis/data/design.hpp"
#include "diagnosis/model/nuisances.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Calls f(condition, row) for each known value of the observable.
template <class F> void for_each_known(const Problem& problem, std::size_t observable, F f) {
  for (std::size_t i = 0; i < problem.data.size(); ++i) {
    if (!problem.design.shows_board(i)) continue;  // a capped lens has no gap
    for (const std::size_t row : problem.known_rows(i, observable)) f(i, row);
  }
}

/// Change of a row by one standard deviation of each nuisance of its condition: board, camera, light.
Eigen::Vector3d common(const Model& model, std::size_t i, std::size_t row) {
  const RandomEffectSd& sd = model.state.random_sd;
  return {sd.jitter * model.state.jitter_response(model.problem, i, row),
          sd.offset * model.problem.offset_response(i, row),
          sd.light * model.state.light_response(model.problem, i, row)};
}

/// Variance of a single superpixel, including a smooth field, which is new in each condition.
double own_variance(const Model& model, std::size_t observable, std::size_t i, std::size_t row) {
  const double smooth_field =
      observable == distance && model.state.nuisances.smooth_field ? model.state.nuisances.smooth_field->sd() : 0;
  return model.problem.data[i].variance[row] + smooth_field * smooth_field;
}

double square(const Eigen::Vector3d& parts) {
  double sum = 0;
  for (const double part : parts) sum += part * part;
  return sum;
}

/// Means over the superpixels of a condition; the nuisances that they share do not average out.
/// @param contrast see contrast_shift()
Evidence::Mean mean_of(const Model& model, const Rows& simulated, const Rows& extended, std::size_t observable,
                       std::size_t i, double contrast) {
  const Problem& problem = model.problem;
  if (!problem.design.shows_board(i)) return {NAN, NAN, NAN, NAN};
  const bool of_light = observable == amplitude || observable == intensity;
  const double light = of_light ? log_reflectivity_of(problem, model.state, i) : 0;
  Evidence::Mean mean;
  Eigen::Vector3d shared = Eigen::Vector3d::Zero();
  double count = 0, noise = 0;
  for (const std::size_t row : problem.known_rows(i, observable)) {
    const double scale = problem.shown_scale(observable, i, row);
    mean.measured += scale * (problem.data[i].value[row] - light);
    mean.simulated += scale * (simulated[i][row] - light);
    mean.extended += scale * (extended[i][row] + contrast - light);
    noise += scale * scale * own_variance(model, observable, i, row);
    shared += scale * common(model, i, row);
    ++count;
  }
  if (count == 0) return {NAN, NAN, NAN, NAN};
  return {mean.measured / count, mean.simulated / count, mean.extended / count,
          std::sqrt(noise + square(shared)) / count};
}

}  // namespace

double contrast_shift(const Problem& problem, const State& state, std::size_t observable) {
  return observable == intensity && has_contrast(problem.nuisances) ? log_lower_contrast(problem, state) : 0;
}

double gap(const Problem& problem, const State& state, std::size_t observable, double shift) {
  const auto rows = expected(problem, state);
  double sum = 0, count = 0;
  for_each_known(problem, observable, [&](std::size_t i, std::size_t row) {
    const double left = (problem.data[i].value[row] - shift - rows[i][row]) * problem.shown_scale(observable, i, row);
    sum += left * left;
    ++count;
  });
  return std::sqrt(sum / count);
}

MeasuredNoise measured_noise(const Problem& problem, bool frames, std::size_t observable) {
  MeasuredNoise result;
  const auto variance_of_frames = [&](std::size_t i, std::size_t row) {
    return frames ? std::pow(problem.shown_scale(observable, i, row), 2) * problem.data[i].variance[row] : 0;
  };
  double known = 0;
  for_each_known(problem, observable, [&](std::size_t i, std::size_t row) {
    result.frames += variance_of_frames(i, row);
    ++known;
  });
  if (known > 0) result.frames /= known;
  std::map<std::string, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < problem.data.size(); ++i) {
    if (problem.design.shows_board(i)) groups[settings_of(problem.design.conditions()[i])].push_back(i);
  }
  const std::size_t n = problem.design.superpixels();
  double beyond = 0, freedom = 0;
  for (const auto& [settings, group] : groups) {
    for (std::size_t row = observable * n; group.size() > 1 && row < (observable + 1) * n; ++row) {
      double sum = 0, square = 0, count = 0, noise = 0;
      for (const std::size_t i : group) {
        if (std::isinf(problem.data[i].variance[row])) continue;
        const double value = problem.data[i].value[row] * problem.shown_scale(observable, i, row);
        sum += value, square += value * value, ++count;
        noise += variance_of_frames(i, row);
      }
      if (count < 2) continue;
      beyond += square - sum * sum / count - noise * (count - 1) / count;
      freedom += count - 1;
    }
  }
  if (freedom > 0) result.repeated = std::max(beyond / freedom, 0.0);
  result.known = frames || freedom > 0;
  return result;
}

std::array<double, observables> scatter_of(const Problem& problem, const State& state) {
  const RandomEffectSd& sd = state.random_sd;
  const auto rows = expected(problem, state), shared = with_nuisances(problem, state, rows);
  const std::vector<Gram> grams = grams_of(problem, state, shared, {});
  const Eigen::Vector3d deviation(sd.jitter, sd.offset, sd.light);
  const double boards = state.nuisances.boards ? state.nuisances.boards->sd : 0;
  // Posterior mean and covariance of each condition's position, offset and light, in standard deviations.
  std::vector<std::pair<Eigen::Vector3d, Eigen::Matrix3d>> own;
  for (const Gram& gram : grams) {
    const Eigen::Matrix3d information = deviation.asDiagonal() * gram.topLeftCorner<3, 3>() * deviation.asDiagonal();
    const Eigen::Matrix3d open = (information + Eigen::Matrix3d::Identity()).llt().solve(Eigen::Matrix3d::Identity());
    own.emplace_back(open * deviation.cwiseProduct(gram.col(gram.cols() - 1).head<3>()), open);
  }
  std::array<double, observables> scatter{};
  for (std::size_t o = 0; o < observables; ++o) {
    const double smooth_field = o == distance && state.nuisances.smooth_field ? state.nuisances.smooth_field->sd() : 0;
    const double contrast = contrast_shift(problem, state, o);
    double sum = 0, count = 0;
    for_each_known(problem, o, [&](std::size_t i, std::size_t row) {
      const Eigen::Vector3d along = common({problem, state}, i, row);
      const auto& [value, open] = own[i];
      const double scale = problem.shown_scale(o, i, row),
                   there = shared[i][row] - rows[i][row] - contrast + along.dot(value);
      sum += scale * scale *
             (there * there + along.dot(open * along) + smooth_field * smooth_field +
              std::pow(boards * problem.design.shift(i)[row], 2));
      ++count;
    });
    scatter[o] = sum / count;
  }
  return scatter;
}

Evidence evidence(const Model& simulated, const Model& extended, std::size_t observable) {
  const Rows before = expected(simulated.problem, simulated.state), after = expected(extended.problem, extended.state);
  const Problem& problem = extended.problem;
  const std::size_t conditions = problem.data.size(), n = problem.design.superpixels();
  const double contrast = contrast_shift(problem, extended.state, observable);
  Evidence result;
  const Rows none(conditions, std::vector<double>(n, NAN));
  result.before = result.after = result.sd = none;
  for (std::size_t i = 0; i < conditions; ++i) {
    result.means.push_back(mean_of(extended, before, after, observable, i, contrast));
    for (std::size_t s = 0; s < n && problem.design.shows_board(i); ++s) {
      const std::size_t row = observable * n + s;
      const double variance = own_variance(extended, observable, i, row);
      if (std::isinf(variance)) continue;
      const double scale = problem.shown_scale(observable, i, row);
      result.before[i][s] = scale * (problem.data[i].value[row] - before[i][row]);
      result.after[i][s] = scale * (problem.data[i].value[row] - contrast - after[i][row]);
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
