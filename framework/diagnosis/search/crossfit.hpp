// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cross-fitting (cross-validation of the whole selection): whole levels of a setting are held out, effects are
/// selected and fitted without them, and the result predicts them unchanged. A fold has its own design and data, which
/// exclude the held-out conditions. `folds` makes the folds and predicts, `crossfit` searches.
#pragma once

#include "diagnosis/data/design.hpp"
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/fit.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/selection.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

// ---- Folds: conditions that are held out together ----

/// Conditions that are held out together.
struct Fold {
  std::string setting;            ///< distance, target, session, integration time; each_distance etc.
  std::string levels;             ///< "1.2 m, 2.4 m", "white"
  std::vector<std::size_t> held;  ///< ascending
  bool extrapolates = false;      ///< beyond all remaining levels
};

/// Folds that hold out every condition once for each setting with enough levels: distances in interleaved groups, with
/// the nearest and the farthest held out separately; integration times in the same way if there are too few distances;
/// each target; each session. Folds that leave too few conditions are omitted.
std::vector<Fold> folds_of(const Design& design);

inline constexpr const char *each_distance = "each distance", *each_target = "each target", *any_half = "a random half";
/// Each distance alone, then each target, if enough conditions remain.
std::vector<Fold> single_levels(const Design& design);
/// Random halves of the clusters, see clusters_of().
std::vector<Fold> random_halves(const Design& design, std::size_t count, std::uint64_t seed);

/// Cluster of each condition: those at one distance in one session, which may share errors that no model includes.
/// If there are few clusters, each condition is its own cluster.
std::vector<std::size_t> clusters_of(const Design& design);

// ---- Some conditions of a campaign as a separate problem ----

/// Some conditions of a design, independent of the others.
struct FoldProblem {
  Design design;
  std::vector<Observations> data;
  Problem problem;

  FoldProblem(const Design& whole, const std::vector<Observations>& all, const std::vector<std::size_t>& chosen,
              const Deadline* deadline = nullptr);
  /// @param other problem whose deadline and targets are taken; new targets follow
  FoldProblem(const Design& whole, const std::vector<Observations>& all, const std::vector<std::size_t>& chosen,
              const Problem& other);
  /// Fixes the contrast at the value of a fit that estimated it. Refitted to held-out conditions, it would absorb other
  /// errors, such as boards that are not flat. To be called before the first prediction with the fitted model.
  /// @param log_lower ln of the profile's contrast over the fitted one
  void fix_contrast(double log_lower);
  FoldProblem(const FoldProblem&) = delete;
  FoldProblem& operator=(const FoldProblem&) = delete;
};

// ---- Predictions of held-out conditions by models that were fitted without them ----

/// A held-out condition. Chi-squares use the covariance of the model that was fitted without it.
struct OutOfFold {
  std::size_t condition = 0;
  std::array<double, observables> before{}, after{};  ///< sums of squares over superpixels, of depth in m^2
  std::array<double, observables> count{};            ///< number of superpixels
  double chi_after = 0;
  struct Less {
    double chi = 0, seen = 0, depth = 0;  ///< chi-square; chi-square of the change; sum of squares of depth, m^2
    double taken_out = 0;                 ///< sum of squares of depth, effect removed and all else unchanged, m^2
  };
  std::map<std::string, Less> without;  ///< models with one effect less, fitted without it
};

/// Gaps of the given and the fitted model: root mean squares over superpixels, SI, of depth in m; NaN: unknown.
struct HeldOutGap {
  double before = NAN, after = NAN;
};

/// Sums over held-out conditions, see OutOfFold.
struct GapSums {
  double before = 0, after = 0, count = 0;

  void add(const OutOfFold& one, std::size_t observable);
  /// Adds the distances of conditions.
  void add(std::span<const OutOfFold> conditions);
  HeldOutGap gap() const;
};

/// Predicts with everything fixed; the reflectivity of a new target is estimated from amplitudes, never from distances.
/// To be called in this order: before(), after(), then without() for each effect.
class Prediction {
 public:
  /// @param held conditions of the fold, with the targets of the fitted ones first; must outlive this object
  Prediction(const FoldProblem& held, const Fold& fold);

