// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Compiled correction tables that outlive a run: in memory for the process, on disk in the program's cache.
#pragma once

#include "simulation/correction.hpp"

#include <filesystem>
#include <memory>
#include <string>

namespace tofgraph::simulation {

/// Tables of one camera with one model. The folder `corrections` of the cache may be deleted at any time.
class CorrectionCache {
 public:
  /// @param key hash of everything the tables depend on besides the frame's settings: camera, model, code
  explicit CorrectionCache(std::string key);

  /// Tables that cover the settings; null: none are stored. [any thread]
  std::shared_ptr<const CorrectionTables> find(const FrameSettings& settings) const;
  /// Stores tables. If the cache cannot be written, the tables are compiled again next time. [any thread]
  void keep(const std::shared_ptr<const CorrectionTables>& tables) const;

 private:
  std::string key_;
  std::filesystem::path folder_;  ///< folder of these tables; empty: no disk cache
};

/// Serialises and deserialises tables; null: invalid bytes. The checksum at the end covers all of them.
std::string to_bytes(const CorrectionTables& tables);
std::shared_ptr<const CorrectionTables> tables_from_bytes(const std::string& bytes);

}  // namespace tofgraph::simulation
