// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Proof out of sample: whole levels of a setting are held out, effects are selected and fitted without them, and what
/// comes out predicts them as it is. What is held out is not there at all: a fold has a design and data of its own.
#pragma once

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/folds.hpp"
#include "diagnosis/search/selection.hpp"

#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

struct FoldResult {
  Fold fold;
  std::vector<std::string> chosen = {};  ///< effects that were added
  State state = {};                      ///< of the model fitted without the held-out conditions
  std::vector<OutOfFold> conditions = {};
  std::string failed = {};    ///< why it gave no number, or empty
  bool time_expired = false;  ///< whether time ended before it gave one

  /// True if one of these was chosen.
  bool chose(const std::vector<std::string>& names) const;
  struct Gap {
    double before = 0, after = 0;  ///< root mean square over superpixels, SI; NaN where nothing is known
  };
  Gap gap(std::size_t observable) const;
};

/// Chi-square is that of all observables: what another one gains must not be paid for by the distance, by more than 5 %
/// and 0.1 mm. @param before distance gap out of fold, m @param after likewise
constexpr bool is_gap_worse(double before, double after) {
  return after > settings.max_gap_growth * before + settings.practical_threshold[distance];
}

struct CrossFit {
  std::vector<FoldResult> folds;
  bool complete = true;               ///< whether these are all
  bool time_expired = false;          ///< whether others had not ended when time did
  std::vector<std::size_t> clusters;  ///< clusters_of() the design

  bool empty() const { return folds.empty(); }
  /// Share of the folds that chose an effect, or one that it stands for: one that gave no number did not.
  /// @param names all of these
  double chosen_fraction(const std::vector<std::string>& names) const;
  /// Root mean square over superpixels, SI; with the ends of its 95 % interval by clusters.
  struct Gap {
    double before = 0, after = 0, low = 0, high = 0;
  };
  /// @param setting of the folds that count, or "" for all
  Gap gap(std::size_t observable, const std::string& setting, std::uint64_t seed) const;
  struct Depth {
    double before = 0, after = 0;  ///< root mean squares, m
    bool alone = true;  ///< of folds that chose some of these effects and nothing else, where most did; else of all
  };
  Depth depth_with_only(std::span<const std::string> names) const;
};

/// @param folds what to hold out @param data of the whole design
/// @param asked names of each effect that must prove itself, its own first, with all it stands for: when so many folds
/// did without that none of them can, or predicted worse with them, the other folds are left out
/// @param known results of the first folds, with the same data, model, candidates and options: not searched again
CrossFit cross_fit(const std::vector<Fold>& folds, const Design& design, const std::vector<Observations>& data,
                   const std::vector<Term>& model, const std::vector<std::unique_ptr<Candidate>>& candidates,
                   const SearchOptions& options, std::span<const std::vector<std::string>> asked = {},
                   std::vector<FoldResult> known = {});

/// Improvement by an effect, or by one that it stands for, on held-out data: chi-square with all but it, and with all,
/// over the conditions of all folds that chose it.
struct HeldOutImprovement {
  double without = 0, with = 0, seen = 0;  ///< chi-squares
  double low = 0;                          ///< of without - with, low end of its 95 % interval by conditions
  double depth_without = std::numeric_limits<double>::quiet_NaN();  ///< root mean squares, m; NaN: in no fold
  double depth_with = std::numeric_limits<double>::quiet_NaN();
  /// Root mean squares of a fold, the median over folds, m: taken out with all else as it was, and with it. In a single
  /// fold two effects may hold each other up, and the one without the other be anywhere.
  double median_taken_out = std::numeric_limits<double>::quiet_NaN();
  double median_with = std::numeric_limits<double>::quiet_NaN();
  std::size_t conditions = 0;
  std::size_t folds_alone = 0, folds = 0;  ///< that chose one of the names alone; that chose any

  bool is_significant() const { return low > 0; }
  bool is_worse() const { return seen >= settings.min_harm_chi_square && without <= with; }
};
/// @param names of the effect first, then of what it stands for
HeldOutImprovement held_out_improvement_of(const CrossFit& cross_fit, const std::vector<std::string>& names,
                                           std::uint64_t seed);

/// Root mean squares over a condition's superpixels and over the folds that put it aside, SI (of the distance as
/// depth). NaN where nothing is known.
struct ConditionGap {
  double before = 0, after = 0;
};
/// Gaps, one a condition. @param conditions of the whole design
std::vector<ConditionGap> gaps_by_condition(const CrossFit& cross_fit, std::size_t conditions, std::size_t observable);

// ---- Sets of effects on which folds agree and which the model of all data lacks ----

/// True if more than half of the folds that were searched chose an effect that a model lacks.
/// @param given terms of the model before the search
bool agree_on_more(const CrossFit& folds, const State& model, std::size_t given);

/// Models of folds that have an effect which more than half of the folds chose and a model lacks, each with another set
/// of effects, the set that most folds chose first. Empty where fewer than three folds were searched.
/// @param given terms of the model before the search
std::vector<State> agreed_models(const CrossFit& folds, const State& model, std::size_t given);

}  // namespace tofgraph::diagnosis
