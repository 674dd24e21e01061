// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/next_condition.hpp"

#include "diagnosis/apart.hpp"
#include "diagnosis/candidate.hpp"
#include "diagnosis/structure.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

namespace tofgraph::diagnosis {
namespace {

constexpr std::size_t conditions_at_a_time = 64;  ///< conditions in memory at a time

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

/// The model that a question begins with, in some conditions: most of those that come one after the other begin with
/// the same.
class FirstModel {
 public:
  explicit FirstModel(const Problem& problem) : problem_(problem) {}
  const Problem& problem() const { return problem_; }

  /// @throws simulation::EffectError
  const InLightOfOne& of(const Question& question) {
    if (!lit_ || !begin_alike(*last_, question)) {
      lit_.reset();
      lit_.emplace(in_light_of_one(problem_, question));
      last_ = &question;
    }
    return *lit_;
  }

 private:
  const Problem& problem_;
  const Question* last_ = nullptr;
  std::optional<InLightOfOne> lit_;
};

/// Where an effect gives no number for some of the conditions, the others are asked one by one.
void keep_best(FirstModel& first_model, const Question& question, NextCondition& best) {
  const Problem& problem = first_model.problem();
  const std::vector<io::Condition>& conditions = problem.design.conditions();
  const auto ask = [&](FirstModel& model, std::size_t first) {
    const std::vector<double> sigma = apart(model.of(question), question).sigma;
    const auto most = static_cast<std::size_t>(std::ranges::max_element(sigma) - sigma.begin());
    if (!(sigma[most] > best.sigma)) return;
    best.sigma = sigma[most];
    best.condition = conditions[first + most];
  };
  try {
    ask(first_model, 0);
  } catch (const simulation::EffectError&) {
    for (std::size_t i = 0; i < conditions.size(); ++i) {
      const std::vector<std::size_t> only = {i};
      const Design alone = problem.design.part(only);
      const std::vector<Observations> data = {problem.data[i]};
      try {
        Problem one{alone, data, problem.targets, {problem.target[i]}, nuisances_of(alone)};
        if (const Residue* residue = problem.allowed.residue.get(); residue != nullptr)
          one.allowed.residue = std::make_shared<const Residue>(Residue(data), residue->sd());
        FirstModel alone_there(one);
        ask(alone_there, i);
      } catch (const simulation::EffectError&) {
        continue;
      }
    }
  }
}

/// The observable that differs most in standard deviations of a superpixel, what conditions differ by included, when
/// the values have made up for what they can.
void describe(const Problem& problem, const Question& question, NextCondition& best) {
  const Column left = apart(in_light_of_one(problem, question), question).left;
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
  return apart(in_light_of_one(problem, question), question).sigma;
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

std::vector<NextCondition> next_conditions(const Problem& problem, const std::vector<Question>& all) {
  std::vector<NextCondition> result;
  std::vector<Question> questions;
  std::vector<double> measured;
  FirstModel in_campaign(problem);
  for (const Question& q : all) {
    try {
      measured.push_back(std::ranges::max(apart(in_campaign.of(q), q).sigma));
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
  for (std::size_t first = 0; first < list.size(); first += conditions_at_a_time) {
    const std::size_t count = std::min(conditions_at_a_time, list.size() - first);
    const Unmeasured part(problem, some(list, first, count), noise, state);
    FirstModel first_model(part.problem());
    for (std::size_t q = 0; q < questions.size(); ++q) keep_best(first_model, questions[q], best[q]);
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
