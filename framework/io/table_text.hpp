// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Tables of comma-separated values (RFC 4180), each cell with its position.
#pragma once

#include "config/diagnostics.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::io {

struct TableCell {
  std::string text;  ///< without quotes; blanks around an unquoted cell are removed
  config::Position at;
};

using TableRow = std::vector<TableCell>;

/// Non-blank rows of a table. Cells may be quoted and then contain commas, line ends and doubled quotes. Any line-end
/// convention is accepted; the byte order mark of UTF-8 is skipped.
/// @throws config::ConfigurationError if the file cannot be read, is UTF-16, or has an unclosed quote
std::vector<TableRow> read_table_rows(const std::filesystem::path& file);

}  // namespace tofgraph::io
