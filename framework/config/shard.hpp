// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Division of long work: shards, which are separate runs, and ranks, which are processes of one run (MPI).
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::config {

/// Part of a list of tasks: every `count`-th one, from `index` on. The default is the whole list.
struct Shard {
  static constexpr std::size_t max_count = 1000000;
  std::size_t index = 0, count = 1;

  bool has(std::size_t task) const { return task % count == index; }
  bool is_whole() const { return count == 1; }
  /// "2/16", counted from 1.
  std::string text() const;
};

/// Shard of a text like "2/16", counted from 1; the whole of an empty text.
/// @throws ConfigurationError naming --shard
Shard parse_shard(const std::string& text);

/// The processes of one run.
class Ranks {
 public:
  virtual ~Ranks() = default;
  virtual std::size_t rank() const { return 0; }
  virtual std::size_t size() const { return 1; }
  /// Texts of all ranks in their order, on every rank. All ranks call it the same number of times.
  virtual std::vector<std::string> gather(const std::string& mine) const { return {mine}; }
  /// Ends all ranks after a failure of this one.
  virtual void abort(int) const {}
};

/// The ranks of this run: one, unless set_ranks() was called.
const Ranks& ranks();
/// Threads of a run that states none: one per core; of several ranks one each.
unsigned default_threads();
/// Called before any command, and after the last one with the default.
void set_ranks(std::unique_ptr<Ranks> ranks);

}  // namespace tofgraph::config
