// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Undoing a model's effects on distances: which of them, and tables from which a frame is corrected.
#pragma once

#include "io/camera.hpp"
#include "simulation/camera_inverse.hpp"

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::simulation {

/// Treatment of an effect of a model, in words.
struct EffectFate {
  std::string effect;
  bool undone;
  std::string how;  ///< method of correction, or reason for none
};

/// Settings stated by a frame, s, Hz, K, s; NaN: not known.
struct FrameSettings {
  double integration_time = std::numeric_limits<double>::quiet_NaN();
  double modulation_frequency = std::numeric_limits<double>::quiet_NaN();
  double temperature = std::numeric_limits<double>::quiet_NaN();
  double time_since_power_on = std::numeric_limits<double>::quiet_NaN();
};

/// Which of a frame's settings, and whether its amplitude, make a difference to what is undone.
struct CorrectionNeeds {
  bool amplitude = false, integration_time = false, temperature = false, time_since_power_on = false;
};

/// The corrections of all pixels for some settings, compiled: a sum of few products of a pixel's number and a number
/// that is interpolated between nodes of distance and amplitude, correction(pixel, D, a) = sum_r pixel_r node_r(D, a),
/// where D is the measured distance less the shift at its amplitude, within first .. first + range.
/// Tables interpolated in what changes while the camera runs: time since power-on and temperature.
struct CorrectionTables : std::enable_shared_from_this<CorrectionTables> {
  std::size_t lanes = 4;  ///< numbers of a pixel and of a node: the products', 0 for those unused, then sigma's factor
  std::size_t distances = 0, amplitudes = 0;  ///< nodes; amplitudes 1: the amplitude makes no difference
  double first = 0, step = 0, range = 0;      ///< m
  std::vector<float> shifts;                  ///< m, of each amplitude: where range ends and begins again
  double weakest = 0, strongest = 0;          ///< counts, first and last of the amplitude's nodes
  std::vector<float> pixels;                  ///< pixels x lanes, 0 in the last
  std::vector<std::vector<float>> corners;    ///< amplitudes x distances x lanes, see ends
  double worst = 0;                           ///< m: 0, or what the products are off where they are not enough

  CorrectionNeeds needs;
  double integration_time = 0, modulation_frequency = 0;  ///< s, Hz: of these settings alone
  /// First and last time since power-on, s, and temperature, K. The corners: at the first temperature the first and, if
  /// it is another, the last time; then the same at the last temperature, if it is another.
  std::array<std::array<double, 2>, 2> ends{};
  std::array<double, 2> steps{};  ///< so many from one end to the other, which make no difference of more than 2 um

  bool covers(const FrameSettings& settings) const;
  /// The nodes for settings that are covered. Several threads.
  std::shared_ptr<const std::vector<float>> nodes_at(const FrameSettings& settings) const;

 private:
  /// Result of the last interpolation: frames are faster than the warm-up of cameras.
  struct Mixed {
    std::array<double, 2> at{-1, -1};
    std::shared_ptr<const std::vector<float>> nodes;
  };
  mutable std::mutex mutex_;
  mutable Mixed mixed_;
};

/// The amplitude's nodes: so many to each doubling, at equal steps between powers of two.
inline constexpr std::size_t nodes_per_octave = 8;
/// A factor of sigma above this, or below its inverse, is flagged: the distance hardly tells one place from the next.
inline constexpr float steep_factor = 4;

/// A model's effects, to be undone for one camera. Immutable.
class Correction {
 public:
  /// @throws std::invalid_argument a model that cannot be undone: where, and why @throws EffectError
  Correction(const tofgraph_camera& camera, bool physical, const std::vector<EffectPtr>& effects);

  /// The camera as it really is: with the lens, the principal point and the sources that the model knows of. Null where
  /// it is the one given.
  const io::Camera* corrected_camera() const { return changed_ ? camera_.get() : nullptr; }
  std::size_t pixels() const { return pixels_->pixels().size(); }
  const std::vector<EffectFate>& fates() const { return fates_; }
  const CorrectionNeeds& needs() const { return needs_; }

  /// Tables for a frame's settings and those near it. @throws std::exception
  std::shared_ptr<const CorrectionTables> compile(const FrameSettings& settings) const;

  /// Returns whether there are effects of neighbours, which undo_images corrects after the tables.
  bool has_images() const { return images_ != nullptr; }
  /// Goes on from a frame that was corrected by tables, by a fixed point over the image; invalid pixels are dark.
  /// @param measured the frame's distance before that, m; amplitude, counts
  /// @param distance the tables' result, m; becomes that without the light of neighbours
  /// @returns pixels that did not settle
  std::vector<std::uint32_t> undo_images(const FrameSettings& settings, std::span<const float> measured,
                                         std::span<const float> amplitude, std::span<float> distance) const;

 private:
  void choose(bool physical, const std::vector<EffectPtr>& effects);
  void find_needs();
  void require_monotone(bool physical, const std::vector<EffectPtr>& effects) const;
  void find_ends(CorrectionTables& tables, const FrameSettings& settings) const;

  std::shared_ptr<const io::Camera> camera_;
  bool changed_ = false;
  std::vector<EffectFate> fates_;
  CorrectionNeeds needs_;
  std::unique_ptr<const CameraInverse> pixels_;  ///< without effects that look at neighbours
  std::unique_ptr<const CameraInverse> images_;  ///< with them, where some of them can be undone
};

}  // namespace tofgraph::simulation
