// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Stability of the names: the selection is done again on parts of the conditions.
#pragma once

#include "diagnosis/search/crossfit.hpp"

namespace tofgraph::diagnosis {

/// Runs that each had something else put aside.
struct Stability {
  std::string put_aside;                      ///< each_distance, each_target, any_half
  std::size_t runs = 0;                       ///< those that gave a number
  std::map<std::string, std::size_t> chosen;  ///< runs that added an effect
  CrossFit::Gap gap;                          ///< distance, of what was put aside, m
};

/// Each distance put aside alone; each target; and random halves of the levels (Meinshausen and Buehlmann, Stability
/// selection, 2010: halves without replacement vary as a bootstrap does, and no condition stands for a repetition of
/// itself). What could not be put aside is left out.
/// @param halves how many of them
std::vector<Stability> stability(const Problem& problem, const std::vector<Term>& model,
                                 const std::vector<std::unique_ptr<Candidate>>& candidates, std::size_t halves,
                                 const SearchOptions& options);

}  // namespace tofgraph::diagnosis
