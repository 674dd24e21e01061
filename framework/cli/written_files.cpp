// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/written_files.hpp"

#include "graph/outputs.hpp"

#include <fmt/format.h>

namespace tofgraph::cli {
namespace fs = std::filesystem;

WrittenFiles::WrittenFiles(const graph::Graph& graph) {
  std::error_code error;
  for (const auto& node : graph.nodes()) {
    for (const io::OutputPattern& pattern : graph::output_files(*node)) {
      for (const fs::path& file : pattern.members()) before_[file] = fs::last_write_time(file, error);
    }
  }
}

bool WrittenFiles::is_new(const fs::path& file) const {
  std::error_code error;
  const auto there = before_.find(file);
  return there == before_.end() || there->second != fs::last_write_time(file, error);
}

std::vector<fs::path> WrittenFiles::of(const graph::Node& node) const {
  std::vector<fs::path> written;
  for (const io::OutputPattern& pattern : graph::output_files(node)) {
    for (fs::path& file : pattern.members()) {
      if (is_new(file)) written.push_back(std::move(file));
    }
  }
  return written;
}

std::string WrittenFiles::summary(const graph::Graph& graph) const {
  std::vector<fs::path> all;
  for (const auto& node : graph.nodes()) {
    for (fs::path& file : of(*node)) all.push_back(std::move(file));
  }
  if (all.empty()) return {};
  const auto name = [](const fs::path& file) { return fs::proximate(file).string(); };
  if (all.size() == 1) return fmt::format("wrote 1 file: {}", name(all.front()));
  return fmt::format("wrote {} files: {} ... {}", all.size(), name(all.front()), name(all.back()));
}

std::string WrittenFiles::older(const io::OutputPattern& pattern) const {
  std::vector<std::string> older;
  if (!pattern.numbered()) return {};
  for (const fs::path& file : pattern.members()) {
    if (!is_new(file)) older.push_back(file.filename().string());
  }
  if (older.empty()) return {};
  const std::string last = older.size() == 1 ? "" : fmt::format(" to {} ({} files)", older.back(), older.size());
  return fmt::format("older files of this series remain: {}{}", older.front(), last);
}

}  // namespace tofgraph::cli
