// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/next_condition.hpp"

#include "diagnosis/apart.hpp"
#include "diagnosis/candidate.hpp"
#include "diagnosis/structure.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <tuple>

namespace tofgraph::diagnosis {
namespace {

constexpr double share_of_typical = 0.5;  ///< of an effect that these data could not have shown
constexpr double usual_ratio = 3;         ///< of values that are not told, to their typical ones
constexpr double held = 1e6;  ///< one over the variance of a value that is asked for, in its typical ones: it stays
constexpr std::size_t together = 64;  ///< conditions in memory at a time

/// A state with its parameters and reflectivities moved so that it expects what is wanted, as nearly as they can, in a
/// linear step. @param held a parameter that stays, at its place among those of all terms
State likened(const Problem& problem, State state, const Column& wanted, std::optional<std::size_t> held = {}) {
  std::vector<Observations> data = problem.data;
  for (std::size_t i = 0; i < data.size(); ++i) data[i].value = wanted[i];
  const auto rows = expected(problem, state);
  std::vector<Column> columns = own_columns(problem, state, rows);
  if (held) columns.erase(columns.begin() + static_cast<std::ptrdiff_t>(*held));
  const Eigen::VectorXd step =
      least_squares(with_data(problem, data), rows, columns, problem.unknowns(columns.size()), state.variances).values;
  Eigen::Index j = 0;
  std::size_t parameter = 0;
  for (Term& term : state.terms) {
    for (std::size_t k = 0; k < term.values.size(); ++k) {
      if (parameter++ == held) continue;
      const FreeParameter& p = term.candidate->free()[k];
      term.values[k] = std::clamp(term.values[k] + step(j++) * p.typical, p.minimum, p.maximum);
    }
  }
  for (double& light : state.light) light += step(j++);
  return state;
}

/// One for each size of an effect at half its typical value.
/// @param told of the state's values, see Question
std::vector<Question> blind_questions(const Problem& problem, const State& state, const Eigen::MatrixXd& told,
                                      const Candidate& candidate) {
  std::vector<Question> questions;
  const auto rows = expected(problem, state);
  const std::vector<double> start = probes_of(candidate.free()).front();
  for (std::size_t k = 0; k < start.size(); ++k) {
    const FreeParameter& p = candidate.free()[k];
    if (p.shape) continue;
    State with = state;
    with.terms.push_back({&candidate, start});
    with.terms.back().values[k] += share_of_typical * p.step();
    try {
      State other = likened(problem, state, difference(rows, difference(expected(problem, with), rows)));
      other.terms.push_back(with.terms.back());
      expected(problem, other);
      questions.push_back({{candidate.name()}, state, std::move(other), candidate.border().experiment, told, {}});
    } catch (const simulation::EffectError&) {
      continue;  // it cannot be computed for these boards: nothing can be said of it
    }
  }
  return questions;
}

/// Whether two models differ by an effect of each alone: nothing was dropped since they were fitted.
bool beside_the_same(const State& state, const std::string& effect, const State& other, const std::string& its) {
  const auto others = [](const State& of, const std::string& but) {
    std::multiset<std::string> names;
    for (const Term& term : of.terms) names.insert(term.candidate->name());
    names.erase(but);
    return names;
  };
  return others(state, effect) == others(other, its);
}

/// A model that fits, at a small and a large value of what it does not tell, each with the others that suit.
std::optional<Question> value_question(const Problem& problem, const Found& found) {
  const auto& [fitted, shape] = *found.untold;
  std::size_t term = 0, k = shape;
  while (k >= fitted.terms[term].values.size()) k -= fitted.terms[term++].values.size();
  const FreeParameter& p = fitted.terms[term].candidate->free()[k];
  const std::array<double, 2> ends =
      p.minimum < 0 ? std::array{-p.typical, p.typical} : std::array{p.typical / usual_ratio, p.typical * usual_ratio};
  try {
    const Column wanted = expected(problem, fitted);
    const auto at = [&](double value) {
      State state = fitted;
      state.terms[term].values[k] = std::clamp(value, p.minimum, p.maximum);
      return likened(problem, std::move(state), wanted, shape);
    };
    Question question{{found.name}, at(ends[0]), at(ends[1]), found.candidate->border().experiment};
    question.told_of_one = told_of_values(problem, question.one);
    question.told_of_other = told_of_values(problem, question.other);
    const auto same = static_cast<Eigen::Index>(shape);
    for (Eigen::MatrixXd* told : {&question.told_of_one, &question.told_of_other}) {
      if (told->size() > 0) (*told)(same, same) += held;
    }
    question.value = p.name;
    return question;
  } catch (const simulation::EffectError&) {
    return std::nullopt;  // it gives no number for such values
  }
}

/// Conditions that were not measured, as a problem with the campaign's targets.
class Unmeasured {
 public:
  Unmeasured(const Problem& campaign, std::vector<io::Condition> conditions, const NoiseLaw& noise, const State& state)
      : design_(campaign.design.camera_pointer(), campaign.design.physical(), std::move(conditions),
                campaign.design.superpixels() > 1 ? grid : single),
        problem_{design_, data_, campaign.targets, {}, nuisances_of(design_)} {
    const auto& measured = campaign.design.conditions();
    for (std::size_t i = 0; i < design_.size(); ++i) {
      if (!design_.shows_board(i)) {
        problem_.target.push_back(-1);
        data_.push_back(noise.blank(design_, i, 0));
        continue;
      }
      const auto like = std::ranges::find(measured, design_.conditions()[i].target, &io::Condition::target);
      const int target = campaign.target[static_cast<std::size_t>(like - measured.begin())];
      problem_.target.push_back(target);
      data_.push_back(noise.blank(design_, i, target < 0 ? 0 : state.light[static_cast<std::size_t>(target)]));
    }
    if (campaign.allowed.residue)
      problem_.allowed.residue = std::make_shared<const Residue>(Residue(data_), campaign.allowed.residue->sd());
  }
  Unmeasured(const Unmeasured&) = delete;
  Unmeasured& operator=(const Unmeasured&) = delete;

