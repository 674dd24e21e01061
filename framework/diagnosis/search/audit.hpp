// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Effects that a design can reveal, determined without any residual.
#pragma once

#include "diagnosis/model/scan.hpp"

#include <memory>

namespace tofgraph::diagnosis {

struct Visibility {
  const Candidate* candidate = nullptr;
  double norm = 0;  ///< norm of the signature at the typical value, in standard deviations
  /// Smallest detectable size over the typical value: enough standard deviations, and in some condition at least
  /// practical_threshold. For an effect with several amplitudes the most visible one counts.
  double smallest = 0;
  bool blind = false;  ///< at its typical value too few standard deviations, or too small a change
};

/// Two effects whose signatures this design hardly distinguishes.
struct Alike {
  const Candidate *first = nullptr, *second = nullptr;
  double cosine = 0;  ///< largest principal cosine
};

struct Audit {
  std::vector<Visibility> effects;
  std::vector<Alike> alike;
};

/// @param model terms of the model; their candidates are skipped
Audit audit(const Problem& problem, const std::vector<Term>& model,
            const std::vector<std::unique_ptr<Candidate>>& candidates);

}  // namespace tofgraph::diagnosis