  /// Predicts with the given model, which also determines the misplaced boards.
  void before(const State& state);
  /// Predicts with the fitted model. @param smooth_field of the held-out conditions; null: none
  void after(const State& state, std::shared_ptr<const SmoothField> smooth_field = nullptr);
  /// Predicts with one effect less, fitted without it. The covariance stays that of the complete model.
  /// @param taken_out the effect removed, all else unchanged: the fit without it may diverge if it is unconstrained
  void without(const std::string& effect, const State& state, const State& taken_out);

  std::vector<OutOfFold> result() { return std::move(conditions_); }

 private:
  State carried(const State& state) const;
  Rows predict(const State& state);
  std::array<double, observables> summed(const std::vector<double>& rows, std::size_t condition);

  const FoldProblem& held_;
  std::vector<OutOfFold> conditions_;
  State there_;  ///< last predicted state, in the held-out conditions; its nuisances are carried to the next one
  Rows after_;
  RandomEffectSd random_sd_;
};

/// Prediction by the given and by a fitted model. @param log_lower see FoldProblem::fix_contrast(); nullopt: not fitted
Prediction predicted(FoldProblem& held, const Fold& fold, const State& given, const State& model,
                     std::optional<double> log_lower);

/// Conditions that a fold does not hold out, ascending.
std::vector<std::size_t> left_by(const Fold& fold, std::size_t conditions);

// ---- Selections without these conditions ----

/// Names of the effects that a model adds to the given one, ascending. @param given number of terms of the given one
std::vector<std::string> added_effects(const State& model, std::size_t given);

struct FoldResult {
  Fold fold;
  std::vector<std::string> chosen = {};  ///< added effects
  /// Effects of the set found on all data, if it is better than the chosen one without the held-out conditions, too:
  /// the search of the fold missed it. They count as votes only; predictions are those of the chosen set, because
  /// held-out conditions have contributed to the other one.
  std::vector<std::string> missed = {};
  std::vector<std::string> compared_with = {};  ///< effects of the set from which `missed` was determined
  State state = {};                             ///< model fitted without the held-out conditions
  std::vector<OutOfFold> conditions = {};
  std::string failed = {};    ///< reason why the fold failed; empty: it succeeded
  bool time_expired = false;  ///< true: the time limit ended the search of the fold

  /// True if one of these was chosen.
  bool chose(const std::vector<std::string>& names) const;
  /// True if one of these was chosen or missed.
  bool supports(const std::vector<std::string>& names) const;
  /// Distance gap, m.
  HeldOutGap gap() const;
};

/// Chi-square covers all observables: a gain in others must not increase the distance gap by more than 5 % and 0.1 mm.
/// @param before held-out distance gap, m @param after the same with the effects
constexpr bool is_gap_worse(double before, double after) {
  return after > settings.max_gap_growth * before + settings.practical_threshold[distance];
}

/// Number of folds that must support an effect: a share, to the nearest whole number.
inline std::size_t min_folds_supporting(std::size_t folds) {
  return static_cast<std::size_t>(std::lround(settings.min_supporting_fraction * static_cast<double>(folds)));
}

struct CrossFit {
  std::vector<FoldResult> folds;
  bool complete = true;               ///< true: all folds were searched
  bool time_expired = false;          ///< true: the time limit ended the search of further folds
  std::vector<std::size_t> clusters;  ///< clusters_of() the design

  bool empty() const { return folds.empty(); }
  /// Share of the folds that support one of these; a fold that failed does not.
  /// @param names of an effect and of rivals that explain as much, see EffectFinding::names()
  double supporting_fraction(const std::vector<std::string>& names) const;
  /// Distance gap of all folds, m.
  HeldOutGap gap() const;
  /// A gap with the ends of the 95 % interval of `after`, over clusters.
  struct Gap {
    double before = NAN, after = NAN, low = NAN, high = NAN;
  };
  /// @param setting of the folds that count; "": all folds
  Gap gap(std::size_t observable, const std::string& setting, std::uint64_t seed) const;
  struct GapOfNames {
    HeldOutGap gap;     ///< of the distance, m
    bool alone = true;  ///< true: only of folds that chose some of these effects and no others, if most did
  };
  GapOfNames gap_with_only(std::span<const std::string> names) const;
};

