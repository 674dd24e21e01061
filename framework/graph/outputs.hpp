// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Comparison of the outputs of a graph's nodes: no two write the same file.
#pragma once

#include "graph/node.hpp"

#include <memory>
#include <span>
#include <vector>

namespace tofgraph::graph {

/// The files that a node may write, and those that stand beside them.
std::vector<io::OutputPattern> output_files(const Node& node);

/// Indices of the other nodes whose files have a companion in common with those of a node: it describes them all.
std::vector<std::size_t> nodes_with_same_companion(std::span<const std::unique_ptr<Node>> nodes, std::size_t node);

/// Reports each node whose output files can have the name of another's; companions may be shared. The files are those
/// of the parameters of kind OUTPUT_FILE, and what stands beside them: the `choices` of such a parameter are the
/// endings of its companions (io::OutputPattern::companion), e.g. ".provenance.json".
void check_outputs(std::span<const std::unique_ptr<Node>> nodes, config::Diagnostics& diagnostics);

}  // namespace tofgraph::graph
