// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/next_condition.hpp"

#include "diagnosis/candidate.hpp"
#include "diagnosis/structure.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace tofgraph::diagnosis {
namespace {

constexpr double share_of_typical = 0.5;  ///< of an effect that these data could not have shown
/// Typical values: how far a shape is from what was fitted, at most. What is farther is not linear in it.
constexpr double usual_shape = 1;
constexpr std::size_t together = 64;  ///< conditions in memory at a time

/// Whether a change is as large as least_change, root mean square of some observable.
bool matters(const Problem& problem, std::size_t i, const std::vector<double>& change) {
  const std::size_t n = problem.design.superpixels();
  for (std::size_t o = 0; o < observables; ++o) {
    double square = 0, count = 0;
    for (std::size_t row = o * n; row < (o + 1) * n; ++row) {
      if (std::isinf(problem.data[i].variance[row])) continue;
      square += change[row] * change[row];
      ++count;
    }
    if (count > 0 && std::sqrt(square / count) >= least_change[o]) return true;
  }
  return false;
}

/// A problem's unknowns, linear about a state.
Solution solved_about(const Problem& problem, const State& state) {
  const auto rows = expected(problem, state);
  const std::vector<Column> columns = own_columns(problem, state, rows);
  std::vector<Gram> grams = grams_of(problem, rows, columns);
  std::vector<double> determinants(grams.size());
  for (std::size_t i = 0; i < grams.size(); ++i) grams[i] = marginal(grams[i], state.variances, determinants[i]);
  const Unknowns unknowns = problem.unknowns(columns.size());
  const std::vector<double> all(grams.size(), 1);
  return solve(assemble(grams, determinants, unknowns, all), unknowns, state.variances);
}

/// What the campaign tells of the values of a state's effects, in steps of their typical values, and of the targets' ln
/// reflectivities: an information matrix. Empty where an effect gives no derivative.
Eigen::MatrixXd told_of_values(const Problem& problem, const State& state) {
  std::vector<bool> shape;
  for (const Term& term : state.terms) {
    for (const FreeParameter& p : term.candidate->free()) shape.push_back(p.shape);
  }
  const auto count = static_cast<Eigen::Index>(shape.size() + problem.targets.size());
  if (count == 0) return {};
  try {
    Eigen::MatrixXd told = solved_about(problem, state).covariance.topLeftCorner(count, count).inverse();
    for (std::size_t k = 0; k < shape.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      if (shape[k]) told(at, at) += 1 / (usual_shape * usual_shape);
    }
    return told;
  } catch (const simulation::EffectError&) {
    return {};
  }
}

/// What a change of a target's ln reflectivity changes: one column a target.
void append_light(const Problem& problem, std::vector<Column>& columns) {
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    Column& column = columns.emplace_back(problem.design.size(), std::vector<double>(problem.design.rows(), 0));
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (problem.target[i] != static_cast<int>(t)) continue;
      for (std::size_t row = 0; row < column[i].size(); ++row) column[i][row] = problem.light_response(i, row);
    }
  }
}

/// A state with its parameters and reflectivities moved to make up for a change of what it expects, as far as they can.
State absorbing(const Problem& problem, const State& state, const Column& change) {
  const auto rows = expected(problem, state);
  std::vector<Observations> data = problem.data;
  for (std::size_t i = 0; i < data.size(); ++i) {
    for (std::size_t row = 0; row < rows[i].size(); ++row) data[i].value[row] = rows[i][row] - change[i][row];
  }
  const Eigen::VectorXd step = solved_about(with_data(problem, data), state).values;
  State moved = state;
  Eigen::Index j = 0;
  for (Term& term : moved.terms) {
    for (std::size_t k = 0; k < term.values.size(); ++k) {
      const FreeParameter& p = term.candidate->free()[k];
      term.values[k] = std::clamp(term.values[k] + step(j++) * p.typical, p.minimum, p.maximum);
    }
  }
  for (double& light : moved.light) light += step(j++);
  return moved;
}

/// How far two models are apart in each of a problem's conditions.
struct Apart {
  std::vector<double> sigma;
  Column left;  ///< of the difference, when the values have made up for what they can
};

