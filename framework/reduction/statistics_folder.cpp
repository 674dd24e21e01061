// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "reduction/statistics_folder.hpp"

#include "config/json_text.hpp"
#include "diagnosis/data/superpixels.hpp"
#include "io/campaign.hpp"
#include "io/captures/campaign_captures.hpp"
#include "io/captures/condition_statistics.hpp"
#include "io/captures/statistics_file.hpp"
#include "io/output_file.hpp"
#include "io/profile.hpp"
#include "io/sha256.hpp"
#include "reduction/shard_records.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <mutex>

namespace tofgraph::reduction {
namespace {

namespace fs = std::filesystem;

constexpr const char* campaign_file = "campaign.yaml";

[[noreturn]] void refuse(const std::string& what, const std::string& hint) {
  throw config::ConfigurationError(fmt::format("error: {}\n         {}", what, hint));
}

fs::path statistics_path(const fs::path& folder, const std::string& key) {
  return folder / (key + io::statistics_extension);
}

/// True for a campaign.yaml written by `merge -o`, which has no records beside it.
bool is_of_statistics(const fs::path& file) {
  config::Diagnostics diagnostics;
  const io::Campaign campaign = io::read_campaign(file, diagnostics, io::Captures::may_be_missing);
  return diagnostics.ok() && std::ranges::all_of(campaign.conditions, [](const io::Condition& c) {
           return c.capture.extension() == io::statistics_extension;
         });
}

/// Rejects a folder whose campaign.yaml cannot be written, is the campaign itself or was not made by reduce.
/// @throws config::ConfigurationError
void check_out(const fs::path& out, const fs::path& campaign) {
  const fs::path file = out / campaign_file;
  const std::array<fs::path, 1> inputs = {campaign};
  std::string problem = io::input_problem(file, inputs);
  if (problem.empty()) problem = io::write_error(file);
  if (problem.empty() && fs::exists(file) && !fs::exists(out / "shards") && !is_of_statistics(file))
    problem = fmt::format("{} is a campaign that was not made by reduce", file.string());
  if (!problem.empty()) throw config::ConfigurationError(fmt::format("--out: error: {}", problem));
}

/// Returns the whole campaign; checks only the captures of one shard.
io::Campaign read_checked(const fs::path& file, const config::Shard& shard) {
  config::Diagnostics diagnostics;
  io::Campaign campaign = io::read_campaign(file, diagnostics, io::Captures::may_be_missing);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  if (campaign.from_table)
    refuse(fmt::format("{} is a table of means, which has no captures to reduce", file.string()),
           "diagnose reads it directly");
  io::Campaign part = campaign;
  part.conditions.clear();
  for (std::size_t i = 0; i < campaign.conditions.size(); ++i) {
    const io::Condition& c = campaign.conditions[i];
    if (!shard.has(i)) continue;
    if (!fs::exists(c.capture))
      diagnostics.error(c.place("capture"), fmt::format("'capture': there is no file {}", c.capture.string()));
    else if (io::is_statistics(c.capture))
      diagnostics.error(c.place("capture"), "'capture': these are already statistics", "give the campaign of captures");
    part.conditions.push_back(c);
  }
  if (diagnostics.ok()) io::check_captures(part, io::CapturesFor::search, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return campaign;
}

/// Asks the system to read a file from the disk meanwhile. Without effect if it cannot.
void read_ahead(const fs::path& file) {
  constexpr off_t step = off_t{128} << 10U;  // Linux cuts each request off at the limit of the device
  const int number = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (number < 0) return;
  const off_t size = lseek(number, 0, SEEK_END);
  for (off_t at = 0; at < size; at += step) posix_fadvise(number, at, step, POSIX_FADV_WILLNEED);
  close(number);
}

/// Reduction of the conditions of one shard into a folder.
class ShardReduction {
 public:
  explicit ShardReduction(const ReduceOptions& options)
      : options_(options), campaign_(read_checked(options.campaign, options.shard)) {
    check_out(options.out, options.campaign);
    record_.campaign = fs::absolute(options.campaign).lexically_normal();
    record_.campaign_sha256 = io::sha256_of_file(options.campaign);
    record_.conditions = campaign_.conditions.size();
    record_.shard = options.shard;
    for (const ShardRecord& before : read_records(options.out)) {
      for (const ReducedCondition& c : before.reduced) known_[c.capture] = c;
      if (options.shard.is_whole() && !before.shard.is_whole()) replaced_.push_back(before.file);
    }
  }

  ReduceResult run() {
    const config::Ranks& ranks = config::ranks();
    if (ranks.rank() == 0) fs::remove(options_.out / campaign_file);  // absent while the statistics change
    std::vector<std::size_t> own;
    std::size_t count = 0;
    for (std::size_t i = 0; i < campaign_.conditions.size(); ++i) {
      if (options_.shard.has(i) && count++ % ranks.size() == ranks.rank()) own.push_back(i);
    }
    std::vector<ReducedCondition> reduced(own.size());
    std::atomic<std::size_t> done = 0;
    constexpr std::size_t ahead = 2;  // conditions: with one the disk waits at times
    tbb::parallel_for(std::size_t{0}, own.size(), [&](std::size_t k) {
      const io::Condition& condition = campaign_.conditions[own[k]];
      if (k + ahead < own.size()) expect(campaign_.conditions[own[k + ahead]]);
      try {
        reduced[k] = reduce_one(own[k]);
      } catch (const std::exception& error) {
        const std::lock_guard lock(mutex_);
        result_.failed.push_back(fmt::format("condition '{}': {}", condition.id, error.what()));
      }
      if (options_.progress) options_.progress(++done, own.size());
    });
    gather_counts();
    std::erase_if(reduced, [](const ReducedCondition& c) { return c.key.empty(); });
    for (const std::string& text : ranks.gather(text_of(reduced)))
      for (ReducedCondition& c : reduced_of(text)) record_.reduced.push_back(std::move(c));
    std::ranges::sort(record_.reduced, {}, &ReducedCondition::index);
    const bool whole = record_.reduced.size() == count;
    if (whole && ranks.rank() == 0) write_record(options_.out, record_);
    result_.complete = whole && options_.shard.is_whole();
    if (result_.complete && ranks.rank() == 0) {
      for (const fs::path& file : replaced_) fs::remove(file);
      const std::vector<fs::path> folders = {options_.out};
      merge_statistics(folders, options_.out);
    }
    return std::move(result_);
  }

 private:
  /// Sums the counts of all ranks; every rank gets the result.
  void gather_counts() {
    const nlohmann::json mine = {
        {"made", result_.made}, {"there", result_.there}, {"damaged", result_.damaged}, {"failed", result_.failed}};
    result_ = {};
    for (const std::string& text : config::ranks().gather(config::json_text(mine))) {
      const nlohmann::json j = nlohmann::json::parse(text);
      result_.made += j["made"].get<std::size_t>();
      result_.there += j["there"].get<std::size_t>();
      for (const auto& file : j["damaged"]) result_.damaged.push_back(file);
      for (const auto& message : j["failed"]) result_.failed.push_back(message);
    }
    std::ranges::sort(result_.damaged);
    std::ranges::sort(result_.failed);
  }

  /// Has the capture of a condition read from the disk, unless it was reduced before.
  void expect(const io::Condition& condition) const {
    if (!known_.contains(fs::absolute(condition.capture).lexically_normal().string())) read_ahead(condition.capture);
  }

  ReducedCondition reduce_one(std::size_t index) {
    const io::Condition& condition = campaign_.conditions[index];
    const fs::path capture = fs::absolute(condition.capture).lexically_normal();
    ReducedCondition one{.index = index, .id = condition.id, .capture = capture.string(), .sha256 = {}, .key = {}};
    set_file_state(capture, one);
    const auto before = known_.find(one.capture);
    const bool same =
        before != known_.end() && before->second.bytes == one.bytes && before->second.modified_ns == one.modified_ns;
    one.sha256 = same ? before->second.sha256 : io::sha256_of_file(capture);
    const auto used =
        condition.frames ? *condition.frames : io::used_frames(condition, io::read_facts(condition).frames);
    one.key = io::sha256_of(io::statistics_settings(one.sha256, used, *campaign_.camera));
    const fs::path file = statistics_path(options_.out, one.key);
    if (is_whole(file)) return one;
    const std::string shown = capture.lexically_proximate(record_.campaign.parent_path()).generic_string();
    const io::Statistics statistics = diagnosis::reduce_capture(condition, *campaign_.camera, shown, one.sha256);
    ReducedCondition now = one;
    set_file_state(capture, now);
    if (now.bytes != one.bytes || now.modified_ns != one.modified_ns)
      throw std::runtime_error(fmt::format("{} changed while it was reduced", capture.string()));
    io::write_statistics(file, statistics);
    const std::lock_guard lock(mutex_);
    ++result_.made;
    return one;
  }

  /// True if the file exists and is complete; a damaged one is recorded.
  bool is_whole(const fs::path& file) {
    if (!fs::exists(file)) return false;
    try {
      io::read_statistics_header(file);
    } catch (const std::runtime_error& error) {
      const std::lock_guard lock(mutex_);
      result_.damaged.push_back(error.what());
      return false;
    }
    const std::lock_guard lock(mutex_);
    ++result_.there;
    return true;
  }

  const ReduceOptions& options_;
  io::Campaign campaign_;
  ShardRecord record_;
  std::map<std::string, ReducedCondition> known_;  ///< captures with known hashes
  std::vector<fs::path> replaced_;                 ///< records of other divisions, replaced by a complete one
  ReduceResult result_;
  std::mutex mutex_;
};

/// Checks records against each other and against their inputs.
class Merge {
 public:
  explicit Merge(std::span<const fs::path> folders) {
    for (const fs::path& folder : folders) {
      if (!fs::is_directory(folder))
        refuse(folder.string() + " is not a folder of statistics", "give a folder written by reduce");
      for (ShardRecord& record : read_records(folder)) records_.push_back(std::move(record));
    }
    if (records_.empty())
      refuse(fmt::format("{} has no shards of statistics", folders.front().string()),
             fmt::format("example: tofgraph reduce campaign.yaml -o {}", folders.front().string()));
    check_campaign();
    collect();
  }

  std::size_t write(const fs::path& out) const {
    check_out(out, records_.front().campaign);
    config::Diagnostics diagnostics;
    io::Campaign campaign = io::read_campaign(records_.front().campaign, diagnostics, io::Captures::may_be_missing);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    if (campaign.conditions.size() != found_.size())
      refuse(fmt::format("{} states {} conditions, the campaign has {}", records_.front().file.string(), found_.size(),
                         campaign.conditions.size()),
             again(records_.front()));
    campaign.camera_name = io::camera_name_in(*campaign.camera_value, out);
    for (const auto& [index, from] : found_) {
      const fs::path source = statistics_path(from.folder, from.condition->key);
      campaign.conditions[index].capture = statistics_path(out, from.condition->key);
      if (!fs::exists(campaign.conditions[index].capture))
        io::write_statistics(campaign.conditions[index].capture, io::read_statistics(source));
    }
    io::write_campaign(campaign, out / campaign_file);
    return found_.size();
  }

 private:
  struct From {
    const ReducedCondition* condition;
    const ShardRecord* record;
    fs::path folder;
  };

  static std::string again(const ShardRecord& record) {
    return fmt::format("tofgraph reduce {} -o {} --shard {}", record.campaign.string(),
                       record.file.parent_path().parent_path().string(), record.shard.text());
  }

  void check_campaign() const {
    const ShardRecord& first = records_.front();
    for (const ShardRecord& r : records_) {
      if (!fs::exists(r.campaign)) refuse(fmt::format("the campaign {} is missing", r.campaign.string()), again(r));
      if (r.campaign_sha256 != io::sha256_of_file(r.campaign))
        refuse(
            fmt::format("the campaign {} has changed since shard {} was reduced", r.campaign.string(), r.shard.text()),
            again(r));
      if (r.campaign_sha256 != first.campaign_sha256 || r.conditions != first.conditions)
        refuse(fmt::format("{} and {} are of different campaigns", first.file.string(), r.file.string()),
               "merge shards of one campaign");
    }
  }

  void collect() {
    for (const ShardRecord& record : records_) {
      const fs::path folder = record.file.parent_path().parent_path();
      for (const ReducedCondition& c : record.reduced) {
        check_capture(c, record);
        const auto [at, added] = found_.try_emplace(c.index, From{&c, &record, folder});
        if (!added && at->second.condition->key != c.key)
          refuse(fmt::format("the shards {} and {} have different statistics of the condition '{}'",
                             at->second.record->file.string(), record.file.string(), c.id),
                 "reduce both again, or remove the shard of the other division");
        check_file(c, record, folder);
      }
    }
    if (found_.size() == records_.front().conditions) return;
    refuse(fmt::format("{} of {} conditions have statistics; missing shards: {}", found_.size(),
                       records_.front().conditions, missing_shards(records_)),
           fmt::format("example: tofgraph reduce {} -o {} --shard {}", records_.front().campaign.string(),
                       records_.front().file.parent_path().parent_path().string(),
                       missing_shards(records_).substr(0, missing_shards(records_).find(','))));
  }

  static void check_capture(const ReducedCondition& c, const ShardRecord& record) {
    ReducedCondition now = c;
    set_file_state(c.capture, now);
    const bool same = now.bytes == c.bytes && now.modified_ns == c.modified_ns;
    if (same || !fs::exists(c.capture) || io::sha256_of_file(c.capture) == c.sha256) return;
    refuse(fmt::format("the capture {} has changed since shard {} was reduced", c.capture, record.shard.text()),
           again(record));
  }

  static void check_file(const ReducedCondition& c, const ShardRecord& record, const fs::path& folder) {
    try {
      if (io::read_statistics_header(statistics_path(folder, c.key)).key == c.key) return;
      throw std::runtime_error(statistics_path(folder, c.key).string() + ": has another key than its name");
    } catch (const std::runtime_error& error) {
      refuse(fmt::format("the statistics of the condition '{}': {}", c.id, error.what()), again(record));
    }
  }

  std::vector<ShardRecord> records_;
  std::map<std::size_t, From> found_;  ///< by index of the condition
};

}  // namespace

ReduceResult reduce_campaign(const ReduceOptions& options) { return ShardReduction(options).run(); }

std::size_t merge_statistics(std::span<const fs::path> folders, const fs::path& out) {
  return Merge(folders).write(out);
}

fs::path campaign_in(const fs::path& data) {
  if (!fs::is_directory(data)) return data;
  if (fs::exists(data / campaign_file)) return data / campaign_file;
  const std::vector<ShardRecord> records = read_records(data);
  if (records.empty())
    refuse(fmt::format("the folder {} has no campaign.yaml", data.string()),
           fmt::format("example: tofgraph reduce campaign.yaml -o {}", data.string()));
  const std::string missing = missing_shards(records);
  refuse(missing.empty() ? fmt::format("the shards of {} are not merged", data.string())
                         : fmt::format("{} lacks the shards {}", data.string(), missing),
         fmt::format("then: tofgraph merge {}", data.string()));
}

}  // namespace tofgraph::reduction
