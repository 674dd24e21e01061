// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Effects that a design can show, before any residual is looked at.
#pragma once

#include "diagnosis/model/scan.hpp"

#include <memory>

namespace tofgraph::diagnosis {

struct Visibility {
  const Candidate* candidate = nullptr;
  double norm = 0;       ///< of the signature at the typical size, in standard deviations
  std::size_t rank = 0;  ///< parameters that the design determines
  /// Share of the typical size that would be found: enough standard deviations, and in some condition as much as
  /// matters (practical_threshold). Of an effect with several sizes the one that shows best counts for each.
  double smallest = 0;
  bool blind = false;  ///< at its typical size it shows in too few standard deviations, or changes too little
};

/// Two effects whose signatures this design hardly tells apart.
struct Alike {
  const Candidate *first = nullptr, *second = nullptr;
  double cosine = 0;  ///< largest principal cosine
};

struct Audit {
  std::vector<Visibility> effects;
  std::vector<Alike> alike;
};

/// @param model terms that are in the model; their candidates are not looked at
Audit audit(const Problem& problem, const std::vector<Term>& model,
            const std::vector<std::unique_ptr<Candidate>>& candidates);

}  // namespace tofgraph::diagnosis
