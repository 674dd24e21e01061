// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Tables of many scores: requirements over whole suites, and cell by cell, so that no average hides a cell.
#pragma once

#include "tests/hidden_effects/score_verdict.hpp"

namespace tofgraph::hidden {

/// Table of the suites, in Markdown.
std::string table(const std::vector<Score>& scores);

/// Cell of the table: a hidden effect (or its replacement), in one design, at one size.
struct Cell {
  std::string suite, what, design;
  double size = 1;
  std::size_t cases = 0;
  std::size_t right = 0, tie = 0, wrong = 0, unknown = 0, nothing = 0, blind = 0;  ///< exactly one of these per case
  std::size_t false_names = 0;                                                     ///< in all its reports
  std::size_t intervals = 0, intervals_hold = 0;                                   ///< this effect's parameters
  bool disturbed = false;  ///< no effect is hidden, but drift or clutter is: then "unknown" is no error

  /// Cases without an error: right or tied.
  std::size_t good() const { return right + tie + (disturbed ? unknown : 0); }
  /// Their fraction of the cases that the search did not declare blind; NaN if all are.
  double share() const;
};

/// Cells in the order of the scores. A case with several effects counts in the cell of each.
std::vector<Cell> cells_of(const std::vector<Score>& scores);
/// Cell with the smallest fraction, among equal ones that with more wrong names; null if there is none.
const Cell* worst_of(const std::vector<Cell>& cells);

std::string cells_markdown(const std::vector<Score>& scores);
std::string cells_csv(const std::vector<Score>& scores);
/// Intervals that contain the truth, by parameter, in Markdown.
std::string intervals_markdown(const std::vector<Score>& scores);

/// Hidden versus named effects, as the bytes of a PNG. @param scores of single effects
std::string confusion_png(const std::vector<Score>& scores);

}  // namespace tofgraph::hidden
