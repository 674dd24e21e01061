// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Frequency with which a search is right on this very design: truths are injected and searched for.
#pragma once

#include "diagnosis/search/audit.hpp"
#include "diagnosis/search/search.hpp"

namespace tofgraph::diagnosis {

struct Confidence {
  std::size_t named = 0, named_right = 0;    ///< searches that named an effect; rightly, ties counted
  std::size_t silent = 0, silent_right = 0;  ///< that found nothing; where nothing was
  std::size_t cases() const { return named + silent; }
};

/// Injects, in turn, nothing and each effect that the audit calls visible at its typical size, with the noise, jitter
/// and light that were estimated, and searches.
/// @param found the state whose reflectivities and variances are taken; what it has beyond the model is not injected
Confidence confidence(const Problem& problem, const std::vector<Term>& model,
                      const std::vector<std::unique_ptr<Candidate>>& candidates, const Audit& audit, const State& found,
                      std::size_t cases, SearchOptions options);

}  // namespace tofgraph::diagnosis
