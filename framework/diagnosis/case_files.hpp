// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Outcomes of injected cases in files, one a case, so that they can be searched in several runs.
#pragma once

#include "diagnosis/data/ingest.hpp"
#include "diagnosis/search/confidence.hpp"

#include <filesystem>
#include <span>
#include <string>

namespace tofgraph::diagnosis {

/// Files FOLDER/KEY-CASE.json. Those with another key are of other data or options and are ignored.
class CaseFiles {
 public:
  /// @param inputs, options all that the outcome of a case depends on, beside its number
  CaseFiles(std::filesystem::path folder, std::span<const InputFile> inputs, const std::string& options);

  /// Nothing for a case that is not there, or whose file is damaged.
  std::optional<CaseOutcome> load(std::size_t number) const;
  /// Writes the file whole or not at all. @throws std::runtime_error
  void save(std::size_t number, const CaseOutcome& outcome) const;

 private:
  std::filesystem::path path(std::size_t number) const;

  std::filesystem::path folder_;
  std::string key_;
};

}  // namespace tofgraph::diagnosis
