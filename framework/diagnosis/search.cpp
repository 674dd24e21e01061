// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search.hpp"

#include "diagnosis/structure.hpp"
#include "diagnosis/validation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace tofgraph::diagnosis {
namespace {

constexpr double significance = 0.005;                     ///< of the largest score of all
constexpr double worth = 10;                               ///< least fall of BIC for an effect more
constexpr double tie_limit = 10;                           ///< of deviance or BIC
constexpr std::size_t shortlist = 6, least_shortlist = 2;  ///< candidates that are fitted
constexpr double promising = 0.3;       ///< of the largest linear gain: what bending could still make of it
constexpr double few = 8;               ///< conditions: fewer cannot be judged by sign flips alone,
constexpr double certain = 60;          ///< but by a gain like this
constexpr std::size_t most_rounds = 3;  ///< of swapping
constexpr double least_capture = 0.8;   ///< of what the best generic pattern explains in an effect's place

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
        bases_(generic_bases(problem)),
        weight_(problem.data.size(), 1.0),
        held_(hold_out(problem.design, options.seed)) {}

  SearchResult run() {
    say("fitting the model as it is");
    State start{model_, start_light(), {}};
    if (!model_.empty()) correct(problem_, start);
    result_.before = fit(problem_, start, weight_);
    best_ = result_.before;
    look_where();
    grow();
    while (!confirm()) {
    }
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

  void grow() {
    // What is dropped may be tried again, so the rounds are counted, not the effects alone.
    for (std::size_t round = 0; round < 2 * options_.most_effects; ++round) {
      if (best_.state.terms.size() == model_.size() + options_.most_effects || !add()) break;
      exchange();
    }
  }

  /// Every candidate that is not in the model, with each of its shapes.
  std::vector<Probe> probes(const State& state, std::vector<Group>& groups) {
    std::vector<Probe> probes;
    const auto rows = expected(problem_, state);
    for (const auto& candidate : candidates_) {
      if (is_in(state, candidate.get()) || result_.refused.contains(candidate->name()) ||
          unproven_.contains(candidate->name()))
        continue;
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
    double most = 0;
    for (const Score& score : scanned.scores) most = std::max(most, score.gain);
    const std::vector<Column> known = own_columns(problem_, base.state, expected(problem_, base.state));
    std::vector<Trial> result;
    std::set<const Candidate*> taken;
    for (const std::size_t i : order) {
      if (taken.size() == shortlist) break;
      if (taken.size() >= least_shortlist && scanned.scores[i].gain < promising * most) continue;
      if (!taken.insert(tried[i].candidate).second) continue;
      const Score& score = scanned.scores[i];
      // Where the linear guess is beyond what the effect can do, the fit begins where it changes nothing.
      State nothing = base.state;
      nothing.terms.push_back({tried[i].candidate, tried[i].values});
      for (const State& start : {extended(base.state, tried[i], score), nothing}) {
        try {
          result.push_back({tried[i].candidate, fit_last(problem_, start, weight_, known), score.p_value, score.gain,
                            score.carriers});
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

  /// Puts the gates to every effect that was found, and drops the one that does worst of those that do not pass.
  /// @returns whether all passed
  bool confirm() {
    result_.found.clear();
    std::size_t worst = 0;
    for (std::size_t t = model_.size(); t < best_.state.terms.size(); ++t) {
      result_.found.push_back(examined(t));
      const Found &now = result_.found.back(), &before = result_.found[worst];
      const auto rank = [](const Found& f) { return std::pair(f.refutation.empty(), f.capture); };
      if (rank(now) < rank(before)) worst = result_.found.size() - 1;
    }
    if (result_.found.empty() || result_.found[worst].refutation.empty()) return true;
    const Found dropped = result_.found[worst];
    say(fmt::format("dropping {}", dropped.candidate->name()));
    unproven_.insert(dropped.candidate->name());
    result_.dropped.push_back(dropped);
    best_ = without(model_.size() + worst);
    refine();
    return false;
  }

  /// An added effect against the model without it.
  Found examined(std::size_t t) {
    const Term& term = best_.state.terms[t];
    Found found;
    found.candidate = term.candidate;
    say(fmt::format("comparing {} with its rivals", found.candidate->name()));
    const Fit less = without(t);
    found.gain = less.deviance - best_.deviance;
    bool significant_there = false;
    for (const Trial& trial : trials(less, options_.flips)) {
      if (trial.candidate == found.candidate) {
        found.p_value = trial.p_value;
        significant_there = significant(trial);
        continue;
      }
      Rival rival{trial.candidate, trial.fit.deviance - best_.deviance, bic(trial.fit) - bic(best_), false};
      rival.tied = std::min(rival.deviance, rival.bic) < tie_limit;
      found.rivals.push_back(rival);
    }
    Scan scanned;
    found.where = patterns(less, scanned);
    found.capture = capture(less, term, scanned);
    found.held_out = held_out_fall(problem_, best_.state, less.state, held_, options_.seed);
    if (!significant_there)
      found.refutation = fmt::format("chance may do as much (p = {:.3f})", found.p_value);
    else if (found.capture < least_capture)
      found.refutation =
          fmt::format("it explains {:.0f} % of what a pattern without physics does", 100 * found.capture);
    else if (refuted(found.held_out))
      found.refutation = "the gap does not shrink on conditions that were put aside";
    return found;
  }

  /// Gain of an effect over that of the best generic pattern, in the model without it.
  double capture(const Fit& less, const Term& term, const Scan& generic) const {
    const Group group{term.candidate->name(), signature(problem_, less.state, term)};
    const double gain = scan(problem_, less, std::span(&group, 1), 0, 0).scores[0].gain;
    double most = 0;
    for (const Score& score : generic.scores) most = std::max(most, score.gain - score.dimension);
    return most > 0 ? gain / most : std::numeric_limits<double>::infinity();
  }

  std::vector<Pattern> patterns(const Fit& base, Scan& scanned) {
    scanned = scan(problem_, base, bases_.groups, options_.flips, options_.seed + 1);
    std::vector<double> p_values;
    for (const Score& score : scanned.scores) p_values.push_back(score.own_p_value);
    const double limit = false_discovery_limit(p_values, 0.05);
    std::vector<Pattern> result;
    for (std::size_t b = 0; b < bases_.patterns.size(); ++b) {
      const Score& score = scanned.scores[b];
      if (score.own_p_value > limit || score.gain < certain / 2) continue;
      result.push_back({bases_.patterns[b].observable, bases_.patterns[b].axis, score.gain, score.p_value,
                        size_of(bases_.patterns[b], bases_.groups[b], score.values, problem_),
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
  Bases bases_;
  std::vector<double> weight_;
  std::vector<bool> held_;
  std::set<std::string> unproven_;  ///< candidates that did not pass the gates
  Fit best_;
  SearchResult result_;
};

}  // namespace

SearchResult search(const Problem& problem, const std::vector<Term>& model,
                    const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options) {
  return Search(problem, model, candidates, options).run();
}

}  // namespace tofgraph::diagnosis
