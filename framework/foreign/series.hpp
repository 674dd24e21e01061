// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Files that together are a recording, one after the other.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::foreign {

/// The number at the end of a file's name, 42 of "depth_0042.png"; nothing where there is none.
std::optional<std::uint64_t> number_of(const std::filesystem::path& file);

/// Files of a series in the natural order of the numbers at the end of their names.
/// @param patterns one a line: a file, or a name with * and ?
/// @throws ForeignError where none matches
std::vector<std::filesystem::path> files_of(const std::string& patterns);

}  // namespace tofgraph::foreign
