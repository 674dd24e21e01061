// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Common part of sinks that draw a channel, one picture per frame.
#pragma once

#include <fmt/format.h>
#include <tofgraph/physics/to_integer.hpp>
#include <tofgraph/stage.hpp>

#include <boost/crc.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "io/output_file.hpp"
#include "io/palettes.hpp"

namespace tofgraph {

inline const cv::Scalar black(0, 0, 0), white(255, 255, 255);
inline constexpr double text_scale = 0.5;

/// Interval of a channel's values, SI.
struct Range {
  double low, high;
};

/// Interval that contains 98 % of the valid values, so that outliers do not darken the picture.
inline Range central_range(const cv::Mat& image) {
  std::vector<float> values;
  std::copy_if(image.begin<float>(), image.end<float>(), std::back_inserter(values),
               [](float v) { return std::isfinite(v); });
  if (values.empty()) return {0, 1};
  const auto at = [&](double share) {
    const auto place = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return double{*place};
  };
  return {at(0.01), at(0.99)};
}

/// 1, 2 or 5 times a power of ten, so that the interval has about six steps.
inline double tick_step(double length) {
  const double power = std::pow(10, std::floor(std::log10(length / 6)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (length / (factor * power) <= 7) return factor * power;
  }
  return 10 * power;
}

/// Position on an axis and its label.
struct Tick {
  double value;
  std::string label;
};

/// Round numbers from low to high.
inline std::vector<Tick> ticks(double low, double high) {
  const double step = tick_step(high - low);
  const int digits = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  std::vector<Tick> result;
  for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i)
    result.push_back({i * step, fmt::format("{:.{}f}", i * step + 0.0, digits)});
  return result;
}

inline void text(cv::Mat& picture, const std::string& words, cv::Point at) {
  cv::putText(picture, words, at, cv::FONT_HERSHEY_SIMPLEX, text_scale, black, 1, cv::LINE_AA);
}

inline cv::Vec3b dot_of(io::Colour colour) {
  return {static_cast<std::uint8_t>(colour), static_cast<std::uint8_t>(colour >> 8U),
          static_cast<std::uint8_t>(colour >> 16U)};
}

/// Colours of the levels 0 to 255.
inline const cv::Mat& level_colours() {
  static const cv::Mat colours = [] {
    cv::Mat all(256, 1, CV_8UC3);
    for (int i = 0; i < 256; ++i) all.at<cv::Vec3b>(i) = dot_of(io::colour_at(io::rising_colours, i / 255.0));
    return all;
  }();
  return colours;
}

inline int width_of(const std::string& words) {
  return cv::getTextSize(words, cv::FONT_HERSHEY_SIMPLEX, text_scale, 1, nullptr).width;
}

constexpr int beside_bar = 8;  // dots between a scale and its labels

/// Width of the labels beside a scale, dots.
inline int scale_labels_width(const Range& range, double per_si) {
  int width = 0;
  for (const Tick& tick : ticks(range.low * per_si, range.high * per_si)) width = std::max(width, width_of(tick.label));
  return beside_bar + width;
}

/// Draws the colour scale with labels in a unit; `per_si` of this unit make one SI unit.
inline void draw_scale(cv::Mat& canvas, const cv::Rect& bar, const Range& range, double per_si) {
  cv::Mat ramp;
  cv::flip(level_colours(), ramp, 0);
  cv::resize(ramp, canvas(bar), bar.size(), 0, 0, cv::INTER_LINEAR);
  cv::rectangle(canvas, bar, black);
  const double low = range.low * per_si, high = range.high * per_si;
  for (const Tick& tick : ticks(low, high)) {
    const int y = bar.y + physics::to_integer((high - tick.value) / (high - low) * (bar.height - 1), 0);
    cv::line(canvas, {bar.x + bar.width, y}, {bar.x + bar.width + 4, y}, black);
    text(canvas, tick.label, {bar.x + bar.width + beside_bar, y + 5});
  }
}

/// Adds a line of text to a PNG, displayed by image viewers as its description (PNG specification, tEXt).
inline std::vector<std::uint8_t> with_description(const std::vector<std::uint8_t>& png, const std::string& words) {
  constexpr std::size_t after_header = 33;  // signature 8, IHDR 25
  const auto big_endian = [](std::size_t number) {
    return std::string{static_cast<char>(number >> 24U), static_cast<char>(number >> 16U),
                       static_cast<char>(number >> 8U), static_cast<char>(number)};
  };
  const std::string content = std::string("Description") + '\0' + words, chunk = "tEXt" + content;
  boost::crc_32_type crc;
  crc.process_bytes(chunk.data(), chunk.size());
  const std::string bytes = big_endian(content.size()) + chunk + big_endian(crc.checksum());
  std::vector<std::uint8_t> result = png;
  result.insert(result.begin() + after_header, bytes.begin(), bytes.end());
  return result;
}

/// Ports, parameters and files.
struct ChannelPictures : Sink {
  In<void> every{this, "*", {.text = "has the image"}};
  Param<std::string> channel{
      this,
      "channel",
      {.text = "the image; default: the first of depth, range, distance, amplitude, intensity that exists"}};
  Param<FrameFiles> path{
      this, "path", {.required = true, .text = "the files, e.g. out/range_{frame:06}.png; {frame} is the number"}};
  Param<double> minimum{this,
                        "minimum",
                        {.unit = "m|counts|1",
                         .default_value = "auto",
                         .choices = "auto",
                         .text = "lower end of the colours; auto: 1 % of the frame's valid pixels are below"}};
  Param<double> maximum{this,
                        "maximum",
                        {.unit = "m|counts|1",
                         .default_value = "auto",
                         .choices = "auto",
                         .text = "upper end of the colours; auto: 1 % are above"}};

