// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search.hpp"

#include "diagnosis/alternatives.hpp"
#include "diagnosis/gates.hpp"
#include "diagnosis/maps.hpp"
#include "diagnosis/structure.hpp"
#include "diagnosis/trials.hpp"
#include "graph/stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

constexpr double worth = 10;            ///< least fall of BIC for an effect more
constexpr double tie_limit = 10;        ///< of deviance or BIC
constexpr std::size_t most_rounds = 3;  ///< of swapping at the end; one after each addition
constexpr std::size_t most_leaps = 3;   ///< enumerations of sets, each in the noise that the best fit before has left
constexpr std::size_t most_fitted = 6;  ///< sets that are fitted after each
constexpr double promising = 0.3;       ///< of the best linear gain: what bending could still make of a candidate
constexpr double rival_share = 0.5;     ///< likewise, to take the place of one that is in the model
/// Of the gain of the best generic pattern: less is no effect's own signature, whatever else is in the data.
constexpr double hopeless = 0.15;
constexpr double hardly = 0.01;         ///< likewise: less is not near
constexpr double promising_maps = 0.3;  ///< of all that was gained: what maps alone must gain to begin with them
constexpr double explained = 1.05;      ///< chi-square over its expectation where nothing is left to explain

class Search {
 public:
  Search(const Problem& problem, const std::vector<Term>& model,
         const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options)
      : problem_(problem),
        model_(model),
        candidates_(candidates),
        options_(options),
        weight_(problem.data.size(), 1.0),
        finder_(problem_),
        gates_(problem_, finder_, weight_, options.flips, options.seed),
        trials_(problem_, candidates, weight_) {}

  /// @param refused effects that are not tried, and why
  SearchResult run(const std::map<std::string, std::string>& refused) {
    say("fitting the model as it is");
    State start{model_, first_light(problem_), {}};
    if (!problem_.design.tells_offset()) start.variances.offset = 0;
    if (!model_.empty()) correct(problem_, start);
    take(fit(problem_, start, weight_));
    result_.before = best_.fit;
    original_ = best_;
    original_.brightening = problem_.brightening;
    trials_.prepare(best_.fit.state);
    for (const auto& [name, why] : refused) trials_.refuse(name, why);
    say("asking where the gap is");
    result_.where = finder_.find(problem_, best_.fit, best_.columns, options_.flips, options_.seed + 1).patterns;
    leap();
    grow();
    grow_from_maps();
    exchange(most_rounds);
    while (!confirm()) {
    }
    settle();
    for (std::size_t t = model_.size(); t < terms().size(); ++t) describe(t);
    look_at_rest();
    result_.refused = trials_.refused();
    result_.after = best_.fit;
    result_.correction = std::move(problem_.correction);
    result_.brightening = std::move(problem_.brightening);
    return std::move(result_);
  }

 private:
  void say(const std::string& what) const {
    if (options_.progress) options_.progress(what);
  }
  double bic(const Fit& fit) const { return fit.bic(problem_.data.size()); }
  const std::vector<Term>& terms() const { return best_.fit.state.terms; }

  void take(Fit fit) {
    best_.columns = own_columns(problem_, fit.state, expected(problem_, fit.state));
    best_.fit = std::move(fit);
  }

  /// The values that are told: intervals may be narrower than what the finer grid still misses.
  void settle() {
    if (terms().empty()) return;
    say("settling on values");
    correct(problem_, best_.fit.state, true);
    take(fit_with_maps(problem_, with_positive_sizes(problem_, best_.fit.state), weight_));
  }

