// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search.hpp"

#include "diagnosis/structure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace tofgraph::diagnosis {
namespace {

constexpr double significance = 0.005;  ///< of the largest score of all
constexpr double worth = 10;            ///< least fall of BIC for an effect more
constexpr double tie_limit = 10;        ///< of deviance or BIC
constexpr std::size_t shortlist = 6;    ///< candidates that are fitted
constexpr double few = 8;               ///< conditions: fewer cannot be judged by sign flips alone,
constexpr double certain = 60;          ///< but by a gain like this
constexpr std::size_t most_rounds = 3;  ///< of swapping

/// A candidate with shapes at which its sizes were scored.
struct Probe {
  const Candidate* candidate;
  std::vector<double> values;
};

class Search {
 public:
  Search(const Problem& problem, const std::vector<Term>& model,
         const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options)
      : problem_(problem),
        model_(model),
        candidates_(candidates),
        options_(options),
        weight_(problem.data.size(), 1.0) {}

  SearchResult run() {
    say("fitting the model as it is");
    State start{model_, start_light(), {}};
    if (!model_.empty()) correct(problem_, start);
    result_.before = fit(problem_, start, weight_);
    best_ = result_.before;
    look_where();
    // What is dropped may be tried again, so the rounds are counted, not the effects alone.
    for (std::size_t round = 0; round < 2 * options_.most_effects; ++round) {
      if (best_.state.terms.size() == model_.size() + options_.most_effects || !add()) break;
      exchange();
    }
    describe_found();
    look_at_rest();
    result_.after = best_;
    result_.correction = std::move(problem_.correction);
    return std::move(result_);
  }

 private:
  void say(const std::string& what) const {
    if (options_.progress) options_.progress(what);
  }
  double conditions_log() const { return std::log(static_cast<double>(problem_.data.size())); }
  double bic(const Fit& fit) const { return fit.bic(problem_.data.size()); }

  /// Reflectivities from the mean of ln amplitude, so that effects of the amount of light start at the right amount.
  std::vector<double> start_light() const {
    std::vector<double> sum(problem_.targets.size(), 0), count(problem_.targets.size(), 0);
    const std::size_t n = problem_.design.superpixels();
    for (std::size_t i = 0; i < problem_.data.size(); ++i) {
      if (problem_.target[i] < 0) continue;
      const auto t = static_cast<std::size_t>(problem_.target[i]);
      for (std::size_t row = amplitude * n; row < (amplitude + 1) * n; ++row) {
        if (std::isinf(problem_.data[i].variance[row])) continue;
        sum[t] += problem_.data[i].value[row];
        ++count[t];
      }
    }
    for (std::size_t t = 0; t < sum.size(); ++t) sum[t] = count[t] > 0 ? sum[t] / count[t] : 0;
    return sum;
  }

  bool is_in(const State& state, const Candidate* candidate) const {
    return std::ranges::any_of(state.terms, [&](const Term& t) { return t.candidate->name() == candidate->name(); });
  }

  /// Every candidate that is not in the model, with each of its shapes.
  std::vector<Probe> probes(const State& state, std::vector<Group>& groups) {
    std::vector<Probe> probes;
    const auto rows = expected(problem_, state);
    for (const auto& candidate : candidates_) {
      if (is_in(state, candidate.get()) || result_.refused.contains(candidate->name())) continue;
      try {
        for (std::vector<double>& values : candidate->probes()) {
          State with = state;
          with.terms.push_back({candidate.get(), values});
          Group group{candidate->name(), {}};
          for (std::size_t k = 0; k < candidate->free().size(); ++k) {
            if (!candidate->free()[k].shape)
              group.columns.push_back(derivative(problem_, with, rows, with.terms.size() - 1, k));
          }
          if (group.columns.empty()) continue;
          groups.push_back(std::move(group));
          probes.push_back({candidate.get(), std::move(values)});
        }
      } catch (const simulation::EffectError& error) {
        result_.refused[candidate->name()] = error.what();
      }
    }
    return probes;
  }

