// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/crossfit.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/board_nuisances.hpp"
#include "diagnosis/model/nuisances.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <span>
#include <type_traits>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Conditions by level, in the order of the levels.
using Levels = std::vector<std::pair<std::string, std::vector<std::size_t>>>;

class Folds {
 public:
  explicit Folds(const Design& design) : design_(design) {}

  std::vector<Fold> singly() {
    one_by_one(each_distance, distances());
    one_by_one(each_target, targets());
    return std::move(folds_);
  }

  std::vector<Fold> halves(std::size_t count, std::uint64_t seed) {
    const std::vector<std::size_t> cluster = clusters_of(design_);
    Levels levels(1 + std::ranges::max(cluster));
    for (std::size_t i = 0; i < cluster.size(); ++i) {
      const io::Condition& c = design_.conditions()[i];
      if (!design_.shows_board(i)) continue;
      levels[cluster[i]].first = fmt::format("{:.4g} m", c.board_distance) + (c.session.empty() ? "" : " " + c.session);
      levels[cluster[i]].second.push_back(i);
    }
    std::erase_if(levels, [](const auto& level) { return level.second.empty(); });
    std::vector<std::size_t> order(levels.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::mt19937_64 random(seed);
    for (std::size_t h = 0; h < count; ++h) {
      // Not std::shuffle, whose result differs between standard libraries.
      for (std::size_t k = order.size() - 1; k > 0; --k) std::swap(order[k], order[random() % (k + 1)]);
      add(any_half, levels, std::span(order).first(order.size() / 2), false);
    }
    return std::move(folds_);
  }

  std::vector<Fold> all() {
    ordered("distance", distances());
    if (folds_.empty()) ordered("integration time", levels_of(&io::Condition::integration_time, "ms", 1e3));
    each("target", targets());
    each("session", levels_of(&io::Condition::session));
    return std::move(folds_);
  }

 private:
  /// @param unit of numbers, SI over scale
  template <class T> Levels levels_of(T io::Condition::*setting, const char* unit = "", double scale = 1) const {
    std::map<T, std::vector<std::size_t>> by_value;
    for (std::size_t i = 0; i < design_.size(); ++i) {
      if (design_.shows_board(i)) by_value[design_.conditions()[i].*setting].push_back(i);  // a capped lens has none
    }
    Levels levels;
    for (auto& [value, conditions] : by_value) {
      if constexpr (std::is_same_v<T, double>)
        levels.emplace_back(fmt::format("{:.4g} {}", scale * value, unit), std::move(conditions));
      else
        levels.emplace_back(value, std::move(conditions));
    }
    return levels;
  }
  Levels distances() const { return levels_of(&io::Condition::board_distance, "m"); }
  Levels targets() const { return levels_of(&io::Condition::target); }

  void one_by_one(const std::string& setting, const Levels& levels) {
    for (std::size_t k = 0; k < levels.size() && levels.size() > 1; ++k) add(setting, levels, std::span(&k, 1), false);
  }

  void add(const std::string& setting, const Levels& levels, std::span<const std::size_t> chosen, bool extrapolates) {
    Fold fold{setting, "", {}, extrapolates};
    std::vector<std::string> names;
    for (const std::size_t level : chosen) {
      names.push_back(levels[level].first);
      std::ranges::copy(levels[level].second, std::back_inserter(fold.held));
    }
    std::ranges::sort(fold.held);
    fold.levels = fmt::format("{}", fmt::join(names, ", "));
    const std::size_t left = design_.boards() - fold.held.size();
    // A few conditions of other sessions cannot predict a campaign that was joined with them.
    const double needed =
        setting == "session" ? settings.min_left_by_session * static_cast<double>(design_.boards()) : 0;
    if (left >= settings.min_conditions && static_cast<double>(left) >= needed) folds_.push_back(std::move(fold));
  }

  void ordered(const std::string& setting, const Levels& levels) {
    if (levels.size() < settings.min_levels) return;
    const auto ends = static_cast<std::size_t>(std::ceil(settings.end_share * static_cast<double>(levels.size())));
    std::vector<std::size_t> nearest, farthest;
    for (std::size_t k = 0; k < ends; ++k) {
      nearest.push_back(k);
      farthest.insert(farthest.begin(), levels.size() - 1 - k);
    }
    add(setting, levels, nearest, true);
    const std::size_t inner = levels.size() - 2 * ends, groups = std::min(settings.interleaved_groups, inner);
    for (std::size_t g = 0; g < groups; ++g) {
      std::vector<std::size_t> chosen;
      for (std::size_t k = ends + g; k < levels.size() - ends; k += groups) chosen.push_back(k);
      add(setting, levels, chosen, false);
    }
    add(setting, levels, farthest, true);
  }

  void each(const std::string& setting, const Levels& levels) {
    if (levels.size() < 2) return;
    const std::size_t groups = std::min(settings.min_levels, levels.size());
    for (std::size_t g = 0; g < groups; ++g) {
      std::vector<std::size_t> chosen;
      for (std::size_t k = g; k < levels.size(); k += groups) chosen.push_back(k);
      add(setting, levels, chosen, false);
    }
  }

  const Design& design_;
  std::vector<Fold> folds_;
};

double square_of(const Gram& gram, Eigen::Index column, const RandomEffectSd& random_sd) {
  double determinant = 0;
  return marginal(gram, random_sd, determinant)(column, column);
}

double root_mean(double sum, double count) { return count > 0 ? std::sqrt(sum / count) : NAN; }

/// Problem whose targets are those of another one, in their order, followed by new ones.
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

}  // namespace

