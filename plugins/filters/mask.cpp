// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Masks pixels by quality criteria.
#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/exposures.hpp>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace tofgraph {

/// Each given limit marks the pixels beyond it with the corresponding flag: an amplitude below `min_amplitude` or a
/// sigma above `max_sigma` is low_signal, an amplitude above `max_amplitude` saturated, |N2| above `max_null2` times
/// the amplitude inconsistent. NaN exceeds every limit. Pixels outside the `polygon`, with a 0 in `image`, or with one
/// of the `codes` in a channel get the flag user. With `invalidate` these pixels, and those whose input has one of the
/// flags `flagged`, become invalid.
struct Mask final : Filter {
  In<float> amplitude{this, "amplitude", {.optional = true, .text = "for limits of the amplitude and of N2"}};
  In<float> sigma{this, "sigma", {.optional = true, .text = "for max_sigma"}};
  In<std::uint16_t> taps{this, "taps", {.shape = "P 2 H W", .optional = true, .text = "for max_null2, read first"}};
  In<void> phases{
      this, "phases", {.shape = "P H W", .optional = true, .text = "for max_null2; float32, int16 or int32"}};
  In<float> length{this,
                   "distance|range|depth",
                   {.name = "length", .optional = true, .text = "for codes, unless codes_of names another channel"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created, or combined with the incoming flags"}};
  Param<double> min_amplitude{
      this,
      "min_amplitude",
      {.unit = "counts", .min = 0, .text = "less is flagged as low_signal, e.g. 50 counts", .live = true}};
  Param<double> max_amplitude{
      this,
      "max_amplitude",
      {.unit = "counts", .min = 0, .text = "more is flagged as saturated, e.g. 20000 counts", .live = true}};
  Param<double> max_sigma{
      this,
      "max_sigma",
      {.unit = "m", .min = 0, .text = "a larger standard deviation is flagged as low_signal", .live = true}};
  Param<double> max_null2{this,
                          "max_null2",
                          {.min = 0,
                           .text = "a larger |N2| = |c0 - c1 + c2 - c3| / 4 relative to the amplitude is flagged as "
                                   "inconsistent, e.g. 5 %"}};
  Param<Image> bad_pixels{this,
                          "bad_pixels",
                          {.choices = "mask",
                           .text = "pixels where this is not 0 are flagged as bad_pixel: {file, dataset}, as "
                                   "tofgraph calibrate noise writes it (dataset: bad)"}};
  Param<std::vector<double>> polygon{
      this,
      "polygon",
      {.text = "corners x1, y1, x2, y2, ... in pixels from 0, e.g. [20, 10, 180, 10, 180, 150]; pixels whose centre is "
               "outside are masked"}};
  Param<Image> image{
      this,
      "image",
      {.choices = "mask", .text = "pixels where this is 0 are masked: a picture, an array or {file, dataset}"}};
  Param<Choice> keep{this,
                     "keep",
                     {.default_value = "inside",
                      .choices = "inside outside",
                      .text = "outside: polygon and image are what is masked instead"}};
  Param<std::vector<double>> codes{
      this,
      "codes",
      {.text = "pixels with one of these values are masked, in the unit of the channel, e.g. [0, 65.535]"}};
  Param<std::string> codes_of{
      this,
      "codes_of",
      {.text = "the channel that has the codes, e.g. amplitude; of several images one is enough; default: the length"}};
  Param<std::string> flagged{
      this,
      "flagged",
      {.text = "pixels with one of these flags are masked too, e.g. [saturated, wrapped, extrapolated]"}};
  Param<bool> invalidate{
      this, "invalidate", {.default_value = "true", .text = "false: pixels are only flagged", .live = true}};

  void prepare(Setup& setup) {
    const bool by_amplitude = min_amplitude.given() || max_amplitude.given() || max_null2.given();
    if (!by_amplitude && !max_sigma.given() && !flagged.given() && !by_place() && !codes.given())
      throw ConfigError("min_amplitude",
                        "there is nothing to do: give a limit, flags or a map, e.g. min_amplitude: 50 counts, "
                        "max_sigma: 20 mm, max_null2: 5 %, flagged: [saturated], bad_pixels: {file: noise.maps.h5, "
                        "dataset: bad}, polygon: [20, 10, 180, 10, 180, 150], image: mask.png, codes: [0, 65.535]");
    check_limits();
    if (max_null2.given()) check_samples(setup);
    if (by_place() && !flags.present() && !amplitude.present() && !sigma.present() && !length.present())
      throw ConfigError(!bad_pixels->empty() ? "bad_pixels"
                        : !image->empty()    ? "image"
                                             : "polygon",
                        "needs decoded frames: put the mask after a decoder");
    if (polygon.given() && (polygon->size() < 6 || polygon->size() % 2 != 0))
      throw ConfigError("polygon", "has " + std::to_string(polygon->size()) +
                                       " numbers, expected two for each of three or more corners, e.g. polygon: [20, "
                                       "10, 180, 10, 180, 150]");
    if (keep.given() && !polygon.given() && image->empty())
      throw ConfigError("keep", "is for polygon and image, of which none is given");
    check_codes(setup);
    mask_ = bits_of(*flagged);
    if (flagged.given() && !flags.present())
      throw ConfigError("flagged", "needs flags, which do not arrive: put the mask after a decoder");
    flags.provide(setup);
    lengths_.prepare(setup, {});
  }

  void parameters_changed() { check_limits(); }

  void process(Frame& frame) const {
    const std::pair<std::size_t, std::size_t> size = size_of(frame);
    const Array<std::uint16_t> bits = flags(frame, size.first, size.second);
    thread_local std::vector<std::uint16_t> found;
    found.assign(bits.size(), 0);
    if (min_amplitude.given() || max_amplitude.given()) by_amplitude(amplitude(frame), found);
    if (max_sigma.given()) by_sigma(sigma(frame), found);
    if (max_null2.given()) by_null2(frame, amplitude(frame), found);
    if (!bad_pixels->empty()) by_map(*bad_pixels, size, [&](std::size_t i) { found[i] |= flag::bad_pixel; });
    if (polygon.given() || !image->empty()) by_region(size, found);
    if (codes.given()) by_codes(frame, size, found);
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

  void check_limits() const {
    const bool by_amplitude = min_amplitude.given() || max_amplitude.given() || max_null2.given();
    if (by_amplitude && !amplitude.present())
      throw ConfigError(min_amplitude.given()   ? "min_amplitude"
                        : max_amplitude.given() ? "max_amplitude"
                                                : "max_null2",
                        "needs the amplitude, which does not arrive: put the mask after a decoder");
    if (max_sigma.given() && !sigma.present())
      throw ConfigError("max_sigma",
                        "needs sigma, which does not arrive: the camera's profile must know the noise (read_noise, "
                        "shot_noise), or a node must make it");
    if (min_amplitude.given() && max_amplitude.given() && *min_amplitude > *max_amplitude)
      throw ConfigError("min_amplitude", "is above max_amplitude: no pixel would be left");
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
    if (length.present()) return {length(frame).rows(), length(frame).columns()};
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

  bool by_place() const { return !bad_pixels->empty() || !image->empty() || polygon.given(); }

  /// Calls mark(pixel) where a map is not 0.
  template <class Mark> static void by_map(const Image& map, std::pair<std::size_t, std::size_t> size, Mark&& mark) {
    if (map.rows != size.first || map.columns != size.second)
      throw std::runtime_error("the map is " + std::to_string(map.columns) + " x " + std::to_string(map.rows) +
                               " px, the frame " + std::to_string(size.second) + " x " + std::to_string(size.first));
    for (std::size_t i = 0; i < map.rows * map.columns; ++i) {
      if (map.data[i] != 0) mark(i);
    }
  }

  void by_region(std::pair<std::size_t, std::size_t> size, std::vector<std::uint16_t>& found) const {
    thread_local std::vector<char> inside;
    inside.assign(found.size(), image->empty() ? 1 : 0);
    if (!image->empty()) by_map(*image, size, [](std::size_t i) { inside[i] = 1; });
    for (std::size_t i = 0; i < found.size(); ++i) {
      const std::size_t row = i / size.second, column = i % size.second;
      const auto x = static_cast<double>(column), y = static_cast<double>(row);
      const bool in = inside[i] != 0 && (!polygon.given() || in_polygon(x, y));
      if (in != (*keep == "inside")) found[i] |= flag::user;
    }
  }

  /// Counts the edges crossed by a ray in x; points on an edge are inside.
  bool in_polygon(double x, double y) const {
    bool inside = false;
    const std::size_t n = polygon->size();
    for (std::size_t i = 0; i < n; i += 2) {
      const double x1 = (*polygon)[i], y1 = (*polygon)[i + 1], x2 = (*polygon)[(i + 2) % n],
                   y2 = (*polygon)[(i + 3) % n];
      const double side = (x2 - x1) * (y - y1) - (y2 - y1) * (x - x1);
      const bool within =
          std::min(x1, x2) <= x && x <= std::max(x1, x2) && std::min(y1, y2) <= y && y <= std::max(y1, y2);
      if (side == 0 && within) return true;
      if ((y1 > y) != (y2 > y) && (side > 0) == (y2 > y1)) inside = !inside;
    }
    return inside;
  }

  void check_codes(const Setup& setup) {
    if (codes_of.given() && !codes.given()) throw ConfigError("codes_of", "names a channel, but no codes are given");
    if (!codes.given()) return;
    coded_ = codes_of.given() ? *codes_of : std::string(length.channel());
    if (coded_.empty()) throw ConfigError("codes_of", "no length arrives: name the channel, e.g. codes_of: amplitude");
    const tofgraph_channel* channel = setup.find(coded_);
    if (channel == nullptr) throw ConfigError("codes_of", "there is no channel '" + coded_ + "'");
    const bool image_of_pixels = channel->rank >= 2 && coded_ != "points" && coded_ != "rays";
    if (!image_of_pixels || element_size(channel->type) == 0 || channel->type == TOFGRAPH_TYPE_F64)
      throw ConfigError("codes_of", "'" + coded_ + "' is not an image of one number per pixel");
  }

  void by_codes(const Frame& frame, std::pair<std::size_t, std::size_t> size, std::vector<std::uint16_t>& found) const {
    const tofgraph_view values = frame.find(coded_.c_str());
    if (values.data == nullptr || values.extent[values.rank - 2] != size.first ||
        values.extent[values.rank - 1] != size.second)
      throw std::runtime_error("'" + coded_ + "' is not an image of the frame's size");
    switch (values.type) {
      case TOFGRAPH_TYPE_U8:
        return find_codes<std::uint8_t>(values, found);
      case TOFGRAPH_TYPE_U16:
        return find_codes<std::uint16_t>(values, found);
      case TOFGRAPH_TYPE_I16:
        return find_codes<std::int16_t>(values, found);
      case TOFGRAPH_TYPE_I32:
        return find_codes<std::int32_t>(values, found);
      default:
        return find_codes<float>(values, found);
    }
  }
  template <class T> void find_codes(const tofgraph_view& view, std::vector<std::uint16_t>& found) const {
    const Array<const T> values(view);
    for (std::size_t i = 0; i < values.size(); ++i) {
      for (const double code : *codes) {  // 65.535 and 65535 x 0.001 differ in the last digit of float32
        if (std::abs(static_cast<double>(values[i]) - code) <= 1e-6 * std::abs(code))
          found[i % found.size()] |= flag::user;
      }
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
  std::string coded_;  // channel with the codes
  OtherLengths lengths_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Mask, "Masks pixels by amplitude, sigma, null channel, place, codes or flags")