  /// To the best set of effects: the best of the linearised problem are fitted, and again in the noise that the best of
  /// these leaves, until no other set comes out.
  void leap() {
    say("enumerating sets of effects");
    std::map<std::string, std::string> refused = trials_.refused();
    Alternatives all = alternatives_of(problem_, original_.fit.state, candidates_, refused);
    for (const auto& [name, why] : refused) trials_.refuse(name, why);
    if (all.list.empty()) return;
    SubsetOptions options;
    options.price = std::log(static_cast<double>(problem_.data.size()));
    options.prior = 1 / (prior_width * prior_width);
    Fit reference = original_.fit, best = original_.fit;
    std::set<std::vector<std::size_t>> tried;
    for (std::size_t round = 0; round < most_leaps; ++round) {
      const Score score = score_of(problem_, reference, original_.columns, all.group, 0, 0);
      bool better = false;
      std::size_t fitted = 0;
      for (const Subset& subset : best_subsets(score.information, score.score, all.choices, options)) {
        if (subset.merit < worth || fitted == most_fitted) break;
        if (!tried.insert(subset.choices).second) continue;
        ++fitted;
        std::optional<Fit> next = fitted_set(all, subset);
        if (!next || bic(best) - bic(*next) < 1) continue;
        best = std::move(*next);
        better = true;
      }
      if (!better) break;
      reference.state.variances = best.state.variances;
    }
    if (bic(original_.fit) - bic(best) >= worth) try_refine(std::move(best.state));
  }

  /// Nothing where an effect gives no number.
  std::optional<Fit> fitted_set(const Alternatives& all, const Subset& subset) {
    State state = original_.fit.state;
    Eigen::Index at = 0;
    for (const std::size_t c : subset.choices) {
      const auto count = static_cast<Eigen::Index>(all.choices[c].columns.size());
      const Eigen::VectorXd values = subset.values.segment(at, count);
      state.terms.push_back(all.list[c].term({values.data(), static_cast<std::size_t>(count)}));
      at += count;
    }
    try {
      return fit(problem_, std::move(state), weight_);
    } catch (const simulation::EffectError&) {
      return std::nullopt;
    }
  }

  void grow() {
    // What is dropped may be tried again, so the rounds are counted, not the effects alone.
    for (std::size_t round = 0; round < 4 * options_.max_effects; ++round) {
      const bool first = terms().size() == model_.size();
      if (terms().size() == model_.size() + options_.max_effects || !(add() || add_maps())) break;
      if (first) prefer_maps();
      exchange(1);
    }
  }

  bool add() {
    say(fmt::format("looking for effect {}", terms().size() - model_.size() + 1));
    for (Trial& t : trials_.best(best_, options_.flips, options_.seed, nullptr, promising, true)) {
      if (bic(best_.fit) - bic(t.fit) < worth) return false;
      if (!significant(t.score)) continue;
      const std::string name = name_of(t.fit.state.terms[t.piece.term], t.piece);
      const Group group{name, signature(problem_, best_.fit.state, t.fit.state, t.piece)};
      if (importance(problem_, group.columns[0]) <= 1) {
        note_small(*t.candidate, name);
        continue;
      }
      if (gates_.capture(best_, group) < hopeless) continue;
      const std::string failed = try_refine(std::move(t.fit.state));
      if (failed.empty()) return true;
      if (!t.piece.refinement) trials_.refuse(name, failed);
    }
    return false;
  }

  void note_small(const Candidate& candidate, const std::string& name) {
    if (std::ranges::find(result_.dropped, name, &Found::name) != result_.dropped.end()) return;
    Found small;
    small.candidate = &candidate;
    small.name = name;
    small.refutation = Gates::too_small;
    result_.dropped.push_back(std::move(small));
  }

  bool beats(const MapTrial& maps) const {
    return significant(maps.trial.score) && bic(best_.fit) - bic(maps.trial.fit) >= worth;
  }

  std::optional<MapTrial> maps_on(const Base& base) {
    std::map<std::string, std::string> refused = trials_.refused();
    std::optional<MapTrial> best =
        best_maps(problem_, base, candidates_, refused, weight_, options_.flips, options_.seed);
    for (const auto& [name, why] : refused) trials_.refuse(name, why);
    return best;
  }

  /// In the place of all that was found.
  std::optional<MapTrial> maps_alone() {
    const InLightOf there(problem_, original_);
    return maps_on(original_);
  }

  /// When no effect with a few parameters helps any more: one with a number for every pixel, beside what was found or
  /// in its place.
  bool add_maps() {
    say("looking for what each pixel does");
    std::optional<MapTrial> maps = maps_on(best_);
    if (terms().size() > model_.size()) {
      std::optional<MapTrial> alone = maps_alone();
      if (alone && (!maps || bic(alone->trial.fit) < bic(maps->trial.fit))) maps = std::move(alone);
    }
    return maps && beats(*maps) && try_refine(std::move(maps->trial.fit.state)).empty();
  }

