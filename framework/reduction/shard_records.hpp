// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Records of the shards that were reduced into a folder: STATS/shards/I-of-N.json.
#pragma once

#include "config/shard.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::reduction {

/// A reduced condition, and the state of its capture at that time.
struct ReducedCondition {
  std::size_t index = 0;  ///< in the campaign
  std::string id, capture, sha256, key;
  std::uint64_t bytes = 0;
  std::int64_t modified_ns = 0;  ///< compared for equality only, so clocks need not agree
};

struct ShardRecord {
  std::filesystem::path file;      ///< of the record
  std::filesystem::path campaign;  ///< absolute
  std::string campaign_sha256;
  std::size_t conditions = 0;  ///< of the whole campaign
  config::Shard shard;
  std::vector<ReducedCondition> reduced;
};

std::string text_of(const std::vector<ReducedCondition>& reduced);
std::vector<ReducedCondition> reduced_of(const std::string& text);

/// Writes the record of a shard into its folder. @throws std::runtime_error
void write_record(const std::filesystem::path& folder, const ShardRecord& record);

/// All records of a folder, by name. @throws config::ConfigurationError for another version or a damaged one
std::vector<ShardRecord> read_records(const std::filesystem::path& folder);

/// Stores size and modification time of a file in a condition; zeros if the file does not exist.
void set_file_state(const std::filesystem::path& file, ReducedCondition& condition);

/// "2/3, 3/3": shards without a record, of the finest division; empty: none.
std::string missing_shards(std::span<const ShardRecord> records);

}  // namespace tofgraph::reduction
