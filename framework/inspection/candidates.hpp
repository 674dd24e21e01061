// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Assumptions under which the planes of a recording become flat, sorted by misfit.
#pragma once

#include "inspection/flatness.hpp"

namespace tofgraph::inspection {

/// Assumption that differs from the stated one.
struct Candidate {
  std::string kind;      ///< channel, channel_and_lens, lens_sign, lens_missing, lens_superfluous, orientation,
                         ///< focal_length, zero_offset
  std::string question;  ///< question it answers: channel, lens, orientation, focal_length, zero_offset
  Assumption assumption;
  Flatness flatness;
  std::size_t parameters = 0;  ///< number of fitted parameters

  bool joint = false;  ///< of two statements

  /// Chi-square plus 10 per fitted parameter and 25 for a second statement; lower is better.
  double score() const { return flatness.chi2 + 10 * static_cast<double>(parameters) + (joint ? 25 : 0); }
};

/// All candidates, best first; simplest first among equals.
std::vector<Candidate> candidates_of(const FlatnessTest& test, double scale);

}  // namespace tofgraph::inspection
