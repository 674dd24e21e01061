// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Some conditions of a campaign as a problem of their own.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <cstddef>
#include <vector>

namespace tofgraph::diagnosis {

/// Some conditions of a design, with nothing of the others.
struct FoldProblem {
  Design design;
  std::vector<Observations> data;
  Problem problem;

  FoldProblem(const Design& whole, const std::vector<Observations>& all, const std::vector<std::size_t>& chosen,
              const Deadline* deadline = nullptr);
  /// With the deadline and the targets of another part, and the targets that are new.
  FoldProblem(const Design& whole, const std::vector<Observations>& all, const std::vector<std::size_t>& chosen,
              const FoldProblem& other);
  /// Fixes the contrast at the value of a fit that estimated it. Fitted to held-out conditions again, it would absorb
  /// other errors in them, such as boards that are not flat. @param log_lower than the profile's
  void fix_contrast(double log_lower);
  FoldProblem(const FoldProblem&) = delete;
  FoldProblem& operator=(const FoldProblem&) = delete;
};

}  // namespace tofgraph::diagnosis
