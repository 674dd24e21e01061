// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Frames of one condition: sums over each pixel, from its capture or from a statistics file made from it,
/// reduced to superpixels relative to the ideal camera.
#pragma once

#include "diagnosis/data/observables.hpp"
#include "io/camera.hpp"
#include "io/captures/statistics_file.hpp"
#include "io/condition.hpp"

#include <tofgraph/physics/four_phase.hpp>

#include <complex>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

// ---- Phase offsets of single pixels, over all conditions ----

/// Phase differences of single pixels from their superpixels, common to all conditions. A pattern much larger than the
/// noise would bias sums over a superpixel: outliers and weights of pixels vary between conditions, and the sum of
/// phasors with different phases loses amplitude.
class PixelPhases {
 public:
  PixelPhases() = default;
  explicit PixelPhases(std::size_t pixels) : sum_(pixels), information_(pixels, 0), seen_(pixels, 0) {}

  /// @param seen phasor of a pixel @param expected that of its superpixel @param variance of a component of `seen`
  void add(std::size_t pixel, std::complex<double> seen, std::complex<double> expected, double variance);
  PixelPhases& operator+=(const PixelPhases& other);
  /// True if the differences are much larger than the noise of one condition.
  bool stand_out() const;
  /// Phasor with the pixel's own phase offset removed.
  std::complex<double> aligned(std::size_t pixel, std::complex<double> phasor) const;

 private:
  std::vector<std::complex<double>> sum_;
  std::vector<double> information_;  ///< of the phase, 1 / rad^2
  std::vector<std::uint32_t> seen_;  ///< number of conditions
};

// ---- Frames of one condition, reduced to superpixels against the ideal camera ----

/// Sums over the frames of one condition; the kind of frames determines which observables are known.
class FrameSums {
 public:
  enum class Kind { taps, phases, decoded, distances };  ///< decoded: distance and amplitude
  /// @param demodulation of taps or phases; decoded frames are converted to four samples
  FrameSums(Kind kind, std::size_t width, std::size_t height, const Demodulation& demodulation = four_steps());
  /// Sums from a file.
  /// @throws std::invalid_argument if their number of pixels or exposures differs from the camera's
  FrameSums(io::PixelSums content, std::size_t width, std::size_t height, const Demodulation& demodulation);

  Kind kind() const { return kind_; }
  bool is_decoded() const { return kind_ == Kind::decoded || kind_ == Kind::distances; }
  std::size_t frames() const { return content_.frames; }
  std::size_t width() const { return width_; }
  std::size_t height() const { return height_; }
  /// @param taps P x 2 x pixels, P exposures @param full_well counts, saturated from here on; NaN: unknown
  void add_taps(std::span<const std::uint16_t> taps, double full_well);
  void add_phases(std::span<const float> phases);  ///< P x pixels
  /// Distance (m) and amplitude (counts; empty: none), one per pixel. @param metres_per_radian of the modulation
  void add_decoded(std::span<const float> distance, std::span<const float> amplitude, double metres_per_radian);

  /// Number of saturated pixels. @param roi first and last column, first and last row
  std::size_t saturated(const std::array<std::size_t, 4>& roi) const;
  /// True if a pixel is finite and not saturated in every frame, and not excluded.
  bool is_usable(std::size_t pixel) const { return content_.bad[pixel] == 0; }
  /// Excludes a pixel that the camera's profile lists as bad.
  void leave_out(std::size_t pixel) { content_.bad[pixel] |= listed; }
  /// Mean over the frames.
  Signal mean(std::size_t pixel) const;
  /// Sums as stored in a file.
  const io::PixelSums& content() const { return content_; }

 private:
  friend class Reduction;
  void add(std::size_t pixel, std::span<const double> samples, double intensity);
  std::span<const double> sums(std::size_t pixel) const { return {&content_.sum[pixel * exposures_], exposures_}; }

  Kind kind_;
  Demodulation camera_;        ///< of the taps or phases, also of those from which decoded frames were computed
  Demodulation demodulation_;  ///< of the summed samples
  std::size_t width_, height_, exposures_;
  io::PixelSums content_;
  static constexpr std::uint8_t listed = 4;  ///< bit of content_.bad: bad in the camera's map
};

/// Counts of a reduction.
struct ReductionCounts {
  std::size_t pixels = 0, bad = 0;
  double noise = 0;          ///< sum over the used pixels of the variance between frames over the profile's
  std::size_t compared = 0;  ///< number of pixels in `noise`
};

/// Observations of one condition. @param ideal signal of every pixel of the ideal camera
/// @param noise of the profile, for single frames @param roi first and last column, first and last row
/// @param grid superpixels per row and per column
/// @param own phase offsets of the pixels, which are removed; null: none
/// @param found phase offsets, to which this condition is added; null: not estimated
/// @param stands_in whether the ideal signal is added to the measured one, see stand_in()
/// @throws std::invalid_argument for a single frame if the profile states no noise
Observations reduce(const FrameSums& sums, std::span<const Signal> ideal, std::size_t grid,
                    const physics::TapNoise& noise, double metres_per_radian, const std::array<std::size_t, 4>& roi,
                    ReductionCounts& counts, const PixelPhases* own = nullptr, PixelPhases* found = nullptr,
                    bool stands_in = false);

// ---- The frames of a condition ----

/// Sums over the frames of a condition, from its `capture`: a recording or a statistics file.
struct ConditionFrames {
  io::CaptureFacts facts;  ///< of the capture
  FrameSums sums;          ///< without pixels that are bad in the camera's map
};

/// @throws std::runtime_error if the file cannot be read, has too few frames, or is a statistics file made with
/// settings that differ from the present ones of the condition and the camera
ConditionFrames read_frames(const io::Condition& condition, const io::Camera& camera);

/// Statistics of a condition's capture, one frame in memory at a time.
/// @param shown path of the capture for reports @param capture_sha256 hash of its bytes
/// @throws std::runtime_error as read_frames
io::Statistics reduce_capture(const io::Condition& condition, const io::Camera& camera, const std::string& shown,
                              const std::string& capture_sha256);

}  // namespace tofgraph::diagnosis
