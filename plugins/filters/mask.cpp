// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Masks pixels by what is known of their quality.
#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/exposures.hpp>

#include <cmath>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace tofgraph {

/// Each limit that is given marks the pixels beyond it with the flag of its reason: an amplitude below `min_amplitude`
/// or a sigma above `max_sigma` is low_signal, an amplitude above `max_amplitude` saturated, |N2| above `max_null2`
/// times the amplitude inconsistent. What is not a number is beyond every limit. With `invalidate` these pixels, and
/// those that arrive with one of `flagged`, become invalid.
struct Mask final : Filter {
  In<float> amplitude{this, "amplitude", {.optional = true, .text = "for limits of the amplitude and of N2"}};
  In<float> sigma{this, "sigma", {.optional = true, .text = "for max_sigma"}};
  In<std::uint16_t> taps{this, "taps", {.shape = "P 2 H W", .optional = true, .text = "for max_null2, read first"}};
  In<void> phases{
      this, "phases", {.shape = "P H W", .optional = true, .text = "for max_null2; float32, int16 or int32"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created, or combined with the incoming flags"}};
  Param<double> min_amplitude{
      this, "min_amplitude", {.unit = "counts", .min = 0, .text = "less is flagged as low_signal, e.g. 50 counts"}};
  Param<double> max_amplitude{
      this, "max_amplitude", {.unit = "counts", .min = 0, .text = "more is flagged as saturated, e.g. 20000 counts"}};
  Param<double> max_sigma{
      this, "max_sigma", {.unit = "m", .min = 0, .text = "a larger standard deviation is flagged as low_signal"}};
  Param<double> max_null2{this,
                          "max_null2",
                          {.min = 0,
                           .text = "a larger |N2| = |c0 - c1 + c2 - c3| / 4 relative to the amplitude is flagged as "
                                   "inconsistent, e.g. 5 %"}};
  Param<Image> bad_pixels{this,
                          "bad_pixels",
                          {.text = "pixels where this is not 0 are flagged as bad_pixel: {file, dataset}, as "
                                   "tofgraph calibrate noise writes it (dataset: bad)"}};
  Param<std::string> flagged{
      this,
      "flagged",
      {.text = "pixels with one of these flags are masked too, e.g. [saturated, wrapped, extrapolated]"}};
  Param<bool> invalidate{this, "invalidate", {.default_value = "true", .text = "false: pixels are only flagged"}};

  void prepare(Setup& setup) {
    const bool by_amplitude = min_amplitude.given() || max_amplitude.given() || max_null2.given();
    if (!by_amplitude && !max_sigma.given() && !flagged.given() && bad_pixels->empty())
      throw ConfigError("min_amplitude",
                        "there is nothing to do: give a limit, flags or a map, e.g. min_amplitude: 50 counts, "
                        "max_sigma: 20 mm, max_null2: 5 %, flagged: [saturated], bad_pixels: {file: noise.maps.h5, "
                        "dataset: bad}");
    if (by_amplitude && !amplitude.present())
      throw ConfigError(min_amplitude.given()   ? "min_amplitude"
                        : max_amplitude.given() ? "max_amplitude"
                                                : "max_null2",
                        "needs the amplitude, which does not arrive: put the mask after a decoder");
    if (max_sigma.given() && !sigma.present())
      throw ConfigError("max_sigma",
                        "needs sigma, which does not arrive: the camera's profile must know the noise (read_noise, "
                        "shot_noise), or a node must make it");
    if (max_null2.given()) check_samples(setup);
    if (!bad_pixels->empty() && !flags.present() && !amplitude.present() && !sigma.present())
      throw ConfigError("bad_pixels", "needs decoded frames: put the mask after a decoder");
    if (min_amplitude.given() && max_amplitude.given() && *min_amplitude > *max_amplitude)
      throw ConfigError("min_amplitude", "is above max_amplitude: no pixel would be left");
    mask_ = bits_of(*flagged);
    if (flagged.given() && !flags.present())
      throw ConfigError("flagged", "needs flags, which do not arrive: put the mask after a decoder");
    flags.provide(setup);
    lengths_.prepare(setup, {});
  }

  void process(Frame& frame) const {
    const std::pair<std::size_t, std::size_t> size = size_of(frame);
    const Array<std::uint16_t> bits = flags(frame, size.first, size.second);
    thread_local std::vector<std::uint16_t> found;
    found.assign(bits.size(), 0);
    if (min_amplitude.given() || max_amplitude.given()) by_amplitude(amplitude(frame), found);
    if (max_sigma.given()) by_sigma(sigma(frame), found);
    if (max_null2.given()) by_null2(frame, amplitude(frame), found);
    if (!bad_pixels->empty()) by_map(size, found);
    for (std::size_t i = 0; i < bits.size(); ++i) {
      const bool masked = found[i] != 0 || (bits[i] & mask_) != 0;
      bits[i] = static_cast<std::uint16_t>(bits[i] | found[i] | (masked && *invalidate ? flag::invalid : 0));
    }
    lengths_.invalidate(frame, bits);
  }

 private:
  static constexpr std::pair<const char*, std::uint16_t> names[] = {{"saturated", flag::saturated},
                                                                    {"inconsistent", flag::inconsistent},
                                                                    {"low_signal", flag::low_signal},
                                                                    {"wrapped", flag::wrapped},
                                                                    {"mixed", flag::mixed},
                                                                    {"outside_lens", flag::outside_lens},
                                                                    {"user", flag::user},
                                                                    {"extrapolated", flag::extrapolated},
                                                                    {"filled", flag::filled},
                                                                    {"bad_pixel", flag::bad_pixel}};

  static std::uint16_t bit_of(const std::string& word) {
    std::string all;
    for (const auto& [name, bit] : names) {
      if (word == name) return bit;
      all.append(all.empty() ? "" : ", ").append(name);
    }
    throw ConfigError("flagged", "there is no flag '" + word + "'; there are " + all);
  }

  static std::uint16_t bits_of(const std::string& words) {
    std::istringstream stream(words);
    std::uint16_t bits = 0;
    for (std::string word; stream >> word;) bits = static_cast<std::uint16_t>(bits | bit_of(word));
    return bits;
  }

  void check_samples(const Setup& setup) {
    if (!taps.present() && !phases.present())
      throw ConfigError("max_null2", "needs the samples, taps or phases, which do not arrive");
    const physics::Exposures exposures = physics::exposures_of(setup.exposures());
    if (const std::string problem = physics::not_the_four(exposures); !problem.empty())
      throw ConfigError("max_null2", problem);
  }

  std::pair<std::size_t, std::size_t> size_of(const Frame& frame) const {
    if (amplitude.present()) return {amplitude(frame).rows(), amplitude(frame).columns()};
    if (sigma.present()) return {sigma(frame).rows(), sigma(frame).columns()};
    const Array<const std::uint16_t> known(frame.find("flags"));
    if (known.size() == 0) throw std::runtime_error("needs flags, amplitude or sigma");
    return {known.rows(), known.columns()};
  }

  void by_amplitude(const Array<const float>& image, std::vector<std::uint16_t>& found) const {
    const auto low = static_cast<float>(min_amplitude.given() ? *min_amplitude : 0);
    const auto high = static_cast<float>(max_amplitude.given() ? *max_amplitude : HUGE_VAL);
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (!(image[i] >= low)) found[i] |= flag::low_signal;
      if (image[i] > high) found[i] |= flag::saturated;
    }
  }

  void by_map(std::pair<std::size_t, std::size_t> size, std::vector<std::uint16_t>& found) const {
    if (bad_pixels->rows != size.first || bad_pixels->columns != size.second)
      throw std::runtime_error("bad_pixels is " + std::to_string(bad_pixels->columns) + " x " +
                               std::to_string(bad_pixels->rows) + " px, the frame " + std::to_string(size.second) +
                               " x " + std::to_string(size.first));
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (bad_pixels->data[i] != 0) found[i] |= flag::bad_pixel;
    }
  }

