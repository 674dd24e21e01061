// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Comparison of the output files of a graph's nodes: no two may write the same file.
#pragma once

#include "graph/node.hpp"

#include <memory>
#include <span>
#include <vector>

namespace tofgraph::graph {

/// Files that a node may write, and their companions.
std::vector<io::OutputPattern> output_files(const Node& node);

/// Indices of the other nodes that share a companion file with a node; the companion describes all of their files.
std::vector<std::size_t> nodes_with_same_companion(std::span<const std::unique_ptr<Node>> nodes, std::size_t node);

/// Reports each node whose output files may coincide with another's; companions may be shared. Compared are the files
/// of the parameters of kind OUTPUT_FILE and their companions: the `choices` of such a parameter are the endings of its
/// companions (io::OutputPattern::companion), e.g. ".provenance.json".
void check_outputs(std::span<const std::unique_ptr<Node>> nodes, config::Diagnostics& diagnostics);

}  // namespace tofgraph::graph
