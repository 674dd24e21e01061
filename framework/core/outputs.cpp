// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "core/outputs.hpp"

#include "io/output_file.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <vector>

namespace tofgraph::core {
namespace {

struct Claim {
  const Node* node;
  const char* parameter;
  io::OutputPattern files;
};

/// The folder by its one name, whatever links lead to it.
std::string resolved(const std::filesystem::path& path) {
  std::error_code error;
  const auto folder = std::filesystem::weakly_canonical(path.parent_path(), error);
  return error ? path.string() : (folder / path.filename()).string();
}

void add_claims(const Node& node, const tofgraph_parameter& parameter, const char* path, std::vector<Claim>& claims) {
  io::OutputPattern pattern;
  try {
    pattern = io::OutputPattern(resolved(path));
  } catch (const std::exception&) {
    return;  // the stage refuses it, or knows a grammar of its own
  }
  claims.push_back({&node, parameter.name, pattern});
  for (const std::string& ending : split_words(parameter.choices))
    claims.push_back({&node, parameter.name, io::OutputPattern(pattern.companion(ending).string())});
  // A sink of one file a frame numbers the files where more than one frame may come.
  if (!pattern.numbered() && node.output().frames != 1)
    claims.push_back({&node, parameter.name, pattern.with_number()});
}

std::vector<Claim> claims_of(const Node& node) {
  std::vector<Claim> claims;
  const tofgraph_descriptor& stage = node.stage();
  for (std::uint64_t i = 0; i < stage.parameter_count; ++i) {
    const char* path = node.values().data()[i].text;
    if (stage.parameters[i].kind == TOFGRAPH_OUTPUT_FILE && *path != 0)
      add_claims(node, stage.parameters[i], path, claims);
  }
  return claims;
}

}  // namespace

void check_outputs(std::span<const std::unique_ptr<Node>> nodes, Diagnostics& diagnostics) {
  std::vector<Claim> all;
  for (const auto& node : nodes) {
    const std::vector<Claim> own = claims_of(*node);
    for (const Claim& claim : own) {
      const auto same = [&](const Claim& other) { return other.files.overlaps(claim.files); };
      const auto other = std::ranges::find_if(all, same);
      if (other == all.end()) continue;
      diagnostics.error(
          node->values().position_of(claim.parameter),
          fmt::format("node '{}' ({}) writes {}, which node '{}' ({}) writes too", node->name, node->stage().name,
                      claim.files.text(), other->node->name, other->node->stage().name),
          "give one of the two another name");
      break;
    }
    all.insert(all.end(), own.begin(), own.end());
  }
}

}  // namespace tofgraph::core