  /// A state with a candidate at the sizes that its score suggests.
  State extended(const State& state, const Probe& probe, const Score& score) const {
    State result = state;
    Term term{probe.candidate, probe.values};
    Eigen::Index column = 0;
    for (std::size_t k = 0; k < term.values.size(); ++k) {
      const FreeParameter& p = probe.candidate->free()[k];
      if (p.shape) continue;
      term.values[k] = std::clamp(p.off + score.values(column++) * p.typical, p.minimum, p.maximum);
    }
    result.terms.push_back(std::move(term));
    return result;
  }

  struct Trial {
    const Candidate* candidate;
    Fit fit;
    double p_value, gain;
    double carriers;
  };

  /// The best candidates, fitted jointly with what the state has, best first.
  std::vector<Trial> trials(const Fit& base, std::size_t flips) {
    std::vector<Group> groups;
    const std::vector<Probe> tried = probes(base.state, groups);
    if (groups.empty()) return {};
    const Scan scanned = scan(problem_, base, groups, flips, options_.seed);
    std::vector<std::size_t> order(tried.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    const auto merit = [&](std::size_t i) {
      return scanned.scores[i].gain - scanned.scores[i].dimension * conditions_log();
    };
    std::ranges::stable_sort(order, std::greater<>{}, merit);
    std::vector<Trial> result;
    std::set<const Candidate*> taken;
    for (const std::size_t i : order) {
      if (taken.size() == shortlist) break;
      if (!taken.insert(tried[i].candidate).second) continue;
      const Score& score = scanned.scores[i];
      // Where the linear guess is beyond what the effect can do, the fit begins where it changes nothing.
      State nothing = base.state;
      nothing.terms.push_back({tried[i].candidate, tried[i].values});
      for (const State& start : {extended(base.state, tried[i], score), nothing}) {
        try {
          result.push_back(
              {tried[i].candidate, fit(problem_, start, weight_), score.p_value, score.gain, score.carriers});
          break;
        } catch (const simulation::EffectError&) {
          continue;
        }
      }
    }
    std::ranges::stable_sort(result, {}, [&](const Trial& t) { return bic(t.fit); });
    return result;
  }

  bool significant(const Trial& t) const { return t.p_value < significance || (t.carriers < few && t.gain > certain); }

  bool add() {
    say(fmt::format("looking for effect {}", best_.state.terms.size() - model_.size() + 1));
    for (Trial& t : trials(best_, options_.flips)) {
      if (bic(best_) - bic(t.fit) < worth) return false;
      if (!significant(t)) continue;
      Fit before = std::exchange(best_, std::move(t.fit));
      try {
        refine();
      } catch (const simulation::EffectError& error) {
        result_.refused[t.candidate->name()] = error.what();
        best_ = std::move(before);
        continue;
      }
      p_values_[t.candidate] = t.p_value;
      return true;
    }
    return false;
  }

  /// Fits again with what the coarse grid misses of the state as it is now.
  void refine() {
    correct(problem_, best_.state);
    best_ = fit(problem_, best_.state, weight_);
  }

  Fit without(std::size_t term) {
    State state = best_.state;
    state.terms.erase(state.terms.begin() + static_cast<std::ptrdiff_t>(term));
    return fit(problem_, std::move(state), weight_);
  }

  /// Takes each addition out again: drops it where it is not missed, swaps it where another does better.
  void exchange() {
    for (std::size_t round = 0; round < most_rounds && best_.state.terms.size() > model_.size() + 1; ++round) {
      bool changed = false;
      for (std::size_t t = model_.size(); t < best_.state.terms.size() && !changed; ++t) {
        say(fmt::format("asking whether {} is needed", best_.state.terms[t].candidate->name()));
        Fit less = without(t);
        if (bic(less) < bic(best_) + worth) {
          best_ = std::move(less);
          changed = true;
          break;
        }
        if (t + 1 == best_.state.terms.size()) continue;  // the last one has just been chosen among all
        for (Trial& trial : trials(less, 0)) {
          if (bic(trial.fit) < bic(best_) - 1) {
            p_values_[trial.candidate] = p_values_[best_.state.terms[t].candidate];
            best_ = std::move(trial.fit);
            changed = true;
          }
          break;
        }
      }
      if (!changed) break;
      refine();
    }
  }

  void describe_found() {
    for (std::size_t t = model_.size(); t < best_.state.terms.size(); ++t) {
      Found found{best_.state.terms[t].candidate, 0, p_values_[best_.state.terms[t].candidate], {}, {}};
      say(fmt::format("comparing {} with its rivals", found.candidate->name()));
      const Fit less = without(t);
      found.gain = less.deviance - best_.deviance;
      Scan scanned;
      found.where = patterns(less, scanned);
      for (const Trial& trial : trials(less, 0)) {
        if (trial.candidate == found.candidate) continue;
        Rival rival{trial.candidate, trial.fit.deviance - best_.deviance, bic(trial.fit) - bic(best_), false};
        rival.tied = std::min(rival.deviance, rival.bic) < tie_limit;
        found.rivals.push_back(rival);
      }
      result_.found.push_back(std::move(found));
    }
  }

  std::vector<Pattern> patterns(const Fit& base, Scan& scanned) {
    const std::vector<Basis> bases = generic_bases(problem_);
    std::vector<Group> groups;
    for (const Basis& basis : bases) groups.push_back(basis.group);
    scanned = scan(problem_, base, groups, options_.flips, options_.seed + 1);
    std::vector<double> p_values;
    for (const Score& score : scanned.scores) p_values.push_back(score.own_p_value);
    const double limit = false_discovery_limit(p_values, 0.05);
    std::vector<Pattern> result;
    for (std::size_t b = 0; b < bases.size(); ++b) {
      const Score& score = scanned.scores[b];
      if (score.own_p_value > limit || score.gain < certain / 2) continue;
      result.push_back({bases[b].observable, bases[b].axis, score.gain, score.p_value,
                        size_of(bases[b], score.values, problem_),
                        std::clamp(score.gain / std::max(scanned.square - scanned.freedom, score.gain), 0.0, 1.0)});
    }
    std::ranges::stable_sort(result, [](const Pattern& a, const Pattern& b) {
      return std::pair(a.p_value, -a.gain) < std::pair(b.p_value, -b.gain);
    });
    return result;
  }

  void look_where() {
    say("asking where the gap is");
    Scan scanned;
    result_.where = patterns(best_, scanned);
  }

  void look_at_rest() {
    say("looking at what is left");
    Scan scanned;
    for (Pattern& pattern : patterns(best_, scanned)) {
      if (pattern.p_value < significance) result_.rest.push_back(std::move(pattern));
    }
    result_.lack_of_fit = scanned.square / scanned.freedom;
    result_.freedom = scanned.freedom;
    result_.structure = structure_rank(problem_, best_.state, options_.seed);
    if (result_.rest.empty() && result_.structure == 0) return;
    for (const Trial& t : trials(best_, 0)) {
      const double whole = std::max(scanned.square - scanned.freedom, 1.0);
      result_.nearest.push_back({t.candidate, t.fit.deviance - best_.deviance,
                                 std::clamp((best_.deviance - t.fit.deviance) / whole, 0.0, 1.0), false});
    }
  }

  Problem problem_;
  const std::vector<Term>& model_;
  const std::vector<std::unique_ptr<Candidate>>& candidates_;
  const SearchOptions& options_;
  std::vector<double> weight_;
  std::map<const Candidate*, double> p_values_;
  Fit best_;
  SearchResult result_;
};

}  // namespace

SearchResult search(const Problem& problem, const std::vector<Term>& model,
                    const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options) {
  return Search(problem, model, candidates, options).run();
}

}  // namespace tofgraph::diagnosis
