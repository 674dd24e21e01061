// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Folds: conditions that are held out together, and predictions of them by models fitted without them.
#pragma once

#include "diagnosis/data/design.hpp"
#include "diagnosis/model/fit.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

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

}  // namespace tofgraph::diagnosis
