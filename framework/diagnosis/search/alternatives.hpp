// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Linearised changes that candidates could make, each for several nonlinear values and with some of its
/// refinements.
#pragma once

#include "diagnosis/model/scan.hpp"
#include "diagnosis/search/subsets.hpp"

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

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
  /// Effects that change the same as a simpler one in these conditions, at all their nonlinear values.
  std::vector<const Candidate*> repeated = {};
};

/// Alternatives of candidates that are not in a state; those with maps are omitted.
/// @param state to which the changes are made @param refused names to skip, with reasons; failing ones are added
Alternatives alternatives_of(const Problem& problem, const State& state,
                             const std::vector<std::unique_ptr<Candidate>>& candidates,
                             std::map<std::string, std::string>& refused);

/// Refinements that the terms of a state lack, and those of `some` whose candidates the state lacks; the changes by the
/// latter are borrowed from it.
Alternatives alternatives_missing_in(const Problem& problem, const State& state, const Alternatives& some,
                                     std::span<const Candidate* const> but = {});

}  // namespace tofgraph::diagnosis
