// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Tables of comma-separated values (RFC 4180), each cell with its place.
#pragma once

#include "config/diagnostics.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::io {

struct TableCell {
  std::string text;  ///< without quotes; blanks around an unquoted cell are left out
  config::Position at;
};

using TableRow = std::vector<TableCell>;

/// The rows of a table that are not blank. Cells may be quoted: commas, line ends and doubled quotes belong to the text
/// then. Lines end as on any system; the byte order mark of UTF-8 is skipped.
/// @throws config::ConfigurationError when the file cannot be read, is UTF-16, or has a quote that is not closed
std::vector<TableRow> read_table_rows(const std::filesystem::path& file);

}  // namespace tofgraph::io