  void by_sigma(const Array<const float>& image, std::vector<std::uint16_t>& found) const {
    const auto limit = static_cast<float>(*max_sigma);
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (!(image[i] <= limit)) found[i] |= flag::low_signal;
    }
  }

  void by_null2(const Frame& frame, const Array<const float>& image, std::vector<std::uint16_t>& found) const {
    const tofgraph_view samples = frame.find(taps.present() ? taps.channel() : phases.channel());
    switch (samples.type) {
      case TOFGRAPH_TYPE_U16:
        return null2(Array<const std::uint16_t>(samples).data(), true, image, found);
      case TOFGRAPH_TYPE_I16:
        return null2(Array<const std::int16_t>(samples).data(), false, image, found);
      case TOFGRAPH_TYPE_I32:
        return null2(Array<const std::int32_t>(samples).data(), false, image, found);
      default:
        return null2(Array<const float>(samples).data(), false, image, found);
    }
  }

  template <class T>
  void null2(const T* samples, bool of_taps, const Array<const float>& image, std::vector<std::uint16_t>& found) const {
    const std::size_t n = found.size();
    const auto limit = static_cast<float>(*max_null2);
    const auto sample = [&](std::size_t k, std::size_t i) {
      if (!of_taps) return static_cast<float>(samples[k * n + i]);
      return static_cast<float>(samples[2 * k * n + i]) - static_cast<float>(samples[(2 * k + 1) * n + i]);
    };
    for (std::size_t i = 0; i < n; ++i) {
      const float value = (sample(0, i) - sample(1, i) + sample(2, i) - sample(3, i)) / 4;
      if (!(std::abs(value) <= limit * image[i])) found[i] |= flag::inconsistent;
    }
  }

  std::uint16_t mask_ = 0;
  OtherLengths lengths_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Mask, "Masks pixels by amplitude, sigma, null channel or flags")
