// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Trial reading of untrusted files in a process of its own. HDF5 does not validate its input: on damaged files
/// it can crash, loop or request any amount of memory, and an error code cannot report that.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Runs a trial (config::trial_program() and its arguments): a program that writes the problem with the file to its
/// standard output.
/// @throws std::runtime_error with that text, or stating that the program crashed or timed out
void run_trial(std::vector<std::string> command);

/// Kind of the trial that reads a file as a capture.
inline constexpr const char* capture_trial = "capture";

/// Like run_trial(), but skipped if the file has passed a trial of this kind before and is unchanged.
/// @param kind name; trials of one kind and file have the same command
void run_trial_once(const std::filesystem::path& file, const std::string& kind, std::vector<std::string> command);

/// Tries many captures with few processes, so that run_trial_once() skips those that pass. Problems with the others
/// are reported when they are read.
void try_ahead(const std::vector<std::filesystem::path>& files);

}  // namespace tofgraph::io
