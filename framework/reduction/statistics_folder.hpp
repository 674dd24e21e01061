// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A folder of statistics: one KEY.stats per condition, a record of each reduced shard, and, once all shards are
/// reduced, a campaign.yaml whose captures are these files.
#pragma once

#include "config/shard.hpp"

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::reduction {

struct ReduceOptions {
  std::filesystem::path campaign, out;
  config::Shard shard;
  std::function<void(std::size_t done, std::size_t all)> progress;  ///< of conditions; from any thread; may be empty
};

/// Numbers of conditions by outcome.
struct ReduceResult {
  std::size_t made = 0;              ///< reduced now
  std::size_t there = 0;             ///< complete before
  std::vector<std::string> damaged;  ///< damaged files that were made again
  std::vector<std::string> failed;   ///< one message per condition that could not be reduced
  bool complete = false;             ///< campaign.yaml was written: all conditions have statistics
};

/// Reduces the conditions of a shard, several at a time, and keeps complete statistics. If one shard is the whole
/// campaign, the folder is then complete. Each rank reduces a part of the shard.
/// @throws config::ConfigurationError for errors in the campaign, or if the folder cannot be written
ReduceResult reduce_campaign(const ReduceOptions& options);

/// Joins the shards in several folders, checks every file, and writes campaign.yaml into `out`.
/// @returns number of conditions
/// @throws config::ConfigurationError naming missing shards, a changed capture or campaign, or two shards that
/// contradict each other
std::size_t merge_statistics(std::span<const std::filesystem::path> folders, const std::filesystem::path& out);

/// Campaign of a folder of statistics; a path that is not a folder is returned unchanged.
/// @throws config::ConfigurationError for a folder without campaign.yaml, naming the missing shards
std::filesystem::path campaign_in(const std::filesystem::path& data);

}  // namespace tofgraph::reduction
