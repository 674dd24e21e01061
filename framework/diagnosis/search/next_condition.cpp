// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/next_condition.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/candidate.hpp"
#include "diagnosis/model/validation.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

namespace tofgraph::diagnosis {
namespace {

constexpr std::size_t conditions_at_a_time = 64;  ///< conditions held in memory at once

/// Conditions that were not measured, as a problem with the campaign's targets.
class Unmeasured {
 public:
  Unmeasured(const Problem& campaign, std::vector<io::Condition> conditions, const NoiseLaw& noise, const State& state)
      : design_(campaign.design.camera_pointer(), campaign.design.physical(), std::move(conditions),
                campaign.design.side()),
        problem_{design_, data_, campaign.targets, {}, nuisances_of(design_)} {
    const auto& measured = campaign.design.conditions();
    for (std::size_t i = 0; i < design_.size(); ++i) {
      if (!design_.shows_board(i)) {
        problem_.target.push_back(-1);
        data_.push_back(noise.blank(design_, i, 0));
        continue;
      }
      const auto like = std::ranges::find(measured, design_.conditions()[i].target, &io::Condition::target);
      problem_.target.push_back(campaign.target[static_cast<std::size_t>(like - measured.begin())]);
      data_.push_back(noise.blank(design_, i, log_reflectivity_of(problem_, state, i)));
    }
    nuisances_.smooth_field = with_data(state.nuisances.smooth_field, data_);
  }
  Unmeasured(const Unmeasured&) = delete;
  Unmeasured& operator=(const Unmeasured&) = delete;

  const Problem& problem() const { return problem_; }
  const ConditionNuisances& nuisances() const { return nuisances_; }

 private:
  Design design_;
  std::vector<Observations> data_;
  Problem problem_;
  ConditionNuisances nuisances_;
};

std::vector<io::Condition> some(const std::vector<io::Condition>& all, std::size_t first, std::size_t count) {
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
  return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

/// Updates the best condition by the distances in all. If an effect fails in some, the others are evaluated singly.
void keep_best(QuestionDistances& distances, const Question& question, NextCondition& best) {
  const Problem& problem = distances.problem();
  const std::vector<io::Condition>& conditions = problem.design.conditions();
  const auto ask = [&](QuestionDistances& there, std::size_t first) {
    const std::vector<double> sigma = there.of(question).sigma;
    const auto most = static_cast<std::size_t>(std::ranges::max_element(sigma) - sigma.begin());
    if (!(sigma[most] > best.sigma)) return;
    best.sigma = sigma[most];
    best.condition = conditions[first + most];
  };
  try {
    ask(distances, 0);
  } catch (const simulation::EffectError&) {
    for (std::size_t i = 0; i < conditions.size(); ++i) {
      const std::vector<std::size_t> only = {i};
      const Design alone = problem.design.part(only);
      const std::vector<Observations> data = {problem.data[i]};
      try {
        const Problem one{alone, data, problem.targets, {problem.target[i]}, nuisances_of(alone)};
        const ConditionNuisances nuisances{.smooth_field = with_data(distances.nuisances().smooth_field, data)};
        QuestionDistances there(one, nuisances);
        ask(there, i);
      } catch (const simulation::EffectError&) {
        continue;
      }
    }
  }
}

/// Fills in the observable with the largest difference over the standard deviation of a superpixel, including variation
/// between conditions, after the values have compensated what they can.
void describe(const Unmeasured& condition, const Question& question, NextCondition& best) {
  const Problem& problem = condition.problem();
  const Column left = QuestionDistances(problem, condition.nuisances()).of(question).left;
  const RandomEffectSd& sd = question.one.random_sd;
  const State ideal;
  double largest = -1;
  for (std::size_t o = 0; o < observables; ++o) {
    double relative = 0, square = 0, count = 0;
    for (const std::size_t row : problem.known_rows(0, o)) {
      relative += std::pow(left[0][row], 2) /
                  (problem.data[0].variance[row] + std::pow(sd.jitter * problem.design.shift(0)[row], 2) +
                   std::pow(sd.offset * problem.offset_response(0, row), 2) +
                   std::pow(sd.light * ideal.light_response(problem, 0, row), 2));
      square += std::pow(problem.shown_scale(o, 0, row) * left[0][row], 2);
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
  return QuestionDistances(problem, question.one.nuisances).of(question).sigma;
}

bool tells(const NextCondition& next) {
  return next.sigma >= settings.min_distinction && next.difference >= settings.practical_threshold[next.observable];
}

const NextCondition* best_condition(const std::vector<NextCondition>& next) {
  const auto first = std::ranges::find_if(next, [](const NextCondition& one) {
    return tells(one) && one.sigma > settings.min_distinction_gain * one.measured_sigma;
  });
  return first == next.end() ? nullptr : &*first;
}

std::vector<NextCondition> next_conditions(const Problem& problem, const std::vector<Question>& all) {
  std::vector<NextCondition> result;
  std::vector<Question> questions;
  std::vector<double> measured;
  if (all.empty()) return result;
  QuestionDistances in_campaign(problem, all.front().one.nuisances);
  for (const Question& q : all) {
    try {
      measured.push_back(std::ranges::max(in_campaign.of(q).sigma));
      questions.push_back(q);
    } catch (const simulation::EffectError&) {
      continue;  // undefined for these boards
    }
  }
  if (questions.empty()) return result;
  const State& state = questions.front().one;
  const NoiseLaw noise(problem, state.log_reflectivity);
  const std::vector<io::Condition> list = candidate_conditions(problem, state.log_reflectivity);
  std::vector<NextCondition> best;
  for (std::size_t q = 0; q < questions.size(); ++q)
    best.push_back({.effects = questions[q].effects,
                    .value = questions[q].value,
                    .condition = {},
                    .measured_sigma = measured[q],
                    .candidates = list.size(),
                    .experiment = questions[q].experiment});
  for (std::size_t first = 0; first < list.size(); first += conditions_at_a_time) {
    const std::size_t count = std::min(conditions_at_a_time, list.size() - first);
    const Unmeasured part(problem, some(list, first, count), noise, state);
    QuestionDistances distances(part.problem(), part.nuisances());
    for (std::size_t q = 0; q < questions.size(); ++q) keep_best(distances, questions[q], best[q]);
  }
  // For an effect with several amplitudes the most visible one counts.
  for (std::size_t q = 0; q < best.size(); ++q) {
    if (!(best[q].sigma > 0)) continue;
    const Unmeasured one(problem, {best[q].condition}, noise, state);
    describe(one, questions[q], best[q]);
    best[q].reflectivity =
        pose_of(best[q].condition).reflectivity * std::exp(log_reflectivity_of(one.problem(), state, 0));
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
