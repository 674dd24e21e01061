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
  bool truth = false;  ///< adds depth, points (`applied`: truth) and reflectivity, without error
  bool overwrite = false;
  int compression = 0;
  config::Shard shard;  ///< of the conditions; a part keeps captures that are there and were made of the same scene
  std::function<void()> frame_done;  ///< from any thread; may be empty
};

/// Records one condition. Memory does not depend on the number of frames. @throws std::exception
void record(const Simulation& simulation, std::size_t condition, const std::filesystem::path& capture,
            const RecordingOptions& options);

/// Records every condition, several at a time, into a folder: captures/, campaign.yaml, which comes last, and for
/// conditions that are not a single board their scenes. Of several shards the one that ends last writes campaign.yaml.
/// @throws std::exception
void record_campaign(const Simulation& simulation, const std::filesystem::path& folder,
                     const RecordingOptions& options);

}  // namespace tofgraph::simulation
