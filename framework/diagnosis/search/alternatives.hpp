// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file All that candidates could change, linearly: each with a range of its shapes and with some of its refinements.
#pragma once

#include "diagnosis/model/scan.hpp"
#include "diagnosis/search/subsets.hpp"

#include <map>
#include <memory>

namespace tofgraph::diagnosis {

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
