// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Correction of distances for the effects of a model: selection of the effects, and tables for correcting frames.
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

/// Treatment of an effect of a model, as text.
struct EffectTreatment {
  std::string effect;
  bool undone;
  std::string how;  ///< correction method, or reason why it is not corrected
};

/// Settings stated by a frame, s, Hz, K, s; NaN: unknown.
struct FrameSettings {
  double integration_time = std::numeric_limits<double>::quiet_NaN();
  double modulation_frequency = std::numeric_limits<double>::quiet_NaN();
  double temperature = std::numeric_limits<double>::quiet_NaN();
  double time_since_power_on = std::numeric_limits<double>::quiet_NaN();
};

/// Settings of a frame, and its amplitude, on which the correction depends.
struct CorrectionNeeds {
  bool amplitude = false, integration_time = false, temperature = false, time_since_power_on = false;
};

/// Compiled corrections of all pixels for some settings: a sum of a few products of a pixel value and a node value
/// that is interpolated over distance and amplitude, correction(pixel, D, a) = sum_r pixel_r node_r(D, a),
/// where D is the measured distance minus the shift at its amplitude, within first .. first + range.
/// Tables are interpolated over the slowly changing quantities: time since power-on and temperature.
struct CorrectionTables : std::enable_shared_from_this<CorrectionTables> {
  std::size_t lanes = 4;  ///< values per pixel and per node: the products, 0 if unused, then the sigma factor
  std::size_t distances = 0, amplitudes = 0;  ///< nodes; amplitudes 1: independent of the amplitude
  double first = 0, step = 0, range = 0;      ///< m
  std::vector<float> shifts;                  ///< m, per amplitude: offset of the range limits
  double weakest = 0, strongest = 0;          ///< counts, first and last amplitude node
  std::vector<float> pixels;                  ///< pixels x lanes, 0 in the last
  std::vector<std::vector<float>> corners;    ///< amplitudes x distances x lanes per corner, see ends
  double worst = 0;                           ///< m: 0, or the error of the products if their number is insufficient

  CorrectionNeeds needs;
  double integration_time = 0, modulation_frequency = 0;  ///< s, Hz: valid for these settings only
  /// First and last time since power-on, s, and temperature, K. Order of the corners: at the first temperature the
  /// first and, if different, the last time; then the same at the last temperature, if different.
  std::array<std::array<double, 2>, 2> ends{};
  std::array<double, 2> steps{};  ///< number of steps from one end to the other, each changes distances by 2 um at most

  bool covers(const FrameSettings& settings) const;
  /// Nodes for settings that are covered. Thread-safe.
  std::shared_ptr<const std::vector<float>> nodes_at(const FrameSettings& settings) const;

 private:
  /// Result of the last interpolation, reused because frames are faster than the warm-up of cameras.
  struct Mixed {
    std::array<double, 2> at{-1, -1};
    std::shared_ptr<const std::vector<float>> nodes;
  };
  mutable std::mutex mutex_;
  mutable Mixed mixed_;
};

/// Amplitude nodes per octave, equally spaced between powers of two.
inline constexpr std::size_t nodes_per_octave = 8;
/// Factor of sigma above which, or below the inverse of which, pixels are flagged: the distance is nearly ambiguous.
inline constexpr float steep_factor = 4;

/// Correction of a model's effects for one camera. Immutable.
class Correction {
 public:
  /// @throws std::invalid_argument for a model that cannot be corrected: where, and why @throws EffectError
  Correction(const tofgraph_camera& camera, bool physical, const std::vector<EffectPtr>& effects);

  /// Camera with the lens, the principal point and the sources according to the model. Null if it equals the given
  /// camera.
  const io::Camera* corrected_camera() const { return changed_ ? camera_.get() : nullptr; }
  std::size_t pixels() const { return pixels_->pixels().size(); }
  const std::vector<EffectTreatment>& treatments() const { return treatments_; }
  const CorrectionNeeds& needs() const { return needs_; }

  /// Tables for a frame's settings and similar ones. @throws std::exception
  std::shared_ptr<const CorrectionTables> compile(const FrameSettings& settings) const;

  /// Returns true if there are effects of neighbouring pixels, which undo_images corrects after the tables.
  bool has_images() const { return images_ != nullptr; }
  /// Continues from a frame corrected by tables, with a fixed-point iteration over the image; invalid pixels are dark.
  /// @param measured the frame's uncorrected distance, m; amplitude, counts
  /// @param distance in: result of the tables, m; out: also without the light of neighbouring pixels
  /// @returns pixels that did not converge
  std::vector<std::uint32_t> undo_images(const FrameSettings& settings, std::span<const float> measured,
                                         std::span<const float> amplitude, std::span<float> distance) const;

 private:
  void choose(bool physical, const std::vector<EffectPtr>& effects);
  void find_needs();
  void require_monotone(bool physical, const std::vector<EffectPtr>& effects) const;
  void find_ends(CorrectionTables& tables, const FrameSettings& settings) const;

  std::shared_ptr<const io::Camera> camera_;
  bool changed_ = false;
  std::vector<EffectTreatment> treatments_;
  CorrectionNeeds needs_;
  std::unique_ptr<const CameraInverse> pixels_;  ///< without effects of neighbouring pixels
  std::unique_ptr<const CameraInverse> images_;  ///< with them, if some of them can be corrected
};

}  // namespace tofgraph::simulation
