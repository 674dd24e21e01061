// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "reduction/shard_records.hpp"

#include "config/diagnostics.hpp"
#include "config/json_text.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <set>

namespace tofgraph::reduction {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ReducedCondition, index, id, capture, bytes, modified_ns, sha256, key)

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* record_format = "tofgraph-statistics-shard";
constexpr int record_version = 1;

ShardRecord read_record(const fs::path& file) {
  const auto fail = [&](const std::string& what) {
    throw config::ConfigurationError(
        fmt::format("{}: error: {}\n         reduce this shard again", file.string(), what));
  };
  ShardRecord record{.file = file, .campaign = {}, .campaign_sha256 = {}, .shard = {}, .reduced = {}};
  try {
    std::ifstream stream(file);
    const json j = json::parse(stream);
    if (j.at("format") != record_format) fail("is not the record of a shard");
    if (j.at("version") != record_version)
      fail(fmt::format("is of version {}, this program reads version {}", j.at("version").dump(), record_version));
    record.campaign = j.at("campaign").get<std::string>();
    record.campaign_sha256 = j.at("campaign_sha256");
    record.conditions = j.at("conditions");
    const auto number = j.at("shard").get<std::int64_t>(), shards = j.at("shards").get<std::int64_t>();
    if (number < 1 || number > shards || shards > std::int64_t{config::Shard::max_count})
      fail(fmt::format("states the shard {} of {}", number, shards));
    record.shard = {static_cast<std::size_t>(number - 1), static_cast<std::size_t>(shards)};
    j.at("reduced").get_to(record.reduced);
    for (const ReducedCondition& c : record.reduced)
      if (c.index >= record.conditions) fail(fmt::format("has condition {} of {}", c.index, record.conditions));
  } catch (const json::exception& error) {
    fail(fmt::format("cannot be read: {}", error.what()));
  }
  return record;
}

}  // namespace

std::string text_of(const std::vector<ReducedCondition>& reduced) { return config::json_text(reduced); }
std::vector<ReducedCondition> reduced_of(const std::string& text) { return json::parse(text); }

void write_record(const fs::path& folder, const ShardRecord& record) {
  const json j = {{"format", record_format},
                  {"version", record_version},
                  {"campaign", record.campaign.string()},
                  {"campaign_sha256", record.campaign_sha256},
                  {"conditions", record.conditions},
                  {"shard", record.shard.index + 1},
                  {"shards", record.shard.count},
                  {"reduced", record.reduced}};
  const std::string name = fmt::format("{}-of-{}.json", record.shard.index + 1, record.shard.count);
  io::write_file(folder / "shards" / name, config::json_text(j, 1) + "\n");
}

std::vector<ShardRecord> read_records(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder / "shards", error))
    if (entry.path().extension() == ".json" && entry.path().filename().string().front() != '.')
      files.push_back(entry.path());
  std::ranges::sort(files);
  std::vector<ShardRecord> records;
  for (const fs::path& file : files) records.push_back(read_record(file));
  return records;
}

void set_file_state(const fs::path& file, ReducedCondition& condition) {
  struct stat state {};
  if (stat(file.c_str(), &state) != 0) state = {};
  condition.bytes = static_cast<std::uint64_t>(state.st_size);
  condition.modified_ns = std::int64_t{state.st_mtim.tv_sec} * 1'000'000'000 + state.st_mtim.tv_nsec;
}

std::string missing_shards(std::span<const ShardRecord> records) {
  std::size_t count = 0;
  for (const ShardRecord& r : records) count = std::max(count, r.shard.count);
  std::set<std::size_t> there;
  for (const ShardRecord& r : records)
    if (r.shard.count == count) there.insert(r.shard.index);
  std::string text;
  for (std::size_t i = 0; i < count; ++i)
    if (!there.contains(i)) text += fmt::format("{}{}/{}", text.empty() ? "" : ", ", i + 1, count);
  return text;
}

}  // namespace tofgraph::reduction