/// How far the data of one model are from another, whose values may change as far as the campaign leaves them open.
/// @param told of the other one's values; empty: they stay as they are
Apart between(const Problem& lit, const State& one, const State& other, const Eigen::MatrixXd& told) {
  const auto rows = expected(lit, other);
  std::vector<Column> columns = {difference(expected(lit, one), rows)};
  if (told.size() > 0) {
    std::ranges::move(own_columns(lit, other, rows), std::back_inserter(columns));
    append_light(lit, columns);
  }
  const std::vector<Gram> grams = grams_of(lit, rows, columns);
  const Variances& sd = other.variances;
  const Eigen::Index values = told.rows();
  Apart apart{{}, columns.front()};
  for (std::size_t i = 0; i < grams.size(); ++i) {
    double determinant = 0;
    const Gram gram = marginal(grams[i], sd, determinant);
    double square = gram(0, 0);
    if (values > 0) {
      const Eigen::VectorXd cross = gram.block(1, 0, values, 1);
      const Eigen::VectorXd moved = Eigen::MatrixXd(told + gram.block(1, 1, values, values)).ldlt().solve(cross);
      square -= cross.dot(moved);
      for (Eigen::Index k = 0; k < values; ++k) {
        const std::vector<double>& column = columns[1 + static_cast<std::size_t>(k)][i];
        for (std::size_t row = 0; row < column.size(); ++row) apart.left[i][row] -= moved(k) * column[row];
      }
    }
    square = std::max(square, 0.0);
    std::vector<double> rest = apart.left[i];
    const auto taken = take_out_jitter(lit, i, rest);
    if (!matters(lit, i, rest))  // only as much as the board, the camera's offset and the light differ by
      square = std::min(square, std::pow(taken(0) + taken(1), 2) / (sd.jitter * sd.jitter + sd.offset * sd.offset) +
                                    std::pow(taken(2) / sd.light, 2));
    apart.sigma.push_back(std::sqrt(square));
  }
  return apart;
}

/// Whichever of the two is right: of each condition the one that the other comes nearer to.
Apart apart(const Problem& problem, const Question& question) {
  Problem lit = problem;
  lit.correction.clear();
  brighten(lit, question.one);
  Apart nearer = between(lit, question.one, question.other, question.told_of_other);
  Apart back = between(lit, question.other, question.one, question.told_of_one);
  for (std::size_t i = 0; i < nearer.sigma.size(); ++i) {
    if (!(back.sigma[i] < nearer.sigma[i])) continue;
    nearer.sigma[i] = back.sigma[i];
    nearer.left[i] = std::move(back.left[i]);
  }
  return nearer;
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
      const Column change = difference(expected(problem, with), rows);
      State other = absorbing(problem, state, change);
      other.terms.push_back(with.terms.back());
      expected(problem, other);
      questions.push_back({{candidate.name()}, state, std::move(other), candidate.border().experiment, told, {}});
    } catch (const simulation::EffectError&) {
      continue;  // it cannot be computed for these boards: nothing can be said of it
    }
  }
  return questions;
}

/// Whether a rival's model differs by the rival alone: nothing was dropped since it was fitted.
bool beside_the_same(const State& state, const Found& found, const Rival& rival) {
  const auto others = [](const State& of, const std::string& but) {
    std::multiset<std::string> names;
    for (const Term& term : of.terms) names.insert(term.candidate->name());
    names.erase(but);
    return names;
  };
  return others(state, found.name) == others(rival.state, rival.candidate->name());
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
                                     const Audit& audit) {
  std::vector<Question> questions;
  const Eigen::MatrixXd told = told_of_values(problem, state);
  for (const Found& one : found) {
    for (const Rival& rival : one.rivals) {
      if (rival.tied && beside_the_same(state, one, rival))
        questions.push_back({{one.name, rival.candidate->name()},
                             state,
                             rival.state,
                             one.candidate->border().experiment,
                             told,
                             told_of_values(problem, rival.state)});
    }
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
    const auto same = std::ranges::find(result, best[q].effects, &NextCondition::effects);
    if (same == result.end())
      result.push_back(std::move(best[q]));
    else if (same->sigma < best[q].sigma)
      *same = std::move(best[q]);
  }
  std::ranges::stable_sort(result, std::greater<>{},
                           [](const NextCondition& next) { return std::pair(next.effects.size(), next.sigma); });
  return result;
}

}  // namespace tofgraph::diagnosis
