// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph reduce` and `tofgraph merge`, implemented in reduce_module.cpp.
#pragma once

#include <string>
#include <vector>

namespace tofgraph::cli {

struct ReduceArguments {
  std::string campaign, out, shard;
  std::vector<std::string> folders;  ///< for merge; empty: reduce
  unsigned threads = 0;              ///< 0: one per core
  bool quiet = false;
};

}  // namespace tofgraph::cli
