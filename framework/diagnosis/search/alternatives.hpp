// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file All that candidates could change, linearly, each with a range of its shapes and with some of its refinements;
/// and the best sets of these.
#pragma once

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/scan.hpp"

#include <Eigen/Dense>

#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <vector>

namespace tofgraph::diagnosis {

// ---- The best sets of effects of a linearised problem, by enumeration ----

/// A way in which an effect may enter a model: with one value of its nonlinear parameters, with some of its
/// refinements.
struct Choice {
  std::size_t effect = 0;             ///< two choices of one effect are never together in a set
  std::vector<Eigen::Index> columns;  ///< among those of the information
  double dimension = 0;               ///< parameters that it costs, shapes included
};

struct Subset {
  std::vector<std::size_t> choices;  ///< ascending
  double gain = 0;                   ///< of the deviance
  double merit = 0;                  ///< gain less what its parameters cost
  Eigen::VectorXd values;            ///< of its columns, choice after choice
};

struct SubsetOptions {
  std::size_t max_effects = settings.max_set_effects;
  std::size_t kept = settings.kept_sets;  ///< sets of each size above one that are returned, each of other effects
  std::size_t singles = settings.sure_singles;  ///< likewise, of one effect
  double price = 5;                             ///< of a parameter, in deviance: ln of the number of conditions
  double prior = 1e-4;                          ///< added to the diagonal of the information, see prior_width
  std::size_t beam = settings.beam;  ///< sets of one size that are enlarged; with fewer in all, nothing is left out
  /// A set that gains this share of what all columns gain at once, or so much less, is enlarged once and no more.
  double share_of_all = 1, less_than_all = 0;
};

/// The sets of each size with the greatest merit, greatest first; sets of the same effects count once, with their best
/// choices. A set of k effects is one of k - 1 with one more. All pairs are looked at, and all larger sets as long as
/// those of one effect less are fewer than the beam; beyond that only the best of these are enlarged.
/// @param information of all columns, nuisances taken out, and @param score of the residual in them: the gain of
/// columns S is score_S' (information_SS + prior)^-1 score_S
std::vector<Subset> best_subsets(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                                 std::span<const Choice> choices, const SubsetOptions& options = {});

// ---- What candidates could change ----

/// A way in which a candidate may enter a model.
struct Alternative {
  /// Columns of an amplitude. With an angle it has two, for the angle as it is in `values` and a quarter of a turn on:
  /// where a change goes with the cosine of its angle, these two make every angle.
  struct Amplitude {
    std::size_t size = 0;              ///< among the parameters
    std::optional<std::size_t> angle;  ///< likewise
    double step = 0;                   ///< SI: what one column is for
  };
  const Candidate* candidate = nullptr;  ///< with its refinements
  std::optional<ModelTerm> refines;      ///< the refinement of a term that is in the model, else it is a whole effect
  std::vector<double> values;            ///< of parameters(): shapes chosen, sizes where they change nothing
  std::vector<Amplitude> parts;

  /// Parameters of the effect, or of the refinement.
  const std::vector<FreeParameter>& parameters() const {
    return refines ? candidate->refinements()[*refines->refinement].parameters : candidate->free();
  }

  /// "wiggling", "wiggling with amplitude5", or "wiggling.amplitude5" where that alone is added.
  std::string name() const;
  /// A state with what a solution of the linear problem stands for. @param columns of all parts, in their order
  State placed(State state, std::span<const double> columns) const;
};

struct Alternatives {
  std::vector<Alternative> list;
  std::vector<Choice> choices;  ///< one for each; effects are numbered as the candidates, and on for refinements
  Group group;                  ///< all columns
  /// Effects that do what a simpler one does in these conditions, whatever their nonlinear parameters are.
  std::vector<const Candidate*> repeated = {};
};

/// Alternatives of candidates that are not in a state; those with maps are left out.
/// @param state what the changes are made to @param refused names that are not asked, and why; what fails is added
Alternatives alternatives_of(const Problem& problem, const State& state,
                             const std::vector<std::unique_ptr<Candidate>>& candidates,
                             std::map<std::string, std::string>& refused);

/// The refinements that a state's terms do not have, and of some alternatives those whose candidates it does not have:
/// what these change is taken as it was.
Alternatives alternatives_beside(const Problem& problem, const State& state, const Alternatives& some,
                                 std::span<const Candidate* const> but = {});

}  // namespace tofgraph::diagnosis
