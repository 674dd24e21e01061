// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A folder of statistics: one KEY.stats per condition, a record of each shard that was reduced into it, and, once all
/// shards are there, a campaign.yaml whose captures are these files.
#pragma once

#include "config/shard.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

struct ReduceOptions {
  std::filesystem::path campaign, out;
  config::Shard shard;
  std::function<void(std::size_t done, std::size_t all)> progress;  ///< conditions, from any thread; may be empty
};

/// Number of conditions by what was done for them.
struct ReduceResult {
  std::size_t made = 0;              ///< reduced now
  std::size_t there = 0;             ///< whole before
  std::vector<std::string> damaged;  ///< files that were damaged and made again
  std::vector<std::string> failed;   ///< one message per condition that could not be reduced
  bool complete = false;             ///< campaign.yaml was written: all conditions are there
};

/// Reduces the conditions of a shard, several at a time; what is whole is kept. With the whole campaign in one shard
/// the folder is complete afterwards. Every rank reduces a part of the shard.
/// @throws config::ConfigurationError for mistakes in the campaign or a folder that cannot be written to
ReduceResult reduce_campaign(const ReduceOptions& options);

/// Joins the shards in some folders, checks every file, and writes campaign.yaml into `out`.
/// @returns number of conditions
/// @throws config::ConfigurationError naming the missing shards, a capture or a campaign that has changed since, two
/// shards that disagree
std::size_t merge_statistics(std::span<const std::filesystem::path> folders, const std::filesystem::path& out);

/// The campaign of a folder of statistics; of a file the file itself.
/// @throws config::ConfigurationError for a folder without one, with the shards that are missing
std::filesystem::path campaign_in(const std::filesystem::path& data);

}  // namespace tofgraph::diagnosis
