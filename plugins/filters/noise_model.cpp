// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Standard deviation of lengths for recordings that do not state it.
#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/exposures.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plugins/calibrated_noise.hpp"
#include "plugins/filters/noise_estimate.hpp"

namespace tofgraph {

/// Computes sigma of the lengths in one of four ways, `mode`:
///
/// profile: variance of a tap = read_noise^2 + shot_noise x counts; the counts are the intensity if available, else
/// amplitude / (2 contrast) + background x integration time. A sample c_k is the difference of two taps; the variance
/// of the phase is that of the sample divided by the squared amplitude, times 2 / P for P equal steps.
/// null_channel: the variance of the samples is measured in the component that light of this frequency does not affect
/// (N2 = c0 - c1 + c2 - c3 for four steps), as a function of the amplitude. frames: half of the variance of the
/// difference from the previous frame with the same integration time and frequency; the first frame is dropped. For
/// still scenes. spatial: second differences along the rows of one frame. For values that have not been smoothed.
///
/// The last three fit variance x amplitude^2 = a + b amplitude to medians of groups of pixels with similar amplitude:
/// edges and moving objects have no influence while they are a minority. Without an amplitude, frames and spatial give
/// one sigma per tile of 16 x 16 px, or that of the frame if the tile has few valid pixels or mostly equal values.
/// Noise common to neighbours or frames (fixed patterns, drift) is not detected. A pixel without an amplitude becomes
/// invalid. Ranges get the sigma of the distance, depths that multiplied by cos(angle of the ray): exact for a light
/// source next to the lens.
struct NoiseModel final : Filter {
  InOut<float> image{this, "distance|range|depth", {.text = "channel whose sigma is computed"}};
  In<float> amplitude{this, "amplitude", {.optional = true, .text = "needed by profile and null_channel"}};
  In<float> intensity{this, "intensity", {.optional = true, .text = "for profile: light of the taps"}};
  In<std::uint16_t> taps{this, "taps", {.shape = "P 2 H W", .optional = true, .text = "for null_channel, read first"}};
  In<void> phases{
      this, "phases", {.shape = "P H W", .optional = true, .text = "for null_channel; float32, int16 or int32"}};
  InOut<float> sigma{this, "sigma", {.optional = true, .text = "created or replaced"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created, or combined with the incoming flags"}};
  Param<Choice> mode{this,
                     "mode",
                     {.required = true,
                      .choices = "profile null_channel frames spatial",
                      .text = "profile: by the camera's read_noise, shot_noise and contrast; the others estimate it: "
                              "from the raw images of a frame, from repeated frames, from one frame"}};
  NoiseParameters tap_noise{this};
  Param<double> contrast{
      this,
      "contrast",
      {.min = 1e-3, .max = 1, .text = "for profile, if the input has no intensity; default: the camera's"}};
  Param<double> background{this,
                           "background",
                           {.unit = "counts/s",
                            .default_value = "0 counts/s",
                            .min = 0,
                            .text = "for profile: ambient light and dark current of a tap"}};
  Param<Choice> channel{this,
                        "channel",
                        {.default_value = "auto",
                         .choices = "auto distance range depth",
                         .text = "channel whose sigma is computed; auto: the first of these that exists"}};

  void prepare(Setup& setup) {
    check_sigma(setup, sigma.present(), image.channel());
    if (*mode == "profile") prepare_profile(setup);
    if (*mode == "null_channel") prepare_null_channel(setup);
    if (*mode == "profile" || *mode == "null_channel") prepare_phase(setup);
    if (*mode == "frames") {
      const std::uint64_t come = setup.stream().frames;
      if (come == 1)
        throw ConfigError("mode",
                          "frames needs repeated frames, but there is only one frame: use mode: spatial, null_channel "
                          "or profile");
      if (come > 0) setup.set_frames(come - 1, setup.stream().known);
    }
    sigma.provide(setup, image.channel());
    flags.provide(setup);
    lengths_.prepare(setup, {image.channel(), "sigma"});
  }

  /// @returns false for the first frame of each integration time and frequency if frames are compared
  bool process(Frame& frame) {
    const Array<float> lengths = image(frame);
    const Array<float> deviations = sigma(frame, lengths.rows(), lengths.columns());
    const Array<std::uint16_t> bits = flags(frame, lengths.rows(), lengths.columns());
    mark_invalid(lengths, {}, bits);
    if (*mode == "profile") by_profile(frame, deviations);
    if (*mode == "null_channel") by_null_channel(frame, bits, deviations);
    if (*mode == "frames" && !by_frames(frame, lengths, bits, deviations)) return false;
    if (*mode == "spatial") {
      second_differences(lengths.data(), lengths.rows(), lengths.columns(), residuals_);
      by_residuals(frame, bits, deviations);
    }
    for (std::size_t i = 0; i < bits.size(); ++i) {  // without a signal a length is only noise
      if (std::isnan(deviations[i])) bits[i] = static_cast<std::uint16_t>(bits[i] | flag::invalid);
    }
    mark_invalid(lengths, deviations, bits);
    lengths_.invalidate(frame, bits);
    return true;
  }

 private:
  static constexpr std::size_t min_residuals = 200, most_residuals = 50000, min_of_tile = 64;
  static constexpr float nan = std::numeric_limits<float>::quiet_NaN();

  void need_amplitude() const {
    if (!amplitude.present())
      throw ConfigError("mode", *mode +
                                    " needs the amplitude, which the input lacks: record it, or use mode: spatial "
                                    "or frames");
  }

  void prepare_profile(const Setup& setup) {
    need_amplitude();
    noise_ = tap_noise.noise(setup);
    if (!noise_.known())
      throw ConfigError("mode",
                        "profile needs read_noise and shot_noise, of the camera's profile or of this node, e.g. "
                        "read_noise: 3 counts, shot_noise: 0.012 counts; without them: mode: spatial or frames");
    const tofgraph_camera* camera = setup.stream().camera;
    contrast_ = contrast.given() ? *contrast : camera != nullptr ? camera->contrast : 0;
    if (!intensity.present() && !(contrast_ > 0) && noise_.shot_noise > 0)
      throw ConfigError("contrast",
                        "neither the intensity nor the contrast is known, from which the light of the taps "
                        "follows, e.g. contrast: 0.5");
    if (!(*background > 0)) return;
    if (intensity.present())
      throw ConfigError("background", "is part of the intensity, which the input has: remove it");
    if (!setup.knows(TOFGRAPH_KNOWS_INTEGRATION_TIME))
      throw ConfigError("background", "needs the frames' integration time, which these frames do not state");
  }

  void prepare_null_channel(const Setup& setup) {
    if (!taps.present() && !phases.present())
      throw ConfigError("mode",
                        "null_channel needs the raw images, taps or phases, which the input lacks: use mode: "
                        "spatial, frames or profile");
    need_amplitude();
    const physics::Exposures exposures = physics::exposures_of(setup.exposures());
    for (const physics::PhaseFit& fit : physics::phase_fits(exposures)) {
      for (const std::vector<double>& row : fit.rest) {
        rests_.emplace_back();
        for (std::size_t k = 0; k < row.size(); ++k)
          rests_.back().push_back({fit.image[k], static_cast<float>(row[k])});
      }
    }
    if (rests_.empty())
      throw ConfigError(
          "mode",
          "null_channel needs four or more steps of a frequency, as three steps leave no null channel: there are " +
              physics::exposures_text(exposures));
  }

  void prepare_phase(const Setup& setup) {
    const tofgraph_camera* camera = setup.stream().camera;
    fits_ = physics::phase_fits(physics::exposures_of(setup.exposures()));
    camera_frequency_ = camera != nullptr ? camera->modulation_frequency : 0;
    if (fits_[0].frequency == 0 && !setup.knows(TOFGRAPH_KNOWS_MODULATION_FREQUENCY) && !(camera_frequency_ > 0))
      throw ConfigError("mode",
                        *mode + " needs the modulation frequency, which neither the frames nor the camera state");
    if (std::string_view(image.channel()) != "depth") return;
    const tofgraph_camera& with_rays = setup.camera();
    for (std::size_t i = 0; i < std::size_t{with_rays.width} * with_rays.height; ++i)
      cosines_.push_back(with_rays.rays[3 * i + 2]);
  }

  /// Ratio of sigma of the distance to a sample's relative deviation, m. Frequencies are combined by 1 / sigma^2.
  double metres_per_relative(const Frame& frame) const {
    double weights = 0;
    const double stated = frame.metadata().modulation_frequency;  // a decoder of one frequency states the one it used
    for (const physics::PhaseFit& fit : fits_) {
      const bool one_stated = fits_.size() == 1 && stated > 0;
      const double own = stated > 0 ? stated : camera_frequency_;
      const double metres = physics::metres_per_radian(fit.frequency > 0 && !one_stated ? fit.frequency : own);
      weights += 2 / (metres * metres * (fit.xx + fit.yy));
    }
    if (!(weights > 0)) throw std::runtime_error("the modulation frequency of the frame is unknown");
    return 1 / std::sqrt(weights);
  }
  float cosine(std::size_t i) const { return cosines_.empty() ? 1 : cosines_[i]; }

  void by_profile(const Frame& frame, const Array<float>& deviations) const {
    const Array<const float> light = amplitude(frame), counts = intensity(frame);
    const double scale = metres_per_relative(frame), time = frame.metadata().integration_time;
    const double behind = *background > 0 ? *background * time : 0;
    if (std::isnan(behind)) throw std::runtime_error("the frame does not state its integration time");
    for (std::size_t i = 0; i < deviations.size(); ++i) {
      const double a = light[i];
      const double held = counts.data() != nullptr ? counts[i] : contrast_ > 0 ? a / (2 * contrast_) + behind : 0;
      deviations[i] = a > 0 ? static_cast<float>(scale * std::sqrt(noise_.sample_variance(held)) / a) * cosine(i) : nan;
    }
  }

  void by_null_channel(const Frame& frame, const Array<std::uint16_t>& bits, const Array<float>& deviations) {
    const tofgraph_view samples = frame.find(taps.present() ? taps.channel() : phases.channel());
    const Array<const float> light = amplitude(frame);
    collected_.clear();
    for (const Rest& rest : rests_) {
      rest_image(samples, rest, bits.size());
      second_differences(rest_.data(), bits.rows(), bits.columns(), residuals_);
      collect(bits, light, false);
    }
    const NoiseLaw law = law_of_collected();
    const double scale = metres_per_relative(frame);
    for (std::size_t i = 0; i < deviations.size(); ++i)
      deviations[i] =
          light[i] > 0 ? static_cast<float>(scale * std::sqrt(law.variance(light[i])) / light[i]) * cosine(i) : nan;
  }

  /// Compares with the previous frame of the same integration time and frequency. @returns false if there is none
  bool by_frames(const Frame& frame, const Array<float>& lengths, const Array<std::uint16_t>& bits,
                 const Array<float>& deviations) {
    const tofgraph_metadata& metadata = frame.metadata();
    const auto known = [](double setting) { return setting > 0 ? setting : 0; };
    std::vector<float>& before =
        before_[std::array<double, 2>{known(metadata.integration_time), known(metadata.modulation_frequency)}];
    const bool comparable = before.size() == lengths.size();
    if (comparable) {
      constexpr float scale = 0.70710678F;  // for the difference of two frames
      residuals_.resize(lengths.size());
      for (std::size_t i = 0; i < lengths.size(); ++i) residuals_[i] = scale * (lengths[i] - before[i]);
      by_residuals(frame, bits, deviations);
    }
    before.assign(lengths.begin(), lengths.end());
    return comparable;
  }

  /// Computes sigma from residuals of the lengths, m.
  void by_residuals(const Frame& frame, const Array<std::uint16_t>& bits, const Array<float>& deviations) {
    const Array<const float> light = amplitude(frame);
    collected_.clear();
    collect(bits, light, true);
    const NoiseLaw law = law_of_collected();
    if (light.data() != nullptr) {
      for (std::size_t i = 0; i < deviations.size(); ++i)
        deviations[i] = light[i] > 0 ? static_cast<float>(std::sqrt(law.variance(light[i])) / light[i]) : nan;
      return;
    }
    tiles_.estimate(residuals_, bits.rows(), bits.columns());
    const auto of_frame = static_cast<float>(std::sqrt(law.variance(1)));
    for (std::size_t i = 0; i < deviations.size(); ++i) {
      const std::size_t row = i / bits.columns(), column = i % bits.columns();
      const float own = tiles_.count(row, column) < min_of_tile ? 0 : tiles_.at(row, column);
      deviations[i] = own > 0 ? own : of_frame;  // 0: rounded more coarsely than the noise
    }
  }

  /// Collects the residuals of good pixels whose neighbours in the row have a similar amplitude: at edges the noise
  /// does not belong to a single amplitude. @param scaled whether they are multiplied by the amplitude
  void collect(const Array<std::uint16_t>& bits, const Array<const float>& light, bool scaled) {
    constexpr int bad =
        flag::invalid | flag::saturated | flag::inconsistent | flag::mixed | flag::filled | flag::bad_pixel;
    const auto amplitude_at = [&](std::size_t i) { return light.data() != nullptr ? light[i] : 1; };
    const std::size_t step = bits.size() / most_residuals + 1;
    for (std::size_t i = 1; i + 1 < bits.size(); i += step) {
      const float a = amplitude_at(i), rest = residuals_[i];
      const bool alike = std::abs(amplitude_at(i - 1) - a) < a / 2 && std::abs(amplitude_at(i + 1) - a) < a / 2;
      if (alike && std::isfinite(rest) && (bits[i] & bad) == 0) collected_.push_back({a, scaled ? a * rest : rest});
    }
  }

  NoiseLaw law_of_collected() {
    if (collected_.size() < min_residuals)
      throw std::runtime_error("the noise cannot be estimated: only " + std::to_string(collected_.size()) +
                               " pixels of the frame can be used, at least " + std::to_string(min_residuals) +
                               " are needed");
    const NoiseLaw law = fit_noise_law(collected_);
    if (law.constant > 0 || law.slope > 0) return law;
    throw std::runtime_error(
        "the noise cannot be estimated: most values equal the values they are compared with, so they are rounded more "
        "coarsely than the noise, or smoothed; use mode: profile, or give the denoisers a length, e.g. strength: 20 "
        "mm");
  }

  /// Term of a residual of the phase fit: an image and its factor.
  struct Term {
    std::size_t image;
    float factor;
  };
  using Rest = std::vector<Term>;

  void rest_image(const tofgraph_view& samples, const Rest& rest, std::size_t pixels) {
    switch (samples.type) {
      case TOFGRAPH_TYPE_U16:
        return add_up(static_cast<const std::uint16_t*>(samples.data), true, rest, pixels);
      case TOFGRAPH_TYPE_I16:
        return add_up(static_cast<const std::int16_t*>(samples.data), false, rest, pixels);
      case TOFGRAPH_TYPE_I32:
        return add_up(static_cast<const std::int32_t*>(samples.data), false, rest, pixels);
      default:
        return add_up(static_cast<const float*>(samples.data), false, rest, pixels);
    }
  }
  template <class T> void add_up(const T* samples, bool of_taps, const Rest& rest, std::size_t pixels) {
    rest_.assign(pixels, 0);
    for (const auto& [k, factor] : rest) {
      const T* image = samples + (of_taps ? 2 : 1) * k * pixels;
      for (std::size_t i = 0; i < pixels; ++i) {
        const float c = of_taps ? static_cast<float>(image[i]) - static_cast<float>(image[pixels + i])
                                : static_cast<float>(image[i]);
        rest_[i] += factor * c;
      }
    }
  }

  physics::TapNoise noise_;
  double contrast_ = 0, camera_frequency_ = 0;
  std::vector<physics::PhaseFit> fits_;
  std::vector<Rest> rests_;
  std::vector<float> cosines_, rest_, residuals_;
  std::vector<Residual> collected_;
  std::map<std::array<double, 2>, std::vector<float>> before_;  // by integration time, s, and frequency, Hz; 0: unknown
  TileNoise tiles_;
  OtherLengths lengths_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::NoiseModel,
               "Standard deviation of lengths, by the camera's noise or from the recording itself")
