// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Noise of a camera from repeated frames: photon transfer of its taps, and the resulting distance noise.
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
  outside,    ///< outside the region of interest
  invalid,    ///< a sample was not finite
  clipped,    ///< a tap had zero counts
  saturated,  ///< a tap was saturated
};

/// Statistics of each pixel over the frames of one condition. They bias a fit unless `use` is `good`.
/// Variances are half the mean square of the changes from one frame to the next, which excludes slow drift.
struct PixelNoise {
  std::vector<PixelUse> use;
  std::vector<std::uint64_t> frozen;     ///< bit per sample image (the first 64) that never changed
  std::vector<float> level;              ///< counts, mean of all taps
  std::vector<float> variance;           ///< counts^2, of one tap, mean over the taps
  std::vector<float> amplitude;          ///< counts
  std::vector<float> distance_variance;  ///< m^2, of one frame
  double samples = 0;                    ///< degrees of freedom of each tap variance
  std::size_t images = 0;                ///< images of samples per frame
  double slow = 0;  ///< variance about the mean over that between frames, median of the pixels; 1: no drift

  /// Degrees of freedom of a variance from n frames' successive differences, for normal noise: 2 (n - 1)^2 / (3 n - 4).
  static double freedom(std::size_t frames);
  bool is_good(std::size_t pixel) const { return use[pixel] == PixelUse::good; }
};

/// Noise of one condition.
struct NoiseCondition {
  std::size_t index = 0;  ///< index in the campaign
  double integration_time = unknown;
  bool flat = false;    ///< only a board was in front of the camera
  bool capped = false;  ///< the lens was covered
  std::size_t frames = 0;
  PixelNoise pixels;
};

/// Data in the captures, the least informative of all: taps show both terms directly; for phases and decoded frames
/// the level is the amplitude over twice the profile's contrast, as in the decoder.
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

/// Reads every static condition with at least two frames.
/// @throws config::ConfigurationError listing every capture that is unreadable or has another serial number
NoiseData read_noise(const io::Campaign& campaign, const std::function<void(double share)>& progress);

/// Reasons why a pixel is bad; the values are bits of the map `bad`.
enum BadPixel : std::uint8_t {
  bad_noisy = 1,
  bad_stuck = 2,
  bad_response = 4,
  bad_dead = 8,
  bad_hot = 16,
  bad_modulation = 32,
  bad_listed = 64  ///< in the profile's map
};

/// Criterion of bad pixels, as listed in reports. A good pixel with normal noise meets it with a probability of at most
/// 1e-9 (a limit of 6 standard deviations).
struct BadPixelReason {
  BadPixel bit;
  const char* name;       ///< follows a number: `3 noisy`
  const char* criterion;  ///< for the report
};
std::span<const BadPixelReason> bad_pixel_reasons();

/// Measured and predicted standard deviation of the distance, of one condition or one range of amplitudes.
struct SigmaRatio {
  std::string name;
  double integration_time = unknown, amplitude = unknown;  ///< mean
  double measured = unknown, predicted = unknown;          ///< m, root mean square over the pixels
  std::size_t pixels = 0;
};

struct NoiseFit {
  physics::TapNoise noise;
  double read_sd = unknown, shot_sd = unknown;  ///< standard deviations, from the scatter between conditions
  double excess = 0, excess_sd = unknown;       ///< relative variance that increases with the square of the level
  double max_level = 0;                         ///< counts
  std::vector<double> ratio;                    ///< per pixel: its noise relative to the fit; NaN: no data
  std::vector<std::uint8_t> bad;                ///< per pixel, bits of BadPixel
  bool response_judged = false;                 ///< true if there were enough flat boards for bad_response
  std::vector<SigmaRatio> conditions;           ///< each predicted without its level
  std::string left_out;                         ///< integration_time or condition
  Interval held_out;                            ///< measured over predicted, for held-out levels
  double error = unknown;                       ///< root mean square of ln(measured / predicted), for held-out levels
  double error_by_profile = unknown;            ///< the same with the profile's noise; NaN: not stated
  std::vector<SigmaRatio> amplitudes;           ///< by amplitude, all conditions, each predicted without its level
  std::vector<double> bin_level, bin_variance, bin_model;  ///< for the plot: counts, counts^2
};

/// @throws config::ConfigurationError for too few conditions or levels
/// @param campaign source of the names of the conditions; null: no names
NoiseFit fit_noise(const NoiseData& data, const io::Campaign* campaign);

report::Page noise_report(const io::Campaign& campaign, const NoiseData& data, const NoiseFit& fit,
                          const std::string& verdict);

}  // namespace tofgraph::calibration
