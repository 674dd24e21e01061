// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Files that nobody vouches for, read where a crash does no harm. HDF5 trusts what it reads: on damaged files it
/// can crash, loop or ask for any amount of memory, and an error code cannot tell.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Runs a trial (config::trial_program() and its arguments): a program that writes to its standard output what is wrong
/// with the file.
/// @throws std::runtime_error with that text, or saying that the program crashed or came to no end
void run_trial(std::vector<std::string> command);

/// As run_trial(), but not again where the file has passed and is as it was then.
/// @param command which reads the file, and is the same for it each time
void run_trial_once(const std::filesystem::path& file, std::vector<std::string> command);

/// Tries many captures with few programs: for those that pass run_trial_once() has nothing left to do. Of the others it
/// is for the one who reads them to say what is wrong.
void try_ahead(const std::vector<std::filesystem::path>& files);

}  // namespace tofgraph::io
