// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/next_condition.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/candidate.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/trials.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace tofgraph::diagnosis {
namespace {

/// Appends derivatives with respect to the targets' ln reflectivities, one column per target.
void append_light(const Problem& problem, const State& state, std::vector<Column>& columns) {
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    Column& column = columns.emplace_back(problem.design.size(), std::vector<double>(problem.design.rows(), 0));
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (problem.target[i] != static_cast<int>(t)) continue;
      for (std::size_t row = 0; row < column[i].size(); ++row) column[i][row] = state.light_response(problem, i, row);
    }
  }
}

/// Derivatives with respect to a model's values and to the targets' ln reflectivities.
std::vector<Column> columns_of(const Problem& problem, const State& model, const Column& rows) {
  std::vector<Column> columns = jacobian(problem, model, rows);
  append_light(problem, model, columns);
  return columns;
}

/// Distance of a model from the data of another, if its values may change within the uncertainty that the campaign
/// leaves. @param data expectation of the one @param other the other model, @param rows its expectation
/// @param values_of_other columns of its values @param information on these; empty: they are fixed
ModelDistance between(const Problem& problem, const Column& data, const State& other, const Column& rows,
                      const std::vector<Column>& values_of_other, const Eigen::MatrixXd& information) {
  const RandomEffectSd& sd = other.random_sd;
  std::vector<Column> columns = {difference(data, rows)};
  if (information.size() > 0) std::ranges::copy(values_of_other, std::back_inserter(columns));
  const std::vector<Gram> grams = grams_of(problem, other, rows, columns);
  const Eigen::Index values = information.rows();
  ModelDistance result{{}, columns.front()};
  for (std::size_t i = 0; i < grams.size(); ++i) {
    double determinant = 0;
    const Gram gram = marginal(grams[i], sd, determinant);
    double square = gram(0, 0);
    if (values > 0) {
      const Eigen::VectorXd cross = gram.block(1, 0, values, 1);
      const Eigen::VectorXd moved = Eigen::MatrixXd(information + gram.block(1, 1, values, values)).ldlt().solve(cross);
      square -= cross.dot(moved);
      for (Eigen::Index k = 0; k < values; ++k) {
        const std::vector<double>& column = columns[1 + static_cast<std::size_t>(k)][i];
        for (std::size_t row = 0; row < column.size(); ++row) result.left[i][row] -= moved(k) * column[row];
      }
    }
    square = std::max(square, 0.0);
    std::vector<double> rest = result.left[i];
    const auto taken = project_out_nuisances(problem, other, i, rest);
    if (normalised_rms(problem, i, rest) < 1)  // no more than the variation of board position, camera offset and light
      square = std::min(square, std::pow(taken(0) + taken(1), 2) / (sd.jitter * sd.jitter + sd.offset * sd.offset) +
                                    std::pow(taken(2) / sd.light, 2));
    result.sigma.push_back(std::sqrt(square));
  }
  return result;
}

/// True if two questions begin with the same model.
bool begin_alike(const Question& first, const Question& second) {
  const auto same_term = [](const Term& one, const Term& other) {
    return one.candidate == other.candidate && one.values == other.values && one.maps == other.maps;
  };
  return std::ranges::equal(first.one.terms, second.one.terms, same_term) &&
         first.one.log_reflectivity == second.one.log_reflectivity &&
         (first.information_of_one.size() > 0) == (second.information_of_one.size() > 0);
}

constexpr double fixing_information = 1e6;  ///< information that fixes a value, in typical values^-2

/// State with its parameters and reflectivities moved in one linear step so that its expectation is as near to the
/// wanted one as possible. @param held index of a fixed parameter among those of all terms
State likened(const Problem& problem, State state, const Column& wanted, std::optional<std::size_t> held = {}) {
  std::vector<Observations> data = problem.data;
  for (std::size_t i = 0; i < data.size(); ++i) data[i].value = wanted[i];
  const auto rows = expected(problem, state);
  std::vector<Column> columns = jacobian(problem, state, rows);
  if (held) columns.erase(columns.begin() + static_cast<std::ptrdiff_t>(*held));
  const Eigen::VectorXd step =
      solve_linear(with_data(problem, data), state, rows, columns, problem.unknowns(columns.size())).values;
  Eigen::Index j = 0;
  std::size_t parameter = 0;
  for (Term& term : state.terms) {
    for (std::size_t k = 0; k < term.values.size(); ++k) {
      if (parameter++ == held) continue;
      const FreeParameter& p = term.candidate->free()[k];
      term.values[k] = std::clamp(term.values[k] + step(j++) * p.typical, p.minimum, p.maximum);
    }
  }
  for (double& light : state.log_reflectivity) light += step(j++);
  return state;
}

