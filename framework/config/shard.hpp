// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Division of long computations: shards are separate runs, ranks are processes of one run (MPI).
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::config {

/// Subset of a list of tasks: every `count`-th one, starting at `index`. The default is the whole list.
struct Shard {
  static constexpr std::size_t max_count = 1000000;
  std::size_t index = 0, count = 1;

  bool has(std::size_t task) const { return task % count == index; }
  bool is_whole() const { return count == 1; }
  /// "2/16", counted from 1.
  std::string text() const;
};

/// Parses a shard like "2/16", counted from 1; an empty text means the whole list.
/// @throws ConfigurationError naming --shard
Shard parse_shard(const std::string& text);

/// Processes of one run.
class Ranks {
 public:
  virtual ~Ranks() = default;
  virtual std::size_t rank() const { return 0; }
  virtual std::size_t size() const { return 1; }
  /// Collects one text from each rank, in rank order, on every rank. All ranks must call it equally often.
  virtual std::vector<std::string> gather(const std::string& mine) const { return {mine}; }
  /// Ends all ranks after a failure of this one.
  virtual void abort(int) const {}
};

/// Ranks of this run: one, unless set_ranks() was called.
const Ranks& ranks();
/// Default number of threads: one per core; with several ranks, one per rank.
unsigned default_threads();
/// Called before any command, and after the last one to restore the default.
void set_ranks(std::unique_ptr<Ranks> ranks);

}  // namespace tofgraph::config