  /// Where maps alone explain all there is, what was added first stood for a part of them.
  void prefer_maps() {
    if (terms().size() == model_.size() || terms().back().maps) return;
    std::optional<MapTrial> alone = maps_alone();
    if (alone && alone->left < explained && beats(*alone)) try_refine(std::move(alone->trial.fit.state));
  }

  /// Where something is left: the search once more, begun with maps. Other effects may have taken the place of one that
  /// was hidden behind them.
  void grow_from_maps() {
    if (terms().size() == model_.size() || left() < explained) return;
    const double gained = bic(original_.fit) - bic(best_.fit);
    std::optional<MapTrial> alone = maps_alone();
    if (!alone || !significant(alone->trial.score) ||
        bic(original_.fit) - bic(alone->trial.fit) < promising_maps * gained)
      return;
    const State before = best_.fit.state;
    const double reached = bic(best_.fit);
    if (!try_refine(std::move(alone->trial.fit.state)).empty()) return;
    grow();
    if (bic(best_.fit) > reached) refine(before);
  }

  double left() const {
    const Scan rest = scan(problem_, best_.fit, best_.columns, {}, 0, 0);
    return rest.square / rest.freedom;
  }

  /// Fits with what the coarse grid misses of a state, its maps anew. @throws simulation::EffectError
  void refine(State state) {
    correct(problem_, state);
    take(fit_with_maps(problem_, std::move(state), weight_));
  }

  /// As refine(); where an effect cannot do its images all stays as it was. @returns why not, or ""
  std::string try_refine(State state) {
    const Base before = best_;
    auto correction = problem_.correction;
    auto brightening = problem_.brightening;
    try {
      refine(std::move(state));
      return "";
    } catch (const simulation::EffectError& error) {
      best_ = before;
      problem_.correction = std::move(correction);
      problem_.brightening = std::move(brightening);
      return error.what();
    }
  }

  /// Every addition: the effects, and the refinements of these and of the model's own.
  std::vector<Piece> pieces() const {
    std::vector<Piece> all;
    for (std::size_t t = 0; t < terms().size(); ++t) {
      if (t >= model_.size()) all.push_back({t, std::nullopt});
      for (std::size_t r = 0; r < terms()[t].candidate->refinements().size(); ++r) {
        if (terms()[t].candidate->refined(r)) all.push_back({t, r});
      }
    }
    return all;
  }

  /// Takes each addition out again: drops it where it is not missed, swaps it where another does better.
  void exchange(std::size_t rounds) {
    for (std::size_t round = 0; round < rounds && pieces().size() > 1; ++round) {
      std::optional<State> changed;
      for (const Piece& piece : pieces()) {
        changed = better(piece);
        if (changed) break;
      }
      if (!changed) break;
      if (!try_refine(std::move(*changed)).empty()) break;  // the candidate that came in cannot do its images
    }
  }

  /// A better model without a piece of the best one, or with another effect in its place.
  std::optional<State> better(const Piece& piece) {
    const Candidate* candidate = terms()[piece.term].candidate;
    say(fmt::format("asking whether {} is needed", name_of(terms()[piece.term], piece)));
    Base less = gates_.without(best_, piece);
    if (bic(less.fit) < bic(best_.fit) + worth) return std::move(less.fit.state);
    // The last one has just been chosen among all.
    if (piece.refinement || piece.term + 1 == terms().size()) return std::nullopt;
    const InLightOf there(problem_, less);
    std::vector<Trial> others = trials_.best(less, 0, options_.seed, candidate, rival_share, true);
    if (!others.empty() && bic(others.front().fit) < bic(best_.fit) - 1) return std::move(others.front().fit.state);
    return std::nullopt;
  }

