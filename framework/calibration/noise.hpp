// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The noise of a camera from repeated frames: the photon transfer of its taps, and what it makes of a distance.
#pragma once

#include "calibration/calibrate.hpp"
#include "calibration/interval.hpp"
#include "io/campaign.hpp"

#include <tofgraph/physics/four_phase.hpp>

#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Use of a pixel in the frames of one condition.
enum class PixelUse : std::uint8_t {
  good,
  outside,    ///< not in the region of interest
  invalid,    ///< a sample was not a number
  clipped,    ///< a tap held no counts
  saturated,  ///< a tap was full
};

/// Statistics of each pixel over the frames of one condition. They bias a fit where `use` is not `good`.
/// Variances are half the mean square of the changes from one frame to the next: slow drift does not count.
struct PixelNoise {
  std::vector<PixelUse> use;
  std::vector<std::uint64_t> frozen;     ///< bits of the sample images that never changed, the first 64
  std::vector<float> level;              ///< counts, mean of all taps
  std::vector<float> variance;           ///< counts^2, of one tap, mean over the taps
  std::vector<float> amplitude;          ///< counts
  std::vector<float> distance_variance;  ///< m^2, of one frame
  double samples = 0;                    ///< independent ones in each variance of a tap
  std::size_t images = 0;                ///< images of samples per frame
  double slow = 0;  ///< variance about the mean over variance from frame to frame, median of the pixels; 1: no drift

  /// Degrees of freedom of a variance from n frames' successive differences, normal noise: 2 (n - 1)^2 / (3 n - 4).
  static double freedom(std::size_t frames);
  bool is_good(std::size_t pixel) const { return use[pixel] == PixelUse::good; }
};

/// Noise of one condition.
struct NoiseCondition {
  std::size_t index = 0;  ///< in the campaign
  double integration_time = unknown;
  bool flat = false;    ///< a board and nothing else stood before the camera
  bool capped = false;  ///< the lens was covered
  std::size_t frames = 0;
  PixelNoise pixels;
};

/// Data of the captures, the least informative of all: taps show both terms directly; of phases and decoded frames the
/// level is the amplitude over twice the profile's contrast, as the decoder takes it.
enum class NoiseSource { taps, phases, decoded };

struct NoiseData {
  std::vector<NoiseCondition> conditions;
  NoiseSource source = NoiseSource::taps;
  std::size_t rows = 0, columns = 0;
  double modulation_frequency = 0;  ///< Hz
  std::string serial;
  std::vector<std::uint8_t> listed;  ///< per pixel: bad_listed or 0
  std::vector<std::string> notes;
};

/// Reads every condition that stands still, with two frames or more.
/// @throws config::ConfigurationError every capture that cannot be read, or of another serial
NoiseData read_noise(const io::Campaign& campaign, const std::function<void(double share)>& progress);

/// Reasons why a pixel is bad; the numbers are bits of the map `bad`.
enum BadPixel : std::uint8_t {
  bad_noisy = 1,
  bad_stuck = 2,
  bad_response = 4,
  bad_dead = 8,
  bad_hot = 16,
  bad_modulation = 32,
  bad_listed = 64  ///< in the map that the camera's profile names
};

/// A criterion of bad pixels, as reports list it. A good pixel with normal noise meets one with a probability of at
/// most 1e-9 (a limit of 6 standard deviations).
struct BadPixelReason {
  BadPixel bit;
  const char* name;       ///< after a number: `3 noisy`
  const char* criterion;  ///< for the report
};
std::span<const BadPixelReason> bad_pixel_reasons();

/// Measured against predicted standard deviation of the distance, of one condition or one range of amplitudes.
struct SigmaRatio {
  std::string name;
  double integration_time = unknown, amplitude = unknown;  ///< mean
  double measured = unknown, predicted = unknown;          ///< m, root mean square over the pixels
  std::size_t pixels = 0;
};

struct NoiseFit {
  physics::TapNoise noise;
  double read_sd = unknown, shot_sd = unknown;  ///< standard deviations, from the scatter between conditions
  double excess = 0, excess_sd = unknown;       ///< variance, relative^2: what grows with the square of the level
  double max_level = 0;                         ///< counts
  std::vector<double> ratio;                    ///< per pixel: its noise over the fitted one; NaN: no data
  std::vector<std::uint8_t> bad;                ///< per pixel, bits of BadPixel
  bool response_judged = false;                 ///< bad_response was looked for: there were enough flat boards
  std::vector<SigmaRatio> conditions;           ///< each predicted without its level
  std::string left_out;                         ///< integration_time or condition
  Interval held_out;                            ///< measured over predicted, levels left out
  double by_profile = unknown;                  ///< the same by the profile's noise; NaN: not stated
  std::vector<SigmaRatio> amplitudes;           ///< by amplitude, all conditions, each predicted without its level
  std::vector<double> bin_level, bin_variance, bin_model;  ///< for the picture: counts, counts^2
};

/// @throws config::ConfigurationError too few conditions or levels
/// @param campaign for the names of the conditions; null: they have none
NoiseFit fit_noise(const NoiseData& data, const io::Campaign* campaign);

report::Page noise_report(const io::Campaign& campaign, const NoiseData& data, const NoiseFit& fit,
                          const std::string& verdict);

}  // namespace tofgraph::calibration
