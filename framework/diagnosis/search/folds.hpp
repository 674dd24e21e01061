// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Folds: which conditions are held out together, and predictions of them by models fitted without them.
#pragma once

#include "diagnosis/data/design.hpp"
#include "diagnosis/model/fit.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Conditions that are held out together.
struct Fold {
  std::string setting;            ///< distance, target, session, integration time; each_distance and so on
  std::string levels;             ///< "1.2 m, 2.4 m", "white"
  std::vector<std::size_t> held;  ///< ascending
  bool extrapolates = false;      ///< beyond all levels that are left
};

/// Every condition is held out once for each setting that has levels enough: distances in interleaved groups, with the
/// nearest and the farthest apart, integration times likewise where there are not enough distances; each target; each
/// session. None where too few conditions would be left.
std::vector<Fold> folds_of(const Design& design);

inline constexpr const char *each_distance = "each distance", *each_target = "each target", *any_half = "a random half";
/// Each distance by itself, then each target, as far as enough conditions are left.
std::vector<Fold> single_levels(const Design& design);
/// Half of what stands together, at random.
std::vector<Fold> random_halves(const Design& design, std::size_t count, std::uint64_t seed);

/// Cluster of each condition: those at one distance in one session, which may share what no model has.
/// If there are few of these, each condition is its own cluster.
std::vector<std::size_t> clusters_of(const Design& design);

// ---- Some conditions of a campaign as a problem of their own ----

/// Some conditions of a design, with nothing of the others.
struct FoldProblem {
  Design design;
  std::vector<Observations> data;
  Problem problem;

  FoldProblem(const Design& whole, const std::vector<Observations>& all, const std::vector<std::size_t>& chosen,
              const Deadline* deadline = nullptr);
  /// With the deadline and the targets of another part, and the targets that are new.
  FoldProblem(const Design& whole, const std::vector<Observations>& all, const std::vector<std::size_t>& chosen,
              const FoldProblem& other);
  /// Fixes the contrast at the value of a fit that estimated it. Fitted to held-out conditions again, it would absorb
  /// other errors in them, such as boards that are not flat. @param log_lower than the profile's
  void fix_contrast(double log_lower);
  FoldProblem(const FoldProblem&) = delete;
  FoldProblem& operator=(const FoldProblem&) = delete;
};

// ---- Predictions of the conditions that a fold holds out, by models that were fitted without them ----

/// A held-out condition. Chi-squares are in the covariance of the model that was fitted without it.
struct OutOfFold {
  std::size_t condition = 0;
  std::array<double, observables> before{}, after{};  ///< sums of squares over superpixels, of depth in m^2
  std::array<double, observables> count{};            ///< superpixels
  double chi_after = 0;
  struct Less {
    double chi = 0, seen = 0, depth = 0;  ///< chi-square, that of what changes, sum of squares of depth in m^2
    double taken_out = 0;                 ///< the latter with all else as it was with the effect
  };
  std::map<std::string, Less> without;  ///< with one effect less, fitted without it
};

/// Predicts with everything frozen; the reflectivity of a new target comes from its amplitudes, never from distances.
class Prediction {
 public:
  /// @param held the conditions of the fold, with the targets of those that were fitted first; must live on
  Prediction(const FoldProblem& held, const Fold& fold);

  /// With the model as it was given.
  void before(const State& state);
  /// With the model that was fitted. @param smooth_field of the held-out conditions, or nothing
  void after(const State& state, std::shared_ptr<const SmoothField> smooth_field = nullptr);
  /// With one effect less, fitted without it. The covariance stays that of the model with all.
  /// @param taken_out all else as it was with the effect: the fit without it may diverge where nothing holds it
  void without(const std::string& effect, const State& state, const State& taken_out);

  std::vector<OutOfFold> result() { return std::move(conditions_); }

 private:
  State carried(const State& state) const;
  Rows predict(const State& state);
  std::array<double, observables> sums(const std::vector<double>& rows, std::size_t condition);

  const FoldProblem& held_;
  std::vector<OutOfFold> conditions_;
  State there_;  ///< that was predicted last, in the held-out conditions
  Rows after_;
  RandomEffectSd random_sd_;
};

/// Conditions that a fold does not hold out, ascending.
std::vector<std::size_t> left_by(const Fold& fold, std::size_t conditions);

}  // namespace tofgraph::diagnosis