/// Questions about each amplitude of a blind effect at half its typical value.
/// @param information on the state's values, see Question
std::vector<Question> blind_questions(const Problem& problem, const State& state, const Eigen::MatrixXd& information,
                                      const Candidate& candidate) {
  std::vector<Question> questions;
  const auto rows = expected(problem, state);
  const std::vector<double> start = starts_of_nonlinear(candidate.free()).front();
  for (std::size_t k = 0; k < start.size(); ++k) {
    const FreeParameter& p = candidate.free()[k];
    if (p.nonlinear) continue;
    State with = state;
    with.terms.push_back({&candidate, start});
    with.terms.back().values[k] += settings.blind_share * p.step();
    try {
      State other = likened(problem, state, difference(rows, difference(expected(problem, with), rows)));
      other.terms.push_back(with.terms.back());
      expected(problem, other);
      questions.push_back(
          {{candidate.name()}, state, std::move(other), candidate.border().experiment, information, {}});
    } catch (const simulation::EffectError&) {
      continue;  // undefined for these boards
    }
  }
  return questions;
}

/// A model with an undetermined value fixed, and the others adapted to it.
struct Held {
  State state;
  Eigen::MatrixXd information;  ///< on its values, see information_matrix()
};

/// @throws simulation::EffectError if the effect fails at that value
Held held_at(const Problem& problem, const State& fitted, std::size_t term, std::size_t nonlinear, double value) {
  const FreeParameter& p = fitted.terms[term].candidate->free()[nonlinear];
  const std::size_t place = first_parameter(fitted, term) + nonlinear;
  State state = fitted;
  state.terms[term].values[nonlinear] = std::clamp(value, p.minimum, p.maximum);
  Held held{likened(problem, std::move(state), expected(problem, fitted), place), {}};
  held.information = information_matrix(problem, held.state);
  const auto at = static_cast<Eigen::Index>(place);
  if (held.information.size() > 0) held.information(at, at) += fixing_information;
  return held;
}

/// Question about a fitted model, at a small and a large value of its undetermined parameter.
std::optional<Question> value_question(const Problem& problem, const State& state, const EffectFinding& found) {
  const UndeterminedValue& undetermined = *found.undetermined;
  const State fitted = comparable_with(state, undetermined.state);
  const FreeParameter& p = undetermined.state.terms[undetermined.term].candidate->free()[undetermined.nonlinear];
  const std::array<double, 2> ends =
      p.minimum < 0 ? std::array{-p.typical, p.typical}
                    : std::array{p.typical / settings.undetermined_ratio, p.typical * settings.undetermined_ratio};
  try {
    Held one = held_at(problem, fitted, undetermined.term, undetermined.nonlinear, ends[0]);
    Held other = held_at(problem, fitted, undetermined.term, undetermined.nonlinear, ends[1]);
    return Question{{found.name},
                    std::move(one.state),
                    std::move(other.state),
                    found.candidate->border().experiment,
                    std::move(one.information),
                    std::move(other.information),
                    p.name};
  } catch (const simulation::EffectError&) {
    return std::nullopt;  // the effect fails at such values
  }
}