 protected:
  void prepare_pictures(Setup& setup) {
    choose_channel(setup);
    for (const Param<double>* parameter : {&minimum, &maximum}) check_unit(*parameter);
    if (minimum.keyword() != "auto" && maximum.keyword() != "auto" && !(*minimum < *maximum))
      throw ConfigError("minimum", "must be less than maximum");
  }

  void store(const Frame& frame, const std::vector<std::uint8_t>& bytes) const {
    io::FileWriter(path.create(frame)).write(std::as_bytes(std::span(bytes)));
  }

  void choose_channel(const Setup& setup) {
    const tofgraph_channel* found = channel.given() ? setup.find(*channel) : nullptr;
    for (const char* name : {"depth", "range", "distance", "amplitude", "intensity"}) {
      if (!channel.given() && found == nullptr) found = setup.find(name);
    }
    if (found == nullptr) {
      std::vector<std::string> names;
      for (const tofgraph_channel& c : setup.channels()) names.emplace_back(c.name);
      throw ConfigError("channel",
                        fmt::format("there is no {}; what arrives has {}",
                                    channel.given() ? "'" + *channel + "'" : "image", fmt::join(names, ", ")));
    }
    if (found->rank != 2)
      throw ConfigError("channel", fmt::format("'{}' has {} dimensions, an image has two", found->name, found->rank));
    channel_ = found->name;
    unit_ = found->unit;
    whole_numbers_ = found->type != TOFGRAPH_TYPE_F32 && found->type != TOFGRAPH_TYPE_F64;
  }

  /// @throws std::runtime_error if the picture cannot be encoded in this format, e.g. because it is too large
  std::vector<std::uint8_t> encoded(const char* extension, const cv::Mat& image,
                                    const std::vector<int>& options = {}) const {
    std::vector<std::uint8_t> bytes;
    bool encoded = false;
    try {
      encoded = cv::imencode(extension, image, bytes, options);
    } catch (const cv::Exception&) {  // its message is about OpenCV internals
    }
    if (!encoded)
      throw std::runtime_error(fmt::format("'{}' as a picture of {} x {} px cannot be encoded as {}", channel_,
                                           image.cols, image.rows, extension));
    return bytes;
  }

  /// Checks that a limit has the unit of the channel.
  void check_unit(const Param<double>& parameter) const {
    const std::string expected = unit_.empty() ? "1" : unit_;
    if (!parameter.given() || parameter.keyword() == "auto" || parameter.keyword() == expected) return;
    throw ConfigError(parameter.parameter().name,
                      fmt::format("'{}' is in {}: write e.g. {}: {}", channel_, unit_.empty() ? "no unit" : unit_,
                                  parameter.parameter().name, unit_ == "m" ? "500 mm" : "100 " + unit_));
  }

  static cv::Mat values(const tofgraph_view& view) {
    constexpr int types[] = {-1, CV_32F, CV_64F, CV_8U, CV_16U, CV_16S, CV_32S};
    const cv::Mat image(static_cast<int>(view.extent[0]), static_cast<int>(view.extent[1]), types[view.type], view.data,
                        static_cast<std::size_t>(view.stride[0]));
    cv::Mat result;
    image.convertTo(result, CV_32F);
    if (is_length_channel(view.channel))
      std::replace_if(
          result.begin<float>(), result.end<float>(), [](float v) { return !is_valid_length(v); }, std::nanf(""));
    return result;
  }

  Range range(const cv::Mat& image) const {
    Range result = central_range(image);
    if (minimum.keyword() != "auto") result.low = *minimum;
    if (maximum.keyword() != "auto") result.high = *maximum;
    if (!(result.low < result.high)) {  // a single value only, or a given end beyond all values
      const double step = std::max(1e-3 * std::abs(result.low), 1e-6);
      (maximum.keyword() != "auto" ? result.low : result.high) =
          maximum.keyword() != "auto" ? result.high - step : result.low + step;
    }
    return result;
  }

  /// Unit of the numbers in a picture, and its number per SI unit: millimetres below a metre.
  std::pair<std::string, double> shown_unit(const Range& shown) const {
    if (unit_ == "m" && std::max(std::abs(shown.low), std::abs(shown.high)) < 1) return {"mm", 1e3};
    return {unit_, 1};
  }

  std::string title_of(const std::string& unit, std::uint64_t number) const {
    return fmt::format("{}{}, frame {}", channel_, unit.empty() ? "" : " / " + unit, number);
  }

  std::string channel_, unit_;
  bool whole_numbers_ = false;
};

}  // namespace tofgraph
