// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The gap search from files to a result: `tofgraph diagnose`.
#pragma once

#include "diagnosis/report/diagnosis.hpp"
#include "graph/plugin.hpp"

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

struct DiagnosisOptions {
  std::filesystem::path model, data;
  std::vector<std::string> exclude_effects;     ///< not candidates
  std::vector<std::string> exclude_conditions;  ///< ids
  bool skip_missing = false;
  std::size_t max_conditions = settings.max_conditions;  ///< that are searched; the others are only predicted
  bool other_serial = false;                             ///< a model of another device is accepted, with a warning
  std::size_t confidence = 0;     ///< number of injected cases that estimate how often the search is right
  std::size_t random_halves = 0;  ///< that are searched; 0: only without repeated measurements
  double time_limit = 0;          ///< s; 0: none
  config::Shard shard;            ///< of the cases; a partial shard writes no report
  std::filesystem::path cases;    ///< folder of reused cases, to which a shard adds its own; may be empty
  SearchOptions search;
  std::function<void(double share, const std::string& what)> progress;
  std::function<void(const std::string& text)> warn;  ///< for possible mistakes that do not stop the search
};

/// Reads, searches and judges. @throws config::ConfigurationError for errors in the user's files or options
/// @throws std::runtime_error if captures cannot be read
std::unique_ptr<Diagnosis> diagnose(const graph::PluginRegistry& catalogue, const DiagnosisOptions& options);

}  // namespace tofgraph::diagnosis
