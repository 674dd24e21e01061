// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Campaigns with something hidden in them, for the test bench of the gap search.
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
  std::uint64_t seed = 1;  ///< that its maps, bad pixels and boards were drawn from
};

/// Content of a capture: taps, their differences, or decoded images: the distance (m, from 0 to the unambiguous range,
/// as it comes out) and the amplitude (counts).
enum class Output { taps, phases, distances };

/// Order of measurement: a random one, that of the design, or a random one that the campaign file does not state.
enum class Order { shuffled, designed, unstated };

struct CampaignOptions {
  std::string design = "B";
  std::size_t every = 1;                 ///< each so-many-th condition of the design alone; no other with `like`
  std::vector<std::string> experiments;  ///< appended to the design
  std::vector<io::Condition> more;       ///< these, too; what their targets reflect is known from the others
  Effects effects;
  std::vector<Pattern> patterns;
  NoiseKind noise = NoiseKind::gaussian;
  Clutter clutter;
  double jitter = 1;        ///< factor on that of the boards' places (0.5 mm)
  double light_jitter = 1;  ///< factor on that of the reflectivities (1 %)
  Order order = Order::shuffled;
  Light light = Light::reference;
  Output output = Output::taps;
  std::size_t frames = 4;                      ///< per condition; 0: no captures are written
  std::vector<double> steps = Camera{}.steps;  ///< rad, of the images of a frame; no others with `like`
  std::uint64_t seed = 1;
  std::optional<Rig> like;  ///< measured once more with these, at distances between those of the design

  std::uint64_t rig_seed() const { return like ? like->seed : seed; }
  std::size_t threads = 0;  ///< 0: as many as there are cores
  std::filesystem::path folder;
};

/// Writes campaign.yaml with captures/*.h5, model.yaml (what a search is told) and truth.yaml (what it is not); the
/// folder appears whole or not at all. The same options give the same numbers, whatever the number of threads.
/// @throws std::invalid_argument for a design or experiment that is not there
/// @throws std::runtime_error when the folder exists or cannot be written
void make_campaign(const CampaignOptions& options);

/// The maps of fixed_pattern and pixel_response that a seed gives: pixel, row and column parts of a few mm; gains of
/// 2 %, dark levels of some counts.
PixelMaps draw_maps(const Camera& camera, std::uint64_t seed);

}  // namespace tofgraph::hidden
