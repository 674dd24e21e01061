// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Some conditions of a campaign as a problem of their own.
#pragma once

#include "diagnosis/fit.hpp"

#include <cstddef>
#include <vector>

namespace tofgraph::diagnosis {

/// Some conditions of a design, with nothing of the others.
struct FoldProblem {
  Design design;
  std::vector<Observations> data;
  Problem problem;

  FoldProblem(const Design& whole, const std::vector<Observations>& all, const std::vector<std::size_t>& chosen,
              const Deadline& deadline = {});
  /// With the deadline and the targets of another part, and the targets that are new.
  FoldProblem(const Design& whole, const std::vector<Observations>& all, const std::vector<std::size_t>& chosen,
              const FoldProblem& other);
  FoldProblem(const FoldProblem&) = delete;
  FoldProblem& operator=(const FoldProblem&) = delete;
};

}  // namespace tofgraph::diagnosis