/// @param folds conditions to hold out @param data of the whole design
/// @param asked names of each tested effect, see EffectFinding::names(): once none of them can pass, because too many
/// folds did without it or predicted worse with it, the remaining folds are skipped
/// @param known results of the first folds for the same data, model, candidates and options; not searched again
/// @param of_all_data model found on all data, compared with that of each fold, see FoldResult::missed; null: none
CrossFit cross_fit(const std::vector<Fold>& folds, const Design& design, const std::vector<Observations>& data,
                   const std::vector<Term>& model, const Candidates& candidates, const SearchOptions& options,
                   std::span<const std::vector<std::string>> asked = {}, std::vector<FoldResult> known = {},
                   const State* of_all_data = nullptr);

/// Sets FoldResult::missed of folds that were searched earlier, for another model of all data; other arguments are
/// those of cross_fit(). When the deadline passes, the remaining folds stay as they are.
void compare_folds(std::span<FoldResult> folds, const Design& design, const std::vector<Observations>& data,
                   const std::vector<Term>& model, const Candidates& candidates, const SearchOptions& options,
                   const State& of_all_data);

/// Predictions of conditions that were neither searched nor held out by a fold, as one fold; empty if the model
/// fails, or if the deadline passes first.
/// @param searched problem to which both models were fitted @param whole the campaign @param rest its other conditions
CrossFit predict_unsearched(const Problem& searched, const Design& whole, const std::vector<Observations>& data,
                            const std::vector<std::size_t>& rest, const State& given, const State& model,
                            const Deadline& deadline);

/// Improvement by an effect, or by a rival that explains as much, on held-out data: chi-square without it and with it,
/// over the conditions of all folds that chose it.
struct HeldOutImprovement {
  double without = 0, with = 0, seen = 0;  ///< chi-squares; `seen`: of the change by the effect
  double low = 0;                          ///< lower end of the 95 % interval of without - with, over conditions
  double gap_refitted_without = NAN, gap_with = NAN;  ///< of the distance, m; NaN: in no fold
  /// Median over folds of the root mean squares, m: effect removed with all else unchanged, and with it. In a single
  /// fold two effects may compensate each other, so that one without the other is far off.
  double median_taken_out = NAN, median_with = NAN;
  std::size_t folds_alone = 0, folds_choosing = 0;  ///< folds that chose exactly one of the names; any of them
  std::size_t folds_supporting = 0;                 ///< see FoldResult::supports()

  bool is_significant() const { return low > 0; }
  bool is_worse() const { return seen >= settings.min_harm_chi_square && without <= with; }
};
/// @param names see EffectFinding::names()
HeldOutImprovement held_out_improvement_of(const CrossFit& cross_fit, const std::vector<std::string>& names,
                                           std::uint64_t seed);

/// Distance gaps over the folds that hold a condition out, m, one per condition.
/// @param conditions number of conditions of the whole design
std::vector<HeldOutGap> gaps_by_condition(const CrossFit& cross_fit, std::size_t conditions);

// ---- Sets of effects on which folds agree and which the model of all data lacks ----

/// True if more than half of the searched folds chose an effect that a model lacks.
/// @param given number of terms of the model before the search
bool agree_on_more(const CrossFit& folds, const State& model, std::size_t given);

/// Models of folds with an effect that more than half of the folds chose and a model lacks, one for each set of
/// effects, the most frequent set first. Empty if fewer than three folds were searched.
/// @param given number of terms of the model before the search
std::vector<State> models_with_agreed_effects(const CrossFit& folds, const State& model, std::size_t given);

}  // namespace tofgraph::diagnosis
