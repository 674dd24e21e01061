// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Files that together are a recording, one after the other.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::foreign {

/// Numbers at the end of the files' names, 42 of "depth_0042.png"; empty where names differ in more than this number or
/// the numbers do not rise.
std::vector<std::uint64_t> file_numbers(const std::vector<std::filesystem::path>& files);

/// Files of a series in the natural order of their names: runs of digits are numbers.
/// @param patterns one a line: a file, or a name with * and ?
/// @throws ForeignError where none matches
std::vector<std::filesystem::path> files_of(const std::string& patterns);

}  // namespace tofgraph::foreign
