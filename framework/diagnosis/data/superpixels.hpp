// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Frames of one condition: sums over each pixel, from its capture or from a statistics file made of it, reduced
/// to superpixels against the ideal camera.
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

/// By how much the phase of each pixel differs from its superpixel's in all conditions alike. A pattern that is much
/// larger than the noise would leave traces in what is summed over a superpixel: which pixels fit their neighbours, and
/// what weight each has, is not the same in every condition, and a sum of phasors that do not agree loses amplitude.
class PixelPhases {
 public:
  PixelPhases() = default;
  explicit PixelPhases(std::size_t pixels) : sum_(pixels), information_(pixels, 0), seen_(pixels, 0) {}

  /// @param seen phasor of a pixel @param expected of its superpixel, there @param variance of a component of the first
  void add(std::size_t pixel, std::complex<double> seen, std::complex<double> expected, double variance);
  PixelPhases& operator+=(const PixelPhases& other);
  /// True if they differ by far more than the noise of one condition.
  bool stand_out() const;
  /// A phasor without what its pixel has of its own.
  std::complex<double> aligned(std::size_t pixel, std::complex<double> phasor) const;

 private:
  std::vector<std::complex<double>> sum_;
  std::vector<double> information_;  ///< of the phase, 1 / rad^2
  std::vector<std::uint32_t> seen_;  ///< conditions
};

// ---- Frames of one condition, reduced to superpixels against the ideal camera ----

/// Sums over the frames of one condition; what kind of frames decides what is known.
class FrameSums {
 public:
  enum class Kind { taps, phases, decoded, distances };  ///< decoded: distance and amplitude
  /// @param demodulation of the taps or phases; decoded frames are taken as four samples that give them
  FrameSums(Kind kind, std::size_t width, std::size_t height, const Demodulation& demodulation = four_steps());
  /// Sums that were kept in a file. @throws std::invalid_argument when they are of another number of pixels or
  /// exposures
  FrameSums(io::PixelSums content, std::size_t width, std::size_t height, const Demodulation& demodulation);

  Kind kind() const { return kind_; }
  bool is_decoded() const { return kind_ == Kind::decoded || kind_ == Kind::distances; }
  std::size_t frames() const { return content_.frames; }
  std::size_t width() const { return width_; }
  std::size_t height() const { return height_; }
  /// P x 2 x pixels, P exposures. @param full_well counts; taps at or beyond it are saturated; NaN: not known
  void add_taps(std::span<const std::uint16_t> taps, double full_well);
  void add_phases(std::span<const float> phases);  ///< P x pixels
  /// m and counts, pixels each; no amplitude: of distances. @param metres_per_radian of the modulation
  void add_decoded(std::span<const float> distance, std::span<const float> amplitude, double metres_per_radian);

  std::size_t saturated() const;
  /// True if a pixel has a number in every frame, and none that is saturated.
  bool is_usable(std::size_t pixel) const { return content_.bad[pixel] == 0; }
  /// Leaves a pixel out that is bad in the map of the camera's profile.
  void leave_out(std::size_t pixel) { content_.bad[pixel] |= listed; }
  /// Over the frames.
  Signal mean(std::size_t pixel) const;
  /// The sums as a file keeps them.
  const io::PixelSums& content() const { return content_; }

 private:
  friend class Reduction;
  void add(std::size_t pixel, std::span<const double> samples, double intensity);
  std::span<const double> sums(std::size_t pixel) const { return {&content_.sum[pixel * exposures_], exposures_}; }

  Kind kind_;
  Demodulation camera_;        ///< that of the taps or phases, of which decoded frames were made
  Demodulation demodulation_;  ///< of what is summed
  std::size_t width_, height_, exposures_;
  io::PixelSums content_;
  static constexpr std::uint8_t listed = 4;  ///< bit of content_.bad: bad in the camera's map
};

/// Counts of the reduction besides the observations.
struct ReductionCounts {
  std::size_t pixels = 0, bad = 0;
  double noise = 0;          ///< of the pixels that are used, sum of the variances between frames by the profile's
  std::size_t compared = 0;  ///< pixels in it
};

/// Observations of one condition. @param ideal the signal of every pixel of the ideal camera
/// @param noise of the profile, where one frame tells none @param roi first and last column, first and last row
/// @param grid superpixels in a row and in a column
/// @param own what pixels have of their own, which is taken out; null: nothing
/// @param found what they have, is added to it; null: not asked
/// @param stands_in whether the ideal signal is to be added to what was measured: see stand_in()
/// @throws std::invalid_argument when one frame is there and the profile knows no noise
Observations reduce(const FrameSums& sums, std::span<const Signal> ideal, std::size_t grid,
                    const physics::TapNoise& noise, double metres_per_radian, const std::array<std::size_t, 4>& roi,
                    ReductionCounts& counts, const PixelPhases* own = nullptr, PixelPhases* found = nullptr,
                    bool stands_in = false);

// ---- The frames of a condition ----

/// Sums over the frames of a condition, from whichever file its `capture` is.
struct ConditionFrames {
  io::CaptureFacts facts;  ///< of the capture
  FrameSums sums;          ///< without pixels that are bad in the camera's map
};

/// @throws std::runtime_error when the file cannot be read, has too few frames, or is a statistics file made with other
/// settings than the condition and the camera have now
ConditionFrames read_frames(const io::Condition& condition, const io::Camera& camera);

/// All that the sums depend on, one "name value" a line: the capture's content, the frames, and what is used of the
/// profile. Positions of boards, reflectivities and the like are not among them: they may be corrected afterwards.
std::string statistics_settings(const std::string& capture_sha256, const std::array<std::uint64_t, 2>& frames,
                                const io::Camera& camera);

/// Statistics of a condition's capture, one frame in memory at a time.
/// @param shown path of the capture as reports name it @param capture_sha256 of its bytes
/// @throws std::runtime_error as read_frames
io::Statistics reduce_capture(const io::Condition& condition, const io::Camera& camera, const std::string& shown,
                              const std::string& capture_sha256);

/// First and last frame of a condition. @param frames of its capture @throws std::runtime_error when one is not there
std::array<std::uint64_t, 2> used_frames(const io::Condition& condition, std::uint64_t frames);

}  // namespace tofgraph::diagnosis