std::vector<Fold> folds_of(const Design& design) { return Folds(design).all(); }
std::vector<Fold> single_levels(const Design& design) { return Folds(design).singly(); }
std::vector<Fold> random_halves(const Design& design, std::size_t count, std::uint64_t seed) {
  return Folds(design).halves(count, seed);
}

std::vector<std::size_t> clusters_of(const Design& design) {
  std::map<std::pair<double, std::string>, std::size_t> known;
  std::vector<std::size_t> together, single;
  for (const io::Condition& c : design.conditions()) {
    const double where = c.is_capped() ? 0 : c.board_distance;
    together.push_back(known.try_emplace({where, c.session}, known.size()).first->second);
    single.push_back(single.size());
  }
  return known.size() < settings.min_clusters ? single : together;
}

void GapSums::add(const OutOfFold& one, std::size_t observable) {
  before += one.before[observable], after += one.after[observable], count += one.count[observable];
}

void GapSums::add(std::span<const OutOfFold> conditions) {
  for (const OutOfFold& one : conditions) add(one, distance);
}

HeldOutGap GapSums::gap() const { return {root_mean(before, count), root_mean(after, count)}; }

Prediction::Prediction(const FoldProblem& held, const Fold& fold) : held_(held) {
  for (const std::size_t i : fold.held) conditions_.push_back({.condition = i});
}

void Prediction::before(const State& state) {
  const auto rows = predict(state);
  for (std::size_t i = 0; i < conditions_.size(); ++i) conditions_[i].before = summed(rows[i], i);
  // Misplaced boards are found with the given model, so that no tested model can reduce their weight.
  there_.nuisances.jitter_scale = jitter_scale_of(board_offsets_of(held_.problem, carried(state)));
}

void Prediction::after(const State& state, std::shared_ptr<const SmoothField> smooth_field) {
  there_.nuisances.smooth_field = std::move(smooth_field);
  after_ = predict(state);
  random_sd_ = state.random_sd;
  const std::vector<Gram> grams = grams_of(held_.problem, there_, with_nuisances(held_.problem, there_, after_), {});
  for (std::size_t i = 0; i < after_.size(); ++i) {
    OutOfFold& one = conditions_[i];
    one.after = summed(after_[i], i);
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
                                      square_of(grams[i], 0, random_sd_), summed(rows[i], i)[distance],
                                      summed(rows_of_rest[i], i)[distance]};
  }
}

/// Fitted state transferred to the held-out conditions: reflectivities of new targets are estimated from amplitudes,
/// never from distances.
State Prediction::carried(const State& state) const {
  const Problem& to = held_.problem;
  State result = comparable_with(there_, state);
  result.log_reflectivity.resize(to.targets.size(), 0);
  if (result.log_reflectivity.size() == state.log_reflectivity.size()) return result;
  constexpr int rounds = 3;  // repeated because light that is not the board's responds differently
  for (int round = 0; round < rounds; ++round) {
    const auto rows = expected(to, result);
    for (std::size_t t = state.log_reflectivity.size(); t < to.targets.size(); ++t)
      result.log_reflectivity[t] += mean_log_amplitude(to, t, rows);
  }
  return result;
}

Rows Prediction::predict(const State& state) {
  there_ = carried(state);
  update_precomputed(held_.problem, there_);
  return expected(held_.problem, there_);
}

/// Sums of squares of a condition; sets its count.
std::array<double, observables> Prediction::summed(const std::vector<double>& rows, std::size_t i) {
  std::array<double, observables> squares{};
  conditions_[i].count = {};
  if (!held_.design.shows_board(i)) return squares;  // a capped lens has no gap
  for (std::size_t o = 0; o < observables; ++o) {
    for (const std::size_t row : held_.problem.known_rows(i, o)) {
      squares[o] += std::pow(held_.problem.shown_scale(o, i, row) * (held_.data[i].value[row] - rows[row]), 2);
      ++conditions_[i].count[o];
    }
  }
  return squares;
}

Prediction predicted(FoldProblem& held, const Fold& fold, const State& given, const State& model,
                     std::optional<double> log_lower) {
  Prediction prediction(held, fold);
  prediction.before(given);
  if (log_lower) held.fix_contrast(*log_lower);
  prediction.after(model, with_data(model.nuisances.smooth_field, held.data));
  return prediction;
}

std::vector<std::size_t> left_by(const Fold& fold, std::size_t conditions) {
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < conditions; ++i) {
    if (!std::ranges::binary_search(fold.held, i)) left.push_back(i);
  }
  return left;
}

FoldProblem::FoldProblem(const Design& whole, const std::vector<Observations>& all,
                         const std::vector<std::size_t>& chosen, const Deadline* deadline)
    : design(whole.part(chosen)), data(picked(all, chosen)), problem(make_problem(design, data, deadline)) {
  problem.left_out = {fmt::format("{} that are held out", all.size() - chosen.size())};
}

FoldProblem::FoldProblem(const Design& whole, const std::vector<Observations>& all,
                         const std::vector<std::size_t>& chosen, const Problem& other)
    : design(whole.part(chosen)), data(picked(all, chosen)), problem(problem_like(other, design, data)) {}

void FoldProblem::fix_contrast(double log_lower) {
  const std::size_t n = design.superpixels();
  for (std::size_t i = 0; i < data.size(); ++i) {
    for (std::size_t row = intensity * n; design.shows_board(i) && row < (intensity + 1) * n; ++row)
      data[i].value[row] -= log_lower;
  }
  problem.nuisances = nuisances_of(design);
}

}  // namespace tofgraph::diagnosis
