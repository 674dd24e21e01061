// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Series of files that form one recording.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::foreign {

/// Numbers at the end of the file names, e.g. 42 in "depth_0042.png"; empty if the names differ in anything else or the
/// numbers do not increase.
std::vector<std::uint64_t> file_numbers(const std::vector<std::filesystem::path>& files);

/// Files of a series in the natural order of their names: runs of digits compare as numbers.
/// @param patterns one per line: a file, or a name with * and ?
/// @throws ForeignError if no file matches
std::vector<std::filesystem::path> files_of(const std::string& patterns);

}  // namespace tofgraph::foreign
