// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cross-fitting (cross-validation of the whole selection): whole levels of a setting are held out, effects are
/// selected and fitted without them, and the result predicts them unchanged. A fold has its own design and data, which
/// exclude the held-out conditions.
#pragma once

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/folds.hpp"
#include "diagnosis/search/selection.hpp"

#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

struct FoldResult {
  Fold fold;
  std::vector<std::string> chosen = {};  ///< added effects
  State state = {};                      ///< model fitted without the held-out conditions
  std::vector<OutOfFold> conditions = {};
  std::string failed = {};    ///< reason why the fold failed; empty: it succeeded
  bool time_expired = false;  ///< true: the time limit ended the search of the fold

  /// True if one of these was chosen.
  bool chose(const std::vector<std::string>& names) const;
  /// Distance gap, m.
  HeldOutGap gap() const;
};

/// Chi-square covers all observables: a gain in others must not increase the distance gap by more than 5 % and 0.1 mm.
/// @param before held-out distance gap, m @param after the same with the effects
constexpr bool is_gap_worse(double before, double after) {
  return after > settings.max_gap_growth * before + settings.practical_threshold[distance];
}

/// Number of folds that must choose an effect: a share, to the nearest whole number.
inline std::size_t min_folds_choosing(std::size_t folds) {
  return static_cast<std::size_t>(std::lround(settings.min_chosen_fraction * static_cast<double>(folds)));
}

struct CrossFit {
  std::vector<FoldResult> folds;
  bool complete = true;               ///< true: all folds were searched
  bool time_expired = false;          ///< true: the time limit ended the search of further folds
  std::vector<std::size_t> clusters;  ///< clusters_of() the design

  bool empty() const { return folds.empty(); }
  /// Share of the folds that chose one of these; a fold that failed counts as not choosing it.
  /// @param names of an effect and of rivals that explain as much, see EffectFinding::names()
  double chosen_fraction(const std::vector<std::string>& names) const;
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
CrossFit cross_fit(const std::vector<Fold>& folds, const Design& design, const std::vector<Observations>& data,
                   const std::vector<Term>& model, const std::vector<std::unique_ptr<Candidate>>& candidates,
                   const SearchOptions& options, std::span<const std::vector<std::string>> asked = {},
                   std::vector<FoldResult> known = {});

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
  std::size_t folds_alone = 0, folds = 0;  ///< folds that chose exactly one of the names; folds that chose any

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
