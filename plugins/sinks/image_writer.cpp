// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A channel as pictures, one a frame: false colours to look at, counts or floats to go on with.
#include <tofgraph/stage.hpp>

#include <fmt/format.h>
#include <boost/crc.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "io/output_file.hpp"
#include "plugins/sinks/frame_files.hpp"

namespace tofgraph {
namespace {

const cv::Scalar black(0, 0, 0), white(255, 255, 255), invalid_grey(170, 170, 170);

/// An interval of a channel's values, SI.
struct Range {
  double low, high;
};

/// The interval that holds 98 % of the valid values, so that single outliers do not darken the picture.
Range central_range(const cv::Mat& image) {
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

/// 1, 2 or 5 times a power of ten, so that about six steps make the interval.
double tick_step(double length) {
  const double power = std::pow(10, std::floor(std::log10(length / 6)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (length / (factor * power) <= 7) return factor * power;
  }
  return 10 * power;
}

void text(cv::Mat& picture, const std::string& words, cv::Point at) {
  cv::putText(picture, words, at, cv::FONT_HERSHEY_SIMPLEX, 0.5, black, 1, cv::LINE_AA);
}

/// Each pixel as zoom x zoom dots in the colour of its place in the range; invalid ones grey.
cv::Mat colours(const cv::Mat& image, const Range& range, int zoom) {
  cv::Mat level, picture, valid, large;
  cv::compare(image, image, valid, cv::CMP_EQ);  // NaN equals nothing
  cv::Mat((image - range.low) * (255 / (range.high - range.low))).convertTo(level, CV_8U);
  cv::applyColorMap(level, picture, cv::COLORMAP_VIRIDIS);
  picture.setTo(invalid_grey, ~valid);
  cv::resize(picture, large, {}, zoom, zoom, cv::INTER_NEAREST);
  return large;
}

/// The scale: what each colour means, in `unit`, of which an SI unit has `per_si`.
void draw_scale(cv::Mat& canvas, const cv::Rect& bar, const Range& range, double per_si) {
  cv::Mat ramp(256, 1, CV_8U), coloured;
  for (int i = 0; i < 256; ++i) ramp.at<std::uint8_t>(i) = static_cast<std::uint8_t>(255 - i);
  cv::applyColorMap(ramp, coloured, cv::COLORMAP_VIRIDIS);
  cv::resize(coloured, canvas(bar), bar.size(), 0, 0, cv::INTER_LINEAR);
  cv::rectangle(canvas, bar, black);
  const double low = range.low * per_si, high = range.high * per_si, step = tick_step(high - low);
  const int digits = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  for (double tick = std::ceil(low / step - 1e-9) * step; tick <= high + 1e-9 * step; tick += step) {
    const int y = bar.y + static_cast<int>(std::lround((high - tick) / (high - low) * (bar.height - 1)));
    cv::line(canvas, {bar.x + bar.width, y}, {bar.x + bar.width + 4, y}, black);
    text(canvas, fmt::format("{:.{}f}", tick + 0.0, digits), {bar.x + bar.width + 8, y + 5});
  }
}

/// A PNG with a line of text in it, which image viewers show as its description (PNG specification, tEXt).
std::vector<std::uint8_t> with_description(const std::vector<std::uint8_t>& png, const std::string& words) {
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

}  // namespace

/// color: an 8-bit PNG of the picture enlarged, with a scale; perceptually uniform colours (viridis), invalid pixels
/// grey; values beyond the range have the colours of its ends. uint16: a PNG of value / scale, rounded; 0 is invalid.
/// float32: a TIFF of the values in SI, NaN where they are invalid. Channels of whole numbers, like flags, have no
/// invalid values: 0 is a 0.
struct ImageWriter final : Sink {
  In<void> every{this, "*", {.text = "has the image"}};
  Param<std::string> channel{
      this,
      "channel",
      {.text = "the image; default: the first there is of depth, range, distance, amplitude, intensity"}};
  Param<OutputFile> path{
      this, "path", {.required = true, .text = "the files, e.g. out/range_{frame:06}.png; {frame} is the number"}};
  Param<Choice> format{
      this,
      "format",
      {.fallback = "auto", .choices = "auto color uint16 float32", .text = "auto: .png color, .tif float32"}};
  Param<double> scale{
      this,
      "scale",
      {.unit = "m|counts|1", .min = 1e-9, .text = "of one count of uint16; default: 1 mm, 1 counts or 1"}};
  Param<double> minimum{this,
                        "minimum",
                        {.unit = "m|counts|1",
                         .fallback = "auto",
                         .choices = "auto",
                         .text = "of the colours; auto: 1 % of the frame's valid pixels are below"}};
  Param<double> maximum{
      this,
      "maximum",
      {.unit = "m|counts|1", .fallback = "auto", .choices = "auto", .text = "of the colours; auto: 1 % are above"}};
  Param<std::int64_t> zoom{
      this, "zoom", {.min = 1, .max = 64, .text = "of the colours' picture; default: so that it has 400 rows"}};
  Param<bool> overwrite{this, "overwrite", {.fallback = "false", .text = "replace existing files"}};

  void prepare(Setup& setup) {
    choose_channel(setup);
    choose_format();
    for (const Param<double>* parameter : {&scale, &minimum, &maximum}) check_unit(*parameter);
    if (minimum.word() != "auto" && maximum.word() != "auto" && !(*minimum < *maximum))
      throw ConfigError("minimum", "must be less than maximum");
    const double usual = unit_ == "m" ? 1e-3 : 1;
    scale_ = scale.given() ? *scale : usual;
    pattern_ = frame_files(*this, setup, *path, *overwrite);
  }

  void process(Frame& frame) const {
    const cv::Mat image = values(frame.find(channel_.c_str()));
    const std::uint64_t number = frame.metadata().number;
    std::vector<std::uint8_t> bytes;
    if (format_ == "float32") {
      bytes = encoded(".tiff", image, {cv::IMWRITE_TIFF_COMPRESSION, 1});
    } else if (format_ == "uint16") {
      bytes = with_description(encoded(".png", counts(image)),
                               fmt::format("{}, {}{} per count{}", channel_, scale_, unit_.empty() ? "" : " " + unit_,
                                           whole_numbers_ ? "" : ", 0 is invalid"));
    } else {
      const Range shown = range(image);
      bytes = with_description(encoded(".png", picture(image, shown, number)),
                               fmt::format("{}, colours from {:.6g} to {:.6g}{}", channel_, shown.low, shown.high,
                                           unit_.empty() ? "" : " " + unit_));
    }
    io::OutputFile file(pattern_.path(number));
    file.write(std::as_bytes(std::span(bytes)));
    file.commit();
  }

 private:
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
    whole_numbers_ = found->type != TOFGRAPH_F32 && found->type != TOFGRAPH_F64;
  }

  /// @throws std::runtime_error when the picture cannot be a file of that kind, as one too large
  std::vector<std::uint8_t> encoded(const char* extension, const cv::Mat& image,
                                    const std::vector<int>& options = {}) const {
    const auto refuse = [&](const std::string& why) {
      throw std::runtime_error(fmt::format("'{}' as a picture of {} x {} px cannot be encoded as {}{}", channel_,
                                           image.cols, image.rows, extension, why));
    };
    std::vector<std::uint8_t> bytes;
    try {
      if (!cv::imencode(extension, image, bytes, options)) refuse("");
    } catch (const cv::Exception& error) {
      refuse(fmt::format(": {}", error.what()));
    }
    return bytes;
  }

  void choose_format() {
    const std::string extension = std::filesystem::path(std::string(*path)).extension().string();
    const bool png = extension == ".png", tiff = extension == ".tif" || extension == ".tiff";
    if (!png && !tiff) throw ConfigError("path", fmt::format("ends in '{}', expected .png or .tif", extension));
    format_ = *format != "auto" ? static_cast<const std::string&>(*format) : png ? "color" : "float32";
    if ((format_ == "float32") != tiff)
      throw ConfigError(
          "format", fmt::format("{} is written as {}, but path ends in {}", format_, png ? ".tif" : ".png", extension));
  }

  /// A limit has the unit of the channel.
  void check_unit(const Param<double>& parameter) const {
    const std::string expected = unit_.empty() ? "1" : unit_;
    if (!parameter.given() || parameter.word() == "auto" || parameter.word() == expected) return;
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
    return result;
  }

  Range range(const cv::Mat& image) const {
    Range result = central_range(image);
    if (minimum.word() != "auto") result.low = *minimum;
    if (maximum.word() != "auto") result.high = *maximum;
    if (!(result.low < result.high)) {  // one value only, or a given end beyond all values
      const double step = std::max(1e-3 * std::abs(result.low), 1e-6);
      (maximum.word() != "auto" ? result.low : result.high) =
          maximum.word() != "auto" ? result.high - step : result.low + step;
    }
    return result;
  }

  cv::Mat counts(const cv::Mat& image) const {
    const double greatest = std::numeric_limits<std::uint16_t>::max();
    cv::Mat result(image.size(), CV_16U);
    std::size_t beyond = 0;
    std::transform(image.begin<float>(), image.end<float>(), result.begin<std::uint16_t>(), [&](float value) {
      const double count = std::isfinite(value) ? std::round(value / scale_) : 0;
      beyond += count < 0 || count > greatest ? 1 : 0;
      return static_cast<std::uint16_t>(std::clamp(count, 0.0, greatest));
    });
    if (beyond != 0 && !warned_.exchange(true))
      warn(fmt::format("{} pixels of {} are beyond 0 to {} {} and were cut: give a greater scale", beyond, channel_,
                       greatest * scale_, unit_));
    return result;
  }

  cv::Mat picture(const cv::Mat& image, const Range& shown, std::uint64_t number) const {
    const int factor = zoom.given() ? static_cast<int>(*zoom) : std::max(1, (400 + image.rows - 1) / image.rows);
    const cv::Mat dots = colours(image, shown, factor);
    const bool millimetres = unit_ == "m" && std::max(std::abs(shown.low), std::abs(shown.high)) < 1;
    const std::string unit = millimetres ? "mm" : unit_;
    constexpr int margin = 12, title = 24, bar_width = 22, labels = 78;
    const int height = std::max(dots.rows, 160);
    cv::Mat canvas(height + title + 2 * margin, dots.cols + bar_width + labels + 3 * margin, CV_8UC3, white);
    dots.copyTo(canvas(cv::Rect(margin, margin + title, dots.cols, dots.rows)));
    text(canvas, fmt::format("{}{}, frame {}", channel_, unit.empty() ? "" : " / " + unit, number),
         {margin, margin + 12});
    const cv::Rect bar(dots.cols + 2 * margin, margin + title, bar_width, height - 40);
    draw_scale(canvas, bar, shown, millimetres ? 1e3 : 1);
    const cv::Rect sample(bar.x, bar.y + height - 20, bar_width, 18);
    cv::rectangle(canvas, sample, invalid_grey, cv::FILLED);
    text(canvas, "invalid", {sample.x + bar_width + 8, sample.y + 14});
    return canvas;
  }

  io::OutputPattern pattern_;
  std::string channel_, unit_, format_;
  double scale_ = 1;
  bool whole_numbers_ = false;
  mutable std::atomic<bool> warned_{false};
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::ImageWriter, "A channel as pictures: false colours, 16-bit counts, 32-bit floats")
