// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// What a search leaves open: pairs of models that both fit.
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/candidate.hpp"
#include "diagnosis/search/discrimination.hpp"

#include <algorithm>
#include <array>
#include <optional>

namespace tofgraph::diagnosis {
namespace {

constexpr double stays = 1e6;  ///< one over the variance of a value that is asked for, in its typical ones

/// A state with its parameters and reflectivities moved so that it expects what is wanted, as nearly as they can, in a
/// linear step. @param held a parameter that stays, at its place among those of all terms
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

/// States for each amplitude of an effect at half its typical value.
/// @param told of the state's values, see Question
std::vector<Question> blind_questions(const Problem& problem, const State& state, const Eigen::MatrixXd& information,
                                      const Candidate& candidate) {
  std::vector<Question> questions;
  const auto rows = expected(problem, state);
  const std::vector<double> start = probes_of(candidate.free()).front();
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
      continue;  // it cannot be computed for these boards: nothing can be said of it
    }
  }
  return questions;
}

/// A model with a value that these data do not tell, and the others that suit it; that one stays.
struct Held {
  State state;
  Eigen::MatrixXd information;  ///< of its values, see information_matrix()
};

/// @throws simulation::EffectError when it gives no number for that value
Held held_at(const Problem& problem, const State& fitted, std::size_t term, std::size_t nonlinear, double value) {
  const FreeParameter& p = fitted.terms[term].candidate->free()[nonlinear];
  const std::size_t place = first_parameter(fitted, term) + nonlinear;
  State state = fitted;
  state.terms[term].values[nonlinear] = std::clamp(value, p.minimum, p.maximum);
  Held held{likened(problem, std::move(state), expected(problem, fitted), place), {}};
  held.information = information_matrix(problem, held.state);
  const auto at = static_cast<Eigen::Index>(place);
  if (held.information.size() > 0) held.information(at, at) += stays;
  return held;
}

/// A model that fits, at a small and a large value of what it does not tell.
std::optional<Question> value_question(const Problem& problem, const State& state, const EffectFinding& found) {
  const Untold& untold = *found.untold;
  const State fitted = beside(state, untold.state);
  const FreeParameter& p = untold.state.terms[untold.term].candidate->free()[untold.nonlinear];
  const std::array<double, 2> ends =
      p.minimum < 0 ? std::array{-p.typical, p.typical}
                    : std::array{p.typical / settings.undetermined_ratio, p.typical * settings.undetermined_ratio};
  try {
    Held one = held_at(problem, fitted, untold.term, untold.nonlinear, ends[0]);
    Held other = held_at(problem, fitted, untold.term, untold.nonlinear, ends[1]);
    return Question{{found.name},
                    std::move(one.state),
                    std::move(other.state),
                    found.candidate->border().experiment,
                    std::move(one.information),
                    std::move(other.information),
                    p.name};
  } catch (const simulation::EffectError&) {
    return std::nullopt;  // it gives no number for such values
  }
}

/// @param told of the state's values
Question tie_question(const Problem& problem, const State& state, const Eigen::MatrixXd& information,
                      const EffectFinding& found, const Rival& rival) {
  const State other = beside(state, rival.state);
  Question question{{found.name, rival.candidate->name()},
                    state,
                    other,
                    (rival.of_several() ? rival.candidate : found.candidate)->border().experiment,
                    information};
  if (rival.untold) {  // with anything the two may be the same everywhere: with its typical value
    const auto term =
        std::ranges::find(other.terms, rival.candidate->name(), [](const Term& one) { return one.candidate->name(); });
    try {
      Held held = held_at(problem, other, static_cast<std::size_t>(term - other.terms.begin()), *rival.untold,
                          term->candidate->free()[*rival.untold].typical);
      question.other = std::move(held.state);
      question.information_of_other = std::move(held.information);
      return question;
    } catch (const simulation::EffectError&) {  // it gives no number for that: as it was fitted
    }
  }
  question.information_of_other = information_matrix(problem, other);
  return question;
}

}  // namespace

std::vector<Question> open_questions(const Problem& problem, const State& state,
                                     const std::vector<EffectFinding>& found, const std::vector<EffectFinding>& dropped,
                                     const Audit& audit) {
  std::vector<Question> questions;
  const Eigen::MatrixXd information = information_matrix(problem, state);
  for (const EffectFinding& one : found) {
    for (const Rival& rival : one.rivals) {
      if (rival.tied && rival.is_told_at(one.name) &&
          beside_the_same(state, rival.in_place_of, rival.state, rival.candidate->name()))
        questions.push_back(tie_question(problem, state, information, one, rival));
    }
  }
  for (const EffectFinding& one : dropped) {
    if (!one.untold || !beside_the_same(state, {&one.name, 1}, one.untold->state, one.name)) continue;
    if (std::optional<Question> question = value_question(problem, state, one))
      questions.push_back(*std::move(question));
  }
  for (const Visibility& seen : audit.effects) {
    if (!seen.blind || seen.candidate->amplitudes() == 0) continue;
    const bool in_model =
        std::ranges::any_of(state.terms, [&](const Term& t) { return t.candidate->name() == seen.candidate->name(); });
    if (in_model) continue;
    for (Question& question : blind_questions(problem, state, information, *seen.candidate))
      questions.push_back(std::move(question));
  }
  return questions;
}

}  // namespace tofgraph::diagnosis
