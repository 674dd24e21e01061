// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file All that candidates could change, linearly: each with a range of its shapes and with some of its refinements.
#pragma once

#include "diagnosis/scan.hpp"
#include "diagnosis/subsets.hpp"

#include <map>
#include <memory>

namespace tofgraph::diagnosis {

/// A way in which a candidate may enter a model.
struct Alternative {
  /// One size. With an angle it has two columns, for the angle as it is in `values` and a quarter of a turn on: where a
  /// change goes with the cosine of its angle, these two make every angle.
  struct Part {
    std::size_t size = 0;              ///< among the free parameters
    std::optional<std::size_t> angle;  ///< likewise
    double step = 0;                   ///< SI: what one column is for
  };
  const Candidate* candidate = nullptr;  ///< with its refinements
  std::vector<double> values;            ///< shapes chosen, sizes where they change nothing
  std::vector<Part> parts;

  /// The term that a solution of the linear problem stands for. @param columns of all parts, in their order
  Term term(std::span<const double> columns) const;
};

struct Alternatives {
  std::vector<Alternative> list;
  std::vector<Choice> choices;  ///< one for each; effects are numbered as the candidates
  Group group;                  ///< all columns
};

/// @param state what the changes are made to; candidates that are in it are left out, as are those with maps
/// @param refused names that are not asked, and why; what fails is added
Alternatives alternatives_of(const Problem& problem, const State& state,
                             const std::vector<std::unique_ptr<Candidate>>& candidates,
                             std::map<std::string, std::string>& refused);

}  // namespace tofgraph::diagnosis
