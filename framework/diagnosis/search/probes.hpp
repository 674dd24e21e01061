// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Changes that each candidate would make, before any is fitted.
#pragma once

#include "diagnosis/model/scan.hpp"

#include <map>
#include <memory>

namespace tofgraph::diagnosis {

/// A candidate, or a refinement of a term that is in the model, with shapes at which its sizes are scored.
struct Probe {
  const Candidate* candidate = nullptr;  ///< of a refinement the one that has it
  ModelTerm piece;                       ///< of a refinement: the term that gets it
  std::vector<double> values;
  std::vector<std::size_t> amplitudes;  ///< the parameters that the columns of its group stand for
  std::vector<double> steps;            ///< of these, SI: what one column is for

  /// Those that `values` are of.
  const std::vector<FreeParameter>& parameters() const {
    return piece.refinement ? candidate->refinements()[*piece.refinement].parameters : candidate->free();
  }
  /// A state with it. @param chosen values of its parameters
  State placed(State state, std::span<const double> chosen) const;
};

/// Probes and their columns: the change that a typical step of each size makes. A whole step and not a derivative,
/// for some effects begin with the square of their size.
struct Probes {
  std::vector<Probe> list;
  std::vector<Group> groups;
  std::map<std::string, std::string> refused;  ///< candidates that cannot be used, and why
};

/// @param state what the changes are made to; candidates that are in it are left out
Probes probes_of(const Problem& problem, const State& state, const std::vector<std::unique_ptr<Candidate>>& candidates,
                 NonlinearRange range = NonlinearRange::any);

/// Probes of the refinements that the terms of a state do not have. Those that give no number are left out.
Probes refinement_probes(const Problem& problem, const State& state);

/// True if a state has an effect of this name.
bool is_in(const State& state, const Candidate& candidate);

}  // namespace tofgraph::diagnosis
