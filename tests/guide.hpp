// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Pages whose commands are run by tests.
#pragma once

#include "tests/program.hpp"

#include <vector>

namespace tofgraph::tests {

/// Shell command blocks of a page, in order.
inline std::vector<std::string> commands_of(const std::filesystem::path& page) {
  const std::string text = read_text(page), begin = "```sh\n", end = "```";
  std::vector<std::string> blocks;
  for (std::size_t at = 0; (at = text.find(begin, at)) != std::string::npos;) {
    at += begin.size();
    blocks.push_back(text.substr(at, text.find(end, at) - at));
  }
  return blocks;
}

}  // namespace tofgraph::tests
