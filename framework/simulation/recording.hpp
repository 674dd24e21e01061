// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Simulated frames as captures and campaigns.
#pragma once

#include "config/shard.hpp"
#include "simulation/simulation.hpp"

#include <filesystem>
#include <functional>

namespace tofgraph::simulation {

struct RecordingOptions {
  bool truth = false;  ///< adds noise-free depth, points (`applied`: truth) and reflectivity
  bool overwrite = false;
  int compression = 0;
  config::Shard shard;               ///< part of the conditions; existing captures of the same scene are kept
  std::function<void()> frame_done;  ///< from any thread; may be empty
};

/// Records one condition. Memory does not depend on the number of frames. @throws std::exception
void record(const Simulation& simulation, std::size_t condition, const std::filesystem::path& capture,
            const RecordingOptions& options);

/// Records all conditions, several at a time, into a folder: captures/, the scenes of conditions that are not a single
/// board, and finally campaign.yaml. With several shards, the last one to finish writes campaign.yaml.
/// @throws std::exception
void record_campaign(const Simulation& simulation, const std::filesystem::path& folder,
                     const RecordingOptions& options);

}  // namespace tofgraph::simulation
