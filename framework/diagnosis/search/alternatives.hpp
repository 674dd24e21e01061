// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Linearised changes that candidates could make, each for several nonlinear values and with some of its
/// refinements; best sets of them.
#pragma once

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/scan.hpp"

#include <Eigen/Dense>

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

// ---- Best sets of effects of a linearised problem, by enumeration ----

/// Form in which an effect may enter a model: at one combination of its nonlinear values, with some of its
/// refinements.
struct Choice {
  std::size_t effect = 0;             ///< a set never contains two choices of the same effect
  std::vector<Eigen::Index> columns;  ///< indices among the columns of the information
  double dimension = 0;               ///< number of parameters it costs, nonlinear ones included
};

struct Subset {
  std::vector<std::size_t> choices;  ///< ascending
  double gain = 0;                   ///< decrease of the deviance
  double merit = 0;                  ///< gain minus the price of the parameters
  Eigen::VectorXd values;            ///< values, one per column, choice after choice
};

struct SubsetOptions {
  std::size_t max_effects = settings.max_set_effects;
  std::size_t kept = settings.kept_sets;        ///< returned sets of each size above one, each of different effects
  std::size_t singles = settings.sure_singles;  ///< returned sets of one effect
  double price = 0;                             ///< deviance per parameter: ln of the number of conditions
  double prior = 0;                             ///< added to the diagonal of the information, see prior_width
  std::size_t beam = settings.beam;  ///< sets of one size that are extended; if fewer exist, none is left out
  /// Once a set gains share_of_all of the gain of all columns, minus less_than_all, only one larger size is evaluated.
  double share_of_all = 1, less_than_all = 0;
};

/// Sets of each size with the greatest merit, greatest first; sets of the same effects count once, with their best
/// choices. A set of k effects extends one of k - 1. All pairs are evaluated, and all larger sets as long as the number
/// of sets with one effect less does not exceed the beam; beyond that only the best of these are extended.
/// @param information of all columns, nuisances projected out @param score of the residual in the same columns: the
/// gain of columns S is score_S' (information_SS + prior)^-1 score_S
std::vector<Subset> best_subsets(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                                 std::span<const Choice> choices, const SubsetOptions& options);

// ---- Candidates as such a problem ----

/// Form in which a candidate may enter a model.
struct Alternative {
  /// Columns of an amplitude. With an angle there are two, for the angle in `values` and for a quarter turn more: if
  /// the change is proportional to the cosine of its angle, these two span every angle.
  struct Amplitude {
    std::size_t amplitude = 0;         ///< index among the parameters
    std::optional<std::size_t> angle;  ///< index among the parameters
    double step = 0;                   ///< SI, change of the amplitude for one column
  };
  const Candidate* candidate = nullptr;  ///< including its refinements
  std::optional<ModelTerm> refines;      ///< refinement of a term of the model; nullopt: a whole effect
  std::vector<double> values;            ///< values of parameters(): nonlinear ones chosen, amplitudes off
  std::vector<Amplitude> parts;

  /// Parameters of the effect, or of the refinement.
  const std::vector<FreeParameter>& parameters() const {
    return refines ? candidate->refinements()[*refines->refinement].parameters : candidate->free();
  }

  /// "wiggling", "wiggling with amplitude5", or "wiggling.amplitude5" if only the refinement is added.
  std::string name() const;
  /// State with a solution of the linear problem applied. @param columns values of all parts, in order
  State placed(State state, std::span<const double> columns) const;
};

struct Alternatives {
  std::vector<Alternative> list;
  std::vector<Choice> choices;  ///< one per alternative; effects are numbered like the candidates, then refinements
  Group group;                  ///< all columns
  /// Effects that, at all their nonlinear values, make the same change in these conditions as a simpler one.
  std::vector<const Candidate*> repeated = {};
};

/// Alternatives of candidates that are not in a state; those with maps are omitted.
/// @param state to which the changes are made @param refused names to skip, with reasons; failing ones are added
Alternatives alternatives_of(const Problem& problem, const State& state, const Candidates& candidates,
                             std::map<std::string, std::string>& refused);

/// Refinements that the terms of a state lack, and those of `some` whose candidates the state lacks; the changes by the
/// latter are borrowed from it. @param but forms to leave out, with those that contain them
Alternatives alternatives_missing_in(const Problem& problem, const State& state, const Alternatives& some,
                                     std::span<const Candidate* const> but = {});

}  // namespace tofgraph::diagnosis
