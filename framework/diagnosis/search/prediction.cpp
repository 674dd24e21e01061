// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/prediction.hpp"

#include "diagnosis/model/board_offsets.hpp"
#include "diagnosis/model/contrast.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>

namespace tofgraph::diagnosis {

namespace {

double square_of(const Gram& gram, Eigen::Index column, const RandomEffectSd& random_sd) {
  double determinant = 0;
  return marginal(gram, random_sd, determinant)(column, column);
}

}  // namespace

Prediction::Prediction(const FoldProblem& held, const Fold& fold) : held_(held) {
  for (const std::size_t i : fold.held) conditions_.push_back({.condition = i});
}

void Prediction::before(const State& state) {
  const auto rows = predict(state);
  for (std::size_t i = 0; i < conditions_.size(); ++i) conditions_[i].before = sums(rows[i], i);
  // Boards that stand elsewhere are found with the model as it was: none that is to be tested makes them count less.
  there_.nuisances.jitter_scale = jitter_scale_of(board_offsets_of(held_.problem, carried(state)));
}

void Prediction::after(const State& state, std::shared_ptr<const SmoothField> smooth_field) {
  there_.nuisances.smooth_field = std::move(smooth_field);
  after_ = predict(state);
  random_sd_ = state.random_sd;
  const std::vector<Gram> grams = grams_of(held_.problem, there_, with_nuisances(held_.problem, there_, after_), {});
  for (std::size_t i = 0; i < after_.size(); ++i) {
    OutOfFold& one = conditions_[i];
    one.after = sums(after_[i], i);
    one.chi_after = square_of(grams[i], grams[i].cols() - 1, random_sd_);
  }
}

void Prediction::without(const std::string& effect, const State& state, const State& taken_out) {
  const auto rows_of_rest = predict(taken_out);
  const auto rows = predict(state);
  there_.random_sd = random_sd_;
  const Column change = difference(after_, rows);
  const std::vector<Gram> grams =
      grams_of(held_.problem, there_, with_nuisances(held_.problem, there_, rows), std::span(&change, 1));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    conditions_[i].without[effect] = {square_of(grams[i], grams[i].cols() - 1, random_sd_),
                                      square_of(grams[i], 0, random_sd_), sums(rows[i], i)[distance],
                                      sums(rows_of_rest[i], i)[distance]};
  }
}

/// A state of the conditions that were left, for the held-out ones: reflectivities of targets that are new are found
/// from amplitudes, never from distances.
State Prediction::carried(const State& state) const {
  const Problem& to = held_.problem;
  State result = beside(there_, state);
  result.log_reflectivity.resize(to.targets.size(), 0);
  if (result.log_reflectivity.size() == state.log_reflectivity.size()) return result;
  constexpr int rounds = 3;  // other light than the board's answers otherwise
  for (int round = 0; round < rounds; ++round) {
    const auto rows = expected(to, result);
    const std::size_t n = to.design.superpixels();
    for (std::size_t t = state.log_reflectivity.size(); t < to.targets.size(); ++t) {
      double sum = 0, count = 0;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        if (to.target[i] != static_cast<int>(t)) continue;
        for (std::size_t row = amplitude * n; row < (amplitude + 1) * n; ++row) {
          if (std::isinf(to.data[i].variance[row])) continue;
          sum += to.data[i].value[row] - rows[i][row];
          ++count;
        }
      }
      if (count > 0) result.log_reflectivity[t] += sum / count;
    }
  }
  return result;
}

Rows Prediction::predict(const State& state) {
  there_ = carried(state);
  update_grid_bias(held_.problem, there_);
  return expected(held_.problem, there_);
}

/// Sums of squares of a condition.
std::array<double, observables> Prediction::sums(const std::vector<double>& rows, std::size_t i) {
  const std::size_t n = held_.design.superpixels();
  std::array<double, observables> squares{};
  conditions_[i].count = {};
  if (!held_.design.shows_board(i)) return squares;  // it has no gap to a board
  for (std::size_t o = 0; o < observables; ++o) {
    for (std::size_t row = o * n; row < (o + 1) * n; ++row) {
      if (std::isinf(held_.data[i].variance[row])) continue;
      const double scale = o == distance ? 1 / held_.design.shift(i)[row] : 1;  // half paths become depths
      squares[o] += std::pow(scale * (held_.data[i].value[row] - rows[row]), 2);
      ++conditions_[i].count[o];
    }
  }
  return squares;
}

std::vector<std::size_t> left_by(const Fold& fold, std::size_t conditions) {
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < conditions; ++i) {
    if (!std::ranges::binary_search(fold.held, i)) left.push_back(i);
  }
  return left;
}

namespace {

/// A problem whose targets are those of another one, in their order, then those that are new.
Problem problem_like(const Problem& other, const Design& design, const std::vector<Observations>& data) {
  Problem problem{design, data, other.targets, {}, nuisances_of(design, has_contrast(other.nuisances)), other.deadline};
  for (const io::Condition& condition : design.conditions()) {
    auto found = std::ranges::find(problem.targets, condition.target);
    const bool known = is_light_known(condition);
    if (!known && found == problem.targets.end() && problem.light_seen())
      found = problem.targets.insert(found, condition.target);
    problem.target.push_back(
        known || found == problem.targets.end() ? -1 : static_cast<int>(found - problem.targets.begin()));
  }
  return problem;
}

std::vector<Observations> picked(const std::vector<Observations>& all, const std::vector<std::size_t>& chosen) {
  std::vector<Observations> some;
  for (const std::size_t i : chosen) some.push_back(all[i]);
  return some;
}

}  // namespace

FoldProblem::FoldProblem(const Design& whole, const std::vector<Observations>& all,
                         const std::vector<std::size_t>& chosen, const Deadline* deadline)
    : design(whole.part(chosen)), data(picked(all, chosen)), problem(make_problem(design, data, deadline)) {}

FoldProblem::FoldProblem(const Design& whole, const std::vector<Observations>& all,
                         const std::vector<std::size_t>& chosen, const FoldProblem& other)
    : design(whole.part(chosen)), data(picked(all, chosen)), problem(problem_like(other.problem, design, data)) {}

void FoldProblem::fix_contrast(double log_lower) {
  const std::size_t n = design.superpixels();
  for (std::size_t i = 0; i < data.size(); ++i) {
    for (std::size_t row = intensity * n; design.shows_board(i) && row < (intensity + 1) * n; ++row)
      data[i].value[row] -= log_lower;
  }
  problem.nuisances = nuisances_of(design);
}

}  // namespace tofgraph::diagnosis
