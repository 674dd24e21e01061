// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The files that a diagnosis has read, with what they contained.
#pragma once

#include "io/campaign.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

struct InputFile {
  std::string file;    ///< as it was given; captures relative to the campaign's folder
  std::string sha256;  ///< hexadecimal
};

/// The model, the campaign, its table or its captures; each once, without those that are missing.
/// @throws std::runtime_error when one cannot be read
std::vector<InputFile> hashed_inputs(const std::filesystem::path& model, const std::filesystem::path& data,
                                     const std::vector<io::Condition>& conditions);

}  // namespace tofgraph::diagnosis
