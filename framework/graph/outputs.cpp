// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/outputs.hpp"

#include "io/output_file.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <vector>

namespace tofgraph::graph {
namespace {

struct Claim {
  const Node* node;
  const char* parameter;
  io::OutputPattern files;
  bool companion = false;  ///< companion file with the same content whichever node writes it
};

/// Canonical path of the folder, with links resolved.
io::OutputPattern resolved(const io::OutputPattern& files) {
  std::error_code error;
  const auto folder = std::filesystem::weakly_canonical(files.folder(), error);
  return error ? files : files.in_folder(folder);
}

std::vector<Claim> claims_of(const Node& node) {
  std::vector<Claim> claims;
  for (std::size_t i = 0; i < node.outputs().size(); ++i) {
    if (node.outputs()[i].text().empty()) continue;
    const tofgraph_parameter& parameter = node.stage().own_parameters[i];
    const io::OutputPattern files = resolved(node.outputs()[i]);
    claims.push_back({&node, parameter.name, files});
    for (const std::string& ending : split_words(parameter.choices))
      claims.push_back({&node, parameter.name, io::OutputPattern::of_file(files.companion(ending)), true});
  }
  return claims;
}

}  // namespace

std::vector<io::OutputPattern> output_files(const Node& node) {
  std::vector<io::OutputPattern> files;
  for (Claim& claim : claims_of(node)) files.push_back(std::move(claim.files));
  return files;
}

std::vector<std::size_t> nodes_with_same_companion(std::span<const std::unique_ptr<Node>> nodes, std::size_t node) {
  std::vector<std::size_t> found;
  const std::vector<Claim> own = claims_of(*nodes[node]);
  for (const auto& other : nodes) {
    if (other->index == node) continue;
    for (const Claim& claim : claims_of(*other)) {
      const auto same = [&](const Claim& c) { return c.companion && claim.companion && c.files.overlaps(claim.files); };
      if (std::ranges::any_of(own, same)) found.push_back(other->index);
    }
  }
  return found;
}

void check_outputs(std::span<const std::unique_ptr<Node>> nodes, config::Diagnostics& diagnostics) {
  std::vector<Claim> all;
  for (const auto& node : nodes) {
    const std::vector<Claim> own = claims_of(*node);
    for (const Claim& claim : own) {
      const auto same = [&](const Claim& other) {
        return other.files.overlaps(claim.files) && !(other.companion && claim.companion);
      };
      const auto found = std::ranges::find_if(all, same);
      const bool taken = found != all.end();
      const Claim other = taken ? *found : claim;
      all.push_back(claim);
      if (!taken) continue;
      diagnostics.error(node->values().position_of(claim.parameter),
                        fmt::format("node '{}' ({}) writes {}, which node '{}' ({}) also writes", node->name,
                                    node->stage().name, claim.files.text(), other.node->name, other.node->stage().name),
                        "give one of the two another name");
      break;
    }
  }
}

}  // namespace tofgraph::graph
