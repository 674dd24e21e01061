// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/prediction.hpp"

#include "diagnosis/places.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>

namespace tofgraph::diagnosis {
namespace {

/// A state of the conditions that were left, for those that were put aside: reflectivities of targets that are new are
/// found from amplitudes, never from distances.
State carried(const State& state, const Problem& to) {
  State result = state;
  result.light.resize(to.targets.size(), 0);
  if (result.light.size() == state.light.size()) return result;
  constexpr int rounds = 3;  // other light than the board's answers otherwise
  for (int round = 0; round < rounds; ++round) {
    const auto rows = expected(to, result);
    const std::size_t n = to.design.superpixels();
    for (std::size_t t = state.light.size(); t < to.targets.size(); ++t) {
      double sum = 0, count = 0;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        if (to.target[i] != static_cast<int>(t)) continue;
        for (std::size_t row = amplitude * n; row < (amplitude + 1) * n; ++row) {
          if (std::isinf(to.data[i].variance[row])) continue;
          sum += to.data[i].value[row] - rows[i][row];
          ++count;
        }
      }
      if (count > 0) result.light[t] += sum / count;
    }
  }
  return result;
}

double square_of(const Gram& gram, Eigen::Index column, const Variances& variances) {
  double determinant = 0;
  return marginal(gram, variances, determinant)(column, column);
}

}  // namespace

Prediction::Prediction(FoldProblem& held, const Fold& fold) : held_(held) {
  for (const std::size_t i : fold.held) conditions_.push_back({.condition = i});
}

void Prediction::before(const State& state) {
  const auto rows = predict(state);
  for (std::size_t i = 0; i < conditions_.size(); ++i) conditions_[i].before = sums(rows[i], i);
  // Boards that stand elsewhere are told by the model as it was: none that is to prove itself makes them count less.
  held_.problem.allowed.looseness = looseness_of(places_of(held_.problem, carried(state, held_.problem)));
}

void Prediction::after(const State& state) {
  after_ = predict(state);
  variances_ = state.variances;
  const std::vector<Gram> grams = grams_of(held_.problem, with_nuisances(held_.problem, after_, variances_), {});
  for (std::size_t i = 0; i < after_.size(); ++i) {
    OutOfFold& one = conditions_[i];
    one.after = sums(after_[i], i);
    one.chi_after = square_of(grams[i], grams[i].cols() - 1, variances_);
  }
}

void Prediction::without(const std::string& effect, const State& state, const State& taken_out) {
  const auto rows_of_rest = predict(taken_out);
  const auto rows = predict(state);
  const Column apart = difference(after_, rows);
  const std::vector<Gram> grams =
      grams_of(held_.problem, with_nuisances(held_.problem, rows, variances_), std::span(&apart, 1));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    conditions_[i].without[effect] = {square_of(grams[i], grams[i].cols() - 1, variances_),
                                      square_of(grams[i], 0, variances_), sums(rows[i], i)[distance],
                                      sums(rows_of_rest[i], i)[distance]};
  }
}

std::vector<std::vector<double>> Prediction::predict(const State& state) {
  const State there = carried(state, held_.problem);
  correct(held_.problem, there);
  return expected(held_.problem, there);
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

}  // namespace tofgraph::diagnosis
