// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Common part of four_phase_decoder and phase_decoder: ports, noise, and the check of the exposures'
/// order.
#pragma once

#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/amplitude_walk.hpp>
#include <tofgraph/physics/four_phase.hpp>
#include <tofgraph/physics/unwrapping.hpp>

#include <atomic>

#include "io/exposure_order.hpp"
#include "io/plausibility.hpp"
#include "plugins/calibrated_noise.hpp"
#include "plugins/calibrated_serial.hpp"
#include "plugins/without_gaps.hpp"

namespace tofgraph {

/// Constants of all pixels, in counts.
struct DecoderCounts {
  float full_well;                  ///< at most 65535, the largest count of a tap
  float min_amplitude;              ///< below: low signal
  float read_variance, shot_noise;  ///< per tap: variance = read_variance + shot_noise intensity
  float intensity_per_amplitude;    ///< for phases, which lack the intensity: 1 / (2 contrast)
  bool noise_known;
  std::int32_t invalid_flags;  ///< bits that make a pixel invalid
};

/// Channels of a frame; null: not requested.
struct DecoderImages {
  const void* samples;  ///< P phases, or P x 2 taps
  std::uint32_t type;   ///< type of the samples
  std::size_t pixels;
  float* distance;
  float* amplitude;
  float* intensity;  ///< with taps only
  float* sigma;
  std::uint16_t* flags;  ///< read and combined
};

/// Noise model: the variance of a tap is read_noise^2 + shot_noise * counts; a sample c_k is the difference of two
/// taps. Taps contain the counts; for phases they are estimated as amplitude / (2 contrast) per tap, without ambient
/// light.
struct Decoder : Filter {
  In<std::uint16_t> taps{
      this,
      "taps",
      {.shape = "P 2 H W", .optional = true, .text = "read first: saturation and intensity follow from them"}};
  In<void> phases{this,
                  "phases",
                  {.shape = "P H W", .optional = true, .text = "read if there are no taps; float32, int16 or int32"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created, or combined with the incoming flags"}};
  Out<float> distance{this, "distance", {.from = "taps phases"}};
  Out<float> amplitude{this, "amplitude", {.from = "taps phases"}};
  Out<float> intensity{
      this,
      "intensity",
      {.optional = true, .text = "mean of the tap samples; not available from phases", .from = "taps"}};
  Out<float> sigma{
      this,
      "sigma",
      {.optional = true, .text = "written if the noise is known", .from = "taps phases", .of = "distance"}};

  Param<double> modulation_frequency{
      this,
      "modulation_frequency",
      {.unit = "Hz", .min = 1e3, .max = 1e10, .text = "replaces the frames' own frequency, e.g. 20 MHz"}};
  Param<double> min_amplitude{this,
                              "min_amplitude",
                              {.unit = "counts",
                               .default_value = "0 counts",
                               .min = 0,
                               .text = "a smaller amplitude is flagged as low signal"}};
  Param<bool> invalidate_low_signal{
      this, "invalidate_low_signal", {.default_value = "false", .text = "pixels of low signal become invalid"}};
  Param<bool> invalidate_saturated{
      this, "invalidate_saturated", {.default_value = "true", .text = "saturated pixels become invalid"}};
  Param<bool> invalidate_inconsistent{
      this,
      "invalidate_inconsistent",
      {.default_value = "false", .text = "pixels whose samples or frequencies do not fit each other become invalid"}};
  NoiseParameters tap_noise{this};
  Param<double> full_well{
      this,
      "full_well",
      {.unit = "counts", .min = 0, .text = "a tap that reaches it is saturated; default: the camera's, or 65535"}};

 protected:
  /// Checks the samples and announces the outputs.
  void prepare_samples(const Setup& setup) {
    if (!taps.present() && !phases.present())
      throw std::runtime_error("needs taps or phases, e.g. from a recording with raw samples");
    exposures_ = physics::exposures_of(setup.exposures());
    const tofgraph_channel& raw = *setup.find(taps.present() ? taps.channel() : phases.channel());
    if (raw.extent[0] != 0 && raw.extent[0] != exposures_.size()) throw std::runtime_error(other_number(raw.extent[0]));
    if (!modulation_frequency.given() && exposures_[0].frequency == 0 &&
        !setup.knows(TOFGRAPH_KNOWS_MODULATION_FREQUENCY)) {
      throw ConfigError("modulation_frequency",
                        "the frames do not state it, so it must be given, e.g. modulation_frequency: 20 MHz");
    }
    if (!taps.present() && raw.type != TOFGRAPH_TYPE_F32 && raw.type != TOFGRAPH_TYPE_I16 &&
        raw.type != TOFGRAPH_TYPE_I32) {
      throw std::runtime_error(std::string("phases are ") + element_name(raw.type) +
                               ", expected float32, int16 or int32");
    }
    if (physics::not_one_frequency(exposures_).empty())  // see pass_on_frequency()
      setup.set_frames(setup.stream().frames, setup.stream().known | TOFGRAPH_KNOWS_MODULATION_FREQUENCY);
    flags.provide(setup);
    lengths_.prepare(setup, {});
    if (taps.present()) intensity.provide(setup);
    const tofgraph_camera* camera = setup.stream().camera;
    counts_ = counts_of(camera, tap_noise.noise(setup));
    camera_ = camera;
    gain_ = camera != nullptr && camera->gain > 0 ? camera->gain : 0;
    if (modulation_frequency.given()) {
      const std::string doubt = io::frequency_doubt(*modulation_frequency, camera);
      if (!doubt.empty()) warn(doubt);
    }
    from_camera_ = camera == nullptr || physics::same_exposures(exposures_, physics::exposures_of(*camera));
    if (counts_.noise_known && (counts_.read_variance > 0 || counts_.shot_noise > 0)) sigma.provide(setup);
  }

  /// Modulation frequency, Hz. @throws std::runtime_error if the frame does not state its own
  double frequency_of(const Frame& frame) const {
    const double frequency = modulation_frequency.given()  ? *modulation_frequency
                             : exposures_[0].frequency > 0 ? exposures_[0].frequency
                                                           : frame.metadata().modulation_frequency;
    if (!(frequency > 0)) throw std::runtime_error("the modulation frequency of the frame is unknown");
    return frequency;
  }

  /// Modulation frequency of a frame of one frequency, Hz. The frame states it from here on, so that later stages use
  /// that of the distances. @throws std::runtime_error if it is unknown
  double pass_on_frequency(const Frame& frame) const {
    const double frequency = frequency_of(frame);
    frame.metadata().modulation_frequency = frequency;
    return frequency;
  }

  /// Decodes one frame; decode(images) fills in the images.
  template <class Decode> void decode_frame(const Frame& frame, Decode&& decode) const {
    const tofgraph_view samples = samples_of(frame);
    const std::size_t rows = samples.extent[samples.rank - 2], columns = samples.extent[samples.rank - 1];
    const Array<std::uint16_t> bits = flags(frame, rows, columns);
    const DecoderImages images{.samples = samples.data,
                               .type = samples.type,
                               .pixels = rows * columns,
                               .distance = distance(frame, rows, columns).data(),
                               .amplitude = amplitude(frame, rows, columns).data(),
                               .intensity = intensity.present() ? intensity(frame, rows, columns).data() : nullptr,
                               .sigma = sigma.present() ? sigma(frame, rows, columns).data() : nullptr,
                               .flags = bits.data()};
    decode(images);
    lengths_.invalidate(frame, bits);
    look_at_order(frame, samples);
    look_at_walk(frame, images, rows, columns);
  }

  DecoderCounts counts_{};
  physics::Exposures exposures_;  ///< exposures of the frames

 private:
  /// @throws std::runtime_error if the number differs from the announced one
  tofgraph_view samples_of(const Frame& frame) const {
    const tofgraph_view samples = frame.find(taps.present() ? taps.channel() : phases.channel());
    if (samples.data == nullptr || samples.extent[0] != exposures_.size())
      throw std::runtime_error(other_number(samples.extent[0]));
    refuse_gaps(samples);
    return samples;
  }

  /// Warns, at the first frame only, if another order of the exposures would explain it better.
  void look_at_order(const Frame& frame, const tofgraph_view& samples) const {
    if (looks_left_.load(std::memory_order_relaxed) <= 0 || looks_left_.fetch_sub(1) <= 0) return;
    const double frequency = frequency_of(frame);
    if (!io::frequency_doubt(frequency, camera_).empty()) {  // no order fits if the frequency is wrong
      looks_left_ = 0;
      return;
    }
    io::OrderSamples some = some_of(samples);
    if (some.pixels.size() < 128 || looked_.test_and_set()) return;
    looks_left_ = 0;
    const double time = frame.metadata().integration_time;
    some.modulation_frequency = frequency;
    some.light = gain_ > 0 && time > 0 ? gain_ * time : 0;
    const std::vector<double> frequencies = physics::frequencies_of(exposures_, some.modulation_frequency);
    // If only max_range limits the distances, there is nothing to compare with.
    if (physics::common_frequency(frequencies) < *std::ranges::max_element(frequencies) / 64) return;
    const auto other = io::other_order(some, exposures_);
    if (!other) return;
    const std::string number = std::to_string(frame.metadata().number);
    const std::string said = "frame " + number + ": " + other->why + "; " + physics::exposures_text(exposures_) +
                             " are stated (by the " + (from_camera_ ? "camera's profile" : "source") + ")";
    warn(other->exposures.empty() ? said + ", and no other order was found that fits"
                                  : said +
                                        ". These would fit; put them into the profile, and set exposures: camera at a "
                                        "capture_reader whose recording has its own:\n         exposures: " +
                                        io::exposures_yaml(other->exposures));
  }

  /// Warns, at one of the first frames with contrast, if the distance rises with the amplitude.
  void look_at_walk(const Frame& frame, const DecoderImages& images, std::size_t rows, std::size_t columns) const {
    if (walks_left_.load(std::memory_order_relaxed) <= 0 || walks_left_.fetch_sub(1) <= 0) return;
    const auto walk = physics::walk_of_frame(images.distance, images.amplitude, rows, columns);
    if (!walk || walked_.test_and_set()) return;
    walks_left_ = 0;
    constexpr double least = 2e-3;  // m per factor 2
    if (walk->rise < least || walk->rise < 6 * walk->error) return;
    warn("frame " + std::to_string(frame.metadata().number) + ": the distance rises by " +
         physics::short_number(std::round(walk->rise * 1e4) / 10) +
         " mm with each doubling of the amplitude, within surfaces; tofgraph calibrate offset with targets of several "
         "reflectivities measures this, tofgraph inspect shows more");
  }

  std::string other_number(std::uint64_t images) const {
    return "the input has " + std::to_string(images) + " images per frame, but " + physics::exposures_text(exposures_) +
           " are stated";
  }

  /// Pixels from all over the image with their right neighbours, with light and without saturation.
  io::OrderSamples some_of(const tofgraph_view& view) const {
    const std::size_t rows = view.extent[view.rank - 2], columns = view.extent[view.rank - 1], n = rows * columns;
    const std::size_t images = view.extent[0];
    io::OrderSamples some;
    constexpr std::size_t parts = 6;    // in each direction
    constexpr std::size_t wanted = 40;  // in each direction
    const std::size_t down = std::max<std::size_t>(rows / wanted, 1),
                      along = std::max<std::size_t>(columns / wanted, 2);
    std::vector<double> pair[2];
    for (std::size_t row = down / 2; row < rows; row += down) {
      for (std::size_t column = along / 2; column + 1 < columns; column += along) {
        double swing = std::numeric_limits<double>::infinity();
        for (std::size_t side = 0; side < 2; ++side) {
          pair[side].clear();
          for (std::size_t k = 0; k < images; ++k)
            pair[side].push_back(sample(view, k, row * columns + column + side, n));
          const auto [least, greatest] = std::ranges::minmax(pair[side]);
          swing = std::min(swing, greatest - least);  // NaN, e.g. of saturated taps, fails below
          for (const double c : pair[side]) swing = std::isfinite(c) ? swing : 0;
        }
        const double light = counts_of(view, images, row * columns + column, n);
        const double variance = 2 * (static_cast<double>(counts_.read_variance) + counts_.shot_noise * light);
        if (swing <= std::max(20 * std::sqrt(variance), 1e-6)) continue;
        const std::size_t cell = row * parts / rows * parts + column * parts / columns;
        some.cells.insert(some.cells.end(), 2, cell);
        some.pixels.push_back(pair[0]);
        some.pixels.push_back(pair[1]);
      }
    }
    return some;
  }

  /// Mean of the taps; 0 for phases.
  static double counts_of(const tofgraph_view& view, std::size_t images, std::size_t pixel, std::size_t n) {
    if (view.type != TOFGRAPH_TYPE_U16) return 0;
    double sum = 0;
    for (std::size_t t = 0; t < 2 * images; ++t) sum += static_cast<const std::uint16_t*>(view.data)[t * n + pixel];
    return sum / static_cast<double>(2 * images);
  }

  /// Sample c_k; NaN if a tap is saturated.
  double sample(const tofgraph_view& view, std::size_t k, std::size_t pixel, std::size_t n) const {
    switch (view.type) {
      case TOFGRAPH_TYPE_U16: {
        const auto* tap = static_cast<const std::uint16_t*>(view.data) + 2 * k * n + pixel;
        return tap[0] >= counts_.full_well || tap[n] >= counts_.full_well ? std::numeric_limits<double>::quiet_NaN()
                                                                          : static_cast<double>(tap[0]) - tap[n];
      }
      case TOFGRAPH_TYPE_I16:
        return static_cast<const std::int16_t*>(view.data)[k * n + pixel];
      case TOFGRAPH_TYPE_I32:
        return static_cast<const std::int32_t*>(view.data)[k * n + pixel];
      default:
        return static_cast<const float*>(view.data)[k * n + pixel];
    }
  }

  mutable std::atomic_flag looked_;
  mutable std::atomic<int> looks_left_ = 20;  // number of tries; covers frames with too little light
  mutable std::atomic_flag walked_;
  mutable std::atomic<int> walks_left_ = 5;  // number of tries; covers frames with too little contrast

  const tofgraph_camera* camera_ = nullptr;
  bool from_camera_ = true;  // origin of the exposures
  double gain_ = 0;          // of the camera, counts m^2/s; 0: unknown
  OtherLengths lengths_;

  DecoderCounts counts_of(const tofgraph_camera* camera, const physics::TapNoise& noise) const {
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN(), largest = 65535;  // counts of a tap
    const double contrast = camera != nullptr ? camera->contrast : unknown;
    const bool known = noise.known() && (taps.present() || contrast > 0 || noise.shot_noise == 0);
    const double well = full_well.given() ? *full_well : camera != nullptr ? camera->full_well : unknown;
    return {.full_well = static_cast<float>(well > 0 ? std::min(well, largest) : largest),
            .min_amplitude = static_cast<float>(*min_amplitude),
            .read_variance = static_cast<float>(known ? noise.read_noise * noise.read_noise : 0),
            .shot_noise = static_cast<float>(known ? noise.shot_noise : 0),
            .intensity_per_amplitude = static_cast<float>(contrast > 0 ? 1 / (2 * contrast) : 0),
            .noise_known = known,
            .invalid_flags = flag::invalid | (*invalidate_saturated ? flag::saturated : 0) |
                             (*invalidate_inconsistent ? flag::inconsistent : 0) |
                             (*invalidate_low_signal ? flag::low_signal : 0)};
  }
};

}  // namespace tofgraph