/// @param information on the state's values
Question tie_question(const Problem& problem, const State& state, const Eigen::MatrixXd& information,
                      const EffectFinding& found, const Rival& rival) {
  const State other = comparable_with(state, rival.state);
  Question question{
      {found.name, rival.candidate->name()}, state, other, rival.separating_experiment(*found.candidate), information};
  if (rival.undetermined) {  // if the parameter is free the two may be equal everywhere, so it gets its typical value
    const std::size_t term = term_of(other, *rival.candidate);
    try {
      Held held = held_at(problem, other, term, *rival.undetermined,
                          other.terms[term].candidate->free()[*rival.undetermined].typical);
      question.other = std::move(held.state);
      question.information_of_other = std::move(held.information);
      return question;
    } catch (const simulation::EffectError&) {  // the effect fails at that value: the fitted one is used
    }
  }
  question.information_of_other = information_matrix(problem, other);
  return question;
}

}  // namespace

Eigen::MatrixXd information_matrix(const Problem& problem, const State& state) {
  std::vector<bool> nonlinear;
  for (const Term& term : state.terms) {
    for (const FreeParameter& p : term.candidate->free()) nonlinear.push_back(p.nonlinear);
  }
  const auto count = static_cast<Eigen::Index>(nonlinear.size() + problem.targets.size());
  if (count == 0) return {};
  try {
    const auto rows = expected(problem, state);
    const std::vector<Column> columns = jacobian(problem, state, rows);
    const Solution solution = solve_linear(problem, state, rows, columns, problem.unknowns(columns.size()));
    Eigen::MatrixXd information = solution.covariance.topLeftCorner(count, count).inverse();
    for (std::size_t k = 0; k < nonlinear.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      if (nonlinear[k]) information(at, at) += 1 / (settings.nonlinear_prior_sd * settings.nonlinear_prior_sd);
    }
    return information;
  } catch (const simulation::EffectError&) {
    return {};
  }
}

void QuestionDistances::linearise_first(const Question& question) {
  last_ = nullptr;
  first_ = question.one;
  first_.nuisances = nuisances_;
  first_.precomputed = {};
  update_reflectivity_jacobian(problem_, first_);
  rows_ = expected(problem_, first_);
  columns_.clear();
  if (question.information_of_one.size() > 0) columns_ = columns_of(problem_, first_, rows_);
  last_ = &question;
}

ModelDistance QuestionDistances::of(const Question& question) {
  if (last_ == nullptr || !begin_alike(*last_, question)) linearise_first(question);
  const State other = comparable_with(first_, question.other);
  State one = first_;
  one.random_sd = question.one.random_sd;
  const auto rows = expected(problem_, other);
  std::vector<Column> columns;
  if (question.information_of_other.size() > 0) columns = columns_of(problem_, other, rows);
  ModelDistance nearer = between(problem_, rows_, other, rows, columns, question.information_of_other);
  ModelDistance back = between(problem_, rows, one, rows_, columns_, question.information_of_one);
  for (std::size_t i = 0; i < nearer.sigma.size(); ++i) {
    if (!(back.sigma[i] < nearer.sigma[i])) continue;
    nearer.sigma[i] = back.sigma[i];
    nearer.left[i] = std::move(back.left[i]);
  }
  return nearer;
}

// ---- Open questions of a search ----

std::vector<Question> open_questions(const Problem& problem, const State& state,
                                     const std::vector<EffectFinding>& found, const std::vector<EffectFinding>& dropped,
                                     const Audit& audit) {
  std::vector<Question> questions;
  const Eigen::MatrixXd information = information_matrix(problem, state);
  for (const EffectFinding& one : found) {
    for (const Rival& rival : one.rivals) {
      if (rival.tied && rival.is_listed_at(one.name) &&
          differ_only_by(state, rival.in_place_of, rival.state, rival.candidate->name()))
        questions.push_back(tie_question(problem, state, information, one, rival));
    }
  }
  for (const EffectFinding& one : dropped) {
    if (!one.undetermined || !differ_only_by(state, {&one.name, 1}, one.undetermined->state, one.name)) continue;
    if (std::optional<Question> question = value_question(problem, state, one))
      questions.push_back(*std::move(question));
  }
  for (const Visibility& seen : audit.effects) {
    if (!seen.blind || seen.candidate->amplitudes() == 0 || is_in(state, *seen.candidate)) continue;
    for (Question& question : blind_questions(problem, state, information, *seen.candidate))
      questions.push_back(std::move(question));
  }
  return questions;
}

}  // namespace tofgraph::diagnosis
