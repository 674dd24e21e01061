// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Some conditions of a campaign as a problem of their own.
#pragma once

#include "diagnosis/fit.hpp"

#include <cstddef>
#include <vector>

namespace tofgraph::diagnosis {

/// Some conditions of a design, with nothing of the others.
struct Part {
  Design design;
  std::vector<Observations> data;
  Problem problem;

  Part(const Design& whole, const std::vector<Observations>& all, const std::vector<std::size_t>& chosen,
       const Deadline& deadline = {});
  /// With the deadline and the targets of another part, and the targets that are new.
  Part(const Design& whole, const std::vector<Observations>& all, const std::vector<std::size_t>& chosen,
       const Part& other);
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;
};

}  // namespace tofgraph::diagnosis
