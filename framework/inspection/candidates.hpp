// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Assumptions under which the planes of a recording become flat, in the order of how well they explain it.
#pragma once

#include "inspection/flatness.hpp"

namespace tofgraph::inspection {

/// An assumption that differs from what is stated.
struct Candidate {
  std::string kind;      ///< channel, lens_sign, lens_missing, lens_superfluous, orientation, focal_length, zero_offset
  std::string question;  ///< that it answers: channel, lens, orientation, focal_length, zero_offset
  Assumption assumption;
  Flatness flatness;
  std::size_t parameters = 0;  ///< that were fitted

  /// Lower is better: misfit and what each fitted number costs.
  double score() const { return flatness.chi2 + 10 * static_cast<double>(parameters); }
};

/// All candidates, the best first; of equals the simplest first.
std::vector<Candidate> candidates_of(const FlatnessTest& test, double scale);

}  // namespace tofgraph::inspection
