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
  std::vector<std::string> without;  ///< effects that are no candidates
  std::vector<std::string> skip;     ///< ids of conditions that are left out
  bool skip_missing = false;
  bool other_serial = false;   ///< a model of another device is used, with a warning
  std::size_t confidence = 0;  ///< cases that are injected to learn how often the search is right
  std::size_t resample = 0;    ///< random halves on which effects are chosen again; 0: not at all
  double time_limit = 0;       ///< s; 0: none
  config::Shard shard;         ///< of the cases; a part of them gives no report
  std::filesystem::path
      cases;  ///< folder of cases that were searched before, and into which a shard writes; may be empty
  SearchOptions search;
  std::function<void(double share, const std::string& what)> progress;
  std::function<void(const std::string& text)> warn;  ///< of what may be a mistake and does not stop the search
};

/// Reads, searches, judges. @throws config::ConfigurationError for what is written wrong
/// @throws std::runtime_error for captures that cannot be read
std::unique_ptr<Diagnosis> diagnose(const graph::PluginRegistry& catalogue, const DiagnosisOptions& options);

}  // namespace tofgraph::diagnosis
