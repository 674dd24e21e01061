// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Candidates of a search, for test bench programs that use framework/diagnosis directly.
#pragma once

#include "diagnosis/model/candidate.hpp"
#include "graph/plugin.hpp"

#include <memory>
#include <string>
#include <vector>

namespace tofgraph::hidden {

/// All effects on the plugin path except one. @param without its name; "" excludes none
inline diagnosis::Candidates candidates_but(const std::string& without) {
  const graph::PluginRegistry catalogue(graph::plugin_path({}));
  diagnosis::Candidates candidates;
  for (const graph::PluginFile& file : catalogue.files())
    if (file.kind == "effect" && file.name != without)
      candidates.push_back(std::make_unique<diagnosis::Candidate>(catalogue.load(file)));
  return candidates;
}

}  // namespace tofgraph::hidden