  /// Puts the gates to every addition, and drops the one that does worst of those that do not pass.
  /// @returns whether all passed
  bool confirm() {
    const std::vector<Piece> all = pieces();
    std::vector<Found> found;
    std::size_t worst = 0;
    const auto rank = [](const Found& f) { return std::pair(f.refutation.empty(), f.capture); };
    for (const Piece& piece : all) {
      say(fmt::format("checking {}", name_of(terms()[piece.term], piece)));
      found.push_back(gates_.examined(best_, piece));
      if (rank(found.back()) < rank(found[worst])) worst = found.size() - 1;
    }
    if (found.empty() || found[worst].refutation.empty()) {
      for (std::size_t i = 0; i < all.size(); ++i)
        (all[i].refinement ? result_.refinements : result_.found).push_back(std::move(found[i]));
      return true;
    }
    say(fmt::format("dropping {}", found[worst].name));
    refine(gates_.without(best_, all[worst]).fit.state);
    result_.dropped.push_back(std::move(found[worst]));
    return false;
  }

  /// What the gap looks like without an effect, and what else could stand in its place.
  void describe(std::size_t t) {
    Found& found = result_.found[t - model_.size()];
    say(fmt::format("comparing {} with its rivals", found.candidate->name()));
    const Base less = gates_.without(best_, {t, std::nullopt});
    const InLightOf there(problem_, less);
    found.where = finder_.find(problem_, less.fit, less.columns, options_.flips, options_.seed + 1).patterns;
    const std::vector<std::string> alike = graph::split_words(found.candidate->border().confused_with);
    for (const Trial& trial : trials_.best(less, 0, options_.seed, found.candidate, rival_share, false, alike)) {
      if (!(trial.fit.deviance < less.fit.deviance)) continue;
      Rival rival{trial.candidate, trial.fit.deviance - best_.fit.deviance, bic(trial.fit) - bic(best_.fit), false};
      rival.tied = std::min(rival.deviance, rival.bic) < tie_limit ||
                   hardly_differ(problem_, best_.fit.state, trial.fit.state, tie_limit);
      found.rivals.push_back(rival);
    }
  }

  void look_at_rest() {
    say("looking at what is left");
    PatternScan left = finder_.find(problem_, best_.fit, best_.columns, options_.flips, options_.seed + 1);
    for (Pattern& pattern : left.patterns) {
      if (pattern.significant && pattern.largest > least_change[pattern.observable])
        result_.rest.push_back(std::move(pattern));
    }
    if (std::optional<Pattern> unsteady = unsteady_camera(problem_, best_.fit, weight_))
      result_.rest.push_back(std::move(*unsteady));
    result_.lack_of_fit = left.square / left.freedom;
    result_.freedom = left.freedom;
    result_.structure = structure_rank(problem_, best_.fit.state, options_.seed);
    if (!result_.something_left()) return;
    for (const Trial& t : trials_.best(best_, 0, options_.seed, nullptr, promising, false)) {
      const Group group{t.candidate->name(), signature(problem_, best_.fit.state, t.fit.state, t.piece)};
      const double capture = std::min(gates_.capture(best_, group), 1.0);
      if (capture > hardly)
        result_.nearest.push_back({t.candidate, t.fit.deviance - best_.fit.deviance, capture, false});
    }
    std::ranges::stable_sort(result_.nearest, std::greater<>{}, &Rival::bic);
  }

  Problem problem_;
  const std::vector<Term>& model_;
  const std::vector<std::unique_ptr<Candidate>>& candidates_;
  const SearchOptions& options_;
  std::vector<double> weight_;
  PatternFinder finder_;
  Gates gates_;
  Trials trials_;
  Base original_, best_;  ///< the model as it is; with what was found
  SearchResult result_;
};

}  // namespace

SearchResult search(const Problem& problem, const std::vector<Term>& model,
                    const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options) {
  // A candidate that fails where no fit can do without it is left out, and the search begins anew.
  std::map<std::string, std::string> refused;
  for (;;) {
    try {
      return Search(problem, model, candidates, options).run(refused);
    } catch (const simulation::EffectError& error) {
      const bool one_of_them =
          std::ranges::any_of(candidates, [&](const auto& candidate) { return candidate->name() == error.effect; });
      if (!one_of_them || !refused.emplace(error.effect, error.what()).second) throw;
    }
  }
}

}  // namespace tofgraph::diagnosis