  const Problem& problem() const { return problem_; }

 private:
  Design design_;
  std::vector<Observations> data_;
  Problem problem_;
};

std::vector<io::Condition> some(const std::vector<io::Condition>& all, std::size_t first, std::size_t count) {
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
  return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

/// Where an effect gives no number for some of the conditions, the others are asked one by one.
void keep_best(const Problem& problem, const Question& question, NextCondition& best) {
  const std::vector<io::Condition>& conditions = problem.design.conditions();
  const auto ask = [&](const Problem& of, std::size_t first) {
    const std::vector<double> sigma = differences_in_sigma(of, question);
    const auto most = static_cast<std::size_t>(std::ranges::max_element(sigma) - sigma.begin());
    if (!(sigma[most] > best.sigma)) return;
    best.sigma = sigma[most];
    best.condition = conditions[first + most];
  };
  try {
    ask(problem, 0);
  } catch (const simulation::EffectError&) {
    for (std::size_t i = 0; i < conditions.size(); ++i) {
      const std::vector<std::size_t> only = {i};
      const Design alone = problem.design.part(only);
      const std::vector<Observations> data = {problem.data[i]};
      try {
        Problem one{alone, data, problem.targets, {problem.target[i]}, nuisances_of(alone)};
        if (const Residue* residue = problem.allowed.residue.get(); residue != nullptr)
          one.allowed.residue = std::make_shared<const Residue>(Residue(data), residue->sd());
        ask(one, i);
      } catch (const simulation::EffectError&) {
        continue;
      }
    }
  }
}

/// The observable that differs most in standard deviations of a superpixel, what conditions differ by included, when
/// the values have made up for what they can.
void describe(const Problem& problem, const Question& question, NextCondition& best) {
  const Column left = apart(problem, question).left;
  const Variances& sd = question.one.variances;
  const std::size_t n = problem.design.superpixels();
  double largest = -1;
  for (std::size_t o = 0; o < observables; ++o) {
    double relative = 0, square = 0, count = 0;
    for (std::size_t row = o * n; row < (o + 1) * n; ++row) {
      const double variance = problem.data[0].variance[row];
      if (std::isinf(variance)) continue;
      relative += std::pow(left[0][row], 2) / (variance + std::pow(sd.jitter * problem.design.shift(0)[row], 2) +
                                               std::pow(sd.offset * problem.offset_response(0, row), 2) +
                                               std::pow(sd.light * problem.light_response(0, row), 2));
      // Half paths become depths.
      const double scale = o == distance && problem.design.shows_board(0) ? 1 / problem.design.shift(0)[row] : 1;
      square += std::pow(scale * left[0][row], 2);
      ++count;
    }
    if (count == 0 || relative / count <= largest) continue;
    largest = relative / count;
    best.observable = o;
    best.difference = std::sqrt(square / count);
  }
}

}  // namespace

std::vector<double> differences_in_sigma(const Problem& problem, const Question& question) {
  return apart(problem, question).sigma;
}

bool tells(const NextCondition& next) {
  return next.sigma >= telling && next.difference >= least_change[next.observable];
}

const NextCondition* most_telling(const std::vector<NextCondition>& next) {
  constexpr double more = 1.1;  // what tells as much as a condition that is there is no reason to go back to the rail
  const auto first = std::ranges::find_if(
      next, [](const NextCondition& one) { return tells(one) && one.sigma > more * one.measured_sigma; });
  return first == next.end() ? nullptr : &*first;
}

std::vector<Question> open_questions(const Problem& problem, const State& state, const std::vector<Found>& found,
                                     const std::vector<Found>& dropped, const Audit& audit) {
  std::vector<Question> questions;
  const Eigen::MatrixXd told = told_of_values(problem, state);
  for (const Found& one : found) {
    for (const Rival& rival : one.rivals) {
      if (rival.tied && beside_the_same(state, one.name, rival.state, rival.candidate->name()))
        questions.push_back({{one.name, rival.candidate->name()},
                             state,
                             rival.state,
                             one.candidate->border().experiment,
                             told,
                             told_of_values(problem, rival.state)});
    }
  }
  for (const Found& one : dropped) {
    if (!one.untold || !beside_the_same(state, one.name, one.untold->state, one.name)) continue;
    if (std::optional<Question> question = value_question(problem, one)) questions.push_back(*std::move(question));
  }
  for (const Visibility& seen : audit.effects) {
    if (!seen.blind || seen.candidate->sizes() == 0) continue;
    const bool in_model =
        std::ranges::any_of(state.terms, [&](const Term& t) { return t.candidate->name() == seen.candidate->name(); });
    if (in_model) continue;
    for (Question& question : blind_questions(problem, state, told, *seen.candidate))
      questions.push_back(std::move(question));
  }
  return questions;
}

std::vector<NextCondition> next_conditions(const Problem& problem, const std::vector<Question>& all) {
  std::vector<NextCondition> result;
  std::vector<Question> questions;
  std::vector<double> measured;
  for (const Question& q : all) {
    try {
      measured.push_back(std::ranges::max(differences_in_sigma(problem, q)));
      questions.push_back(q);
    } catch (const simulation::EffectError&) {
      continue;  // it cannot be computed for these boards: nothing can be said of it
    }
  }
  if (questions.empty()) return result;
  const State& state = questions.front().one;
  const NoiseLaw noise(problem, state.light);
  const std::vector<io::Condition> list = candidate_conditions(problem, state.light);
  std::vector<NextCondition> best;
  for (std::size_t q = 0; q < questions.size(); ++q)
    best.push_back({.effects = questions[q].effects,
                    .value = questions[q].value,
                    .condition = {},
                    .measured_sigma = measured[q],
                    .candidates = list.size(),
                    .experiment = questions[q].experiment});
  for (std::size_t first = 0; first < list.size(); first += together) {
    const std::size_t count = std::min(together, list.size() - first);
    const Unmeasured part(problem, some(list, first, count), noise, state);
    for (std::size_t q = 0; q < questions.size(); ++q) keep_best(part.problem(), questions[q], best[q]);
  }
  // Of an effect with several sizes the one that shows best.
  for (std::size_t q = 0; q < best.size(); ++q) {
    if (!(best[q].sigma > 0)) continue;
    const Unmeasured one(problem, {best[q].condition}, noise, state);
    describe(one.problem(), questions[q], best[q]);
    const int target = one.problem().target.front();
    best[q].reflectivity = pose_of(best[q].condition).reflectivity *
                           std::exp(target < 0 ? 0 : state.light[static_cast<std::size_t>(target)]);
    const auto same = std::ranges::find_if(result, [&](const NextCondition& next) {
      return next.effects == best[q].effects && next.value == best[q].value;
    });
    if (same == result.end())
      result.push_back(std::move(best[q]));
    else if (same->sigma < best[q].sigma)
      *same = std::move(best[q]);
  }
  std::ranges::stable_sort(result, std::greater<>{}, [](const NextCondition& next) {
    return std::tuple(next.effects.size(), !next.value.empty(), next.sigma);
  });
  return result;
}

}  // namespace tofgraph::diagnosis
