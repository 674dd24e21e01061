// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Campaigns with hidden effects, for the test bench of the gap search.
#pragma once

#include "io/condition.hpp"
#include "tests/hidden_effects/plain_camera.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::hidden {

/// Camera and boards of another campaign.
struct Rig {
  Camera camera;
  std::uint64_t seed = 1;  ///< seed of its maps, bad pixels and boards
};

/// Content of a capture: taps, their differences, or decoded images: the distance (m, wrapped to 0 to the unambiguous
/// range) and the amplitude (counts).
enum class Output { taps, phases, distances };

/// Order of measurement: random, as in the design, or random and not stated in the campaign file.
enum class Order { shuffled, designed, unstated };

struct CampaignOptions {
  std::string design = "B";
  std::size_t every = 1;                 ///< only every n-th condition of the design; 1 with `like`
  std::vector<std::string> experiments;  ///< appended to the design
  std::vector<io::Condition> more;       ///< further conditions; reflectivities of their targets are known
  Effects effects;
  std::vector<Pattern> patterns;
  NoiseKind noise = NoiseKind::gaussian;
  Clutter clutter;
  double jitter = 1;        ///< factor on the jitter of the board positions (0.5 mm)
  double light_jitter = 1;  ///< factor on the jitter of the reflectivities (1 %)
  Order order = Order::shuffled;
  Light light = Light::reference;
  Output output = Output::taps;
  std::size_t frames = 4;                      ///< per condition; 0: no captures are written
  std::vector<double> steps = Camera{}.steps;  ///< rad, of the images of a frame; unchanged with `like`
  std::uint64_t seed = 1;
  std::optional<Rig> like;  ///< repeats the campaign with these, at distances between those of the design

  std::uint64_t rig_seed() const { return like ? like->seed : seed; }
  std::size_t threads = 0;  ///< 0: number of cores
  std::filesystem::path folder;
};

/// Writes campaign.yaml with captures/*.h5, model.yaml (known to the search) and truth.yaml (unknown to it); the folder
/// is written completely or not at all. The same options give the same numbers, for any number of threads.
/// @throws std::invalid_argument for an unknown design or experiment
/// @throws std::runtime_error if the folder exists or cannot be written
void make_campaign(const CampaignOptions& options);

/// Maps of fixed_pattern and pixel_response for a seed: pixel, row and column components of a few mm; gains of 2 %,
/// dark levels of a few counts.
PixelMaps draw_maps(const Camera& camera, std::uint64_t seed);

}  // namespace tofgraph::hidden
