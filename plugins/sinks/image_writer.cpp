// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A channel as pictures, one a frame: false colours to look at, counts or floats to go on with.
#include <tofgraph/stage.hpp>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "io/output_file.hpp"
#include "plugins/sinks/channel_pictures.hpp"

namespace tofgraph {
namespace {

const cv::Scalar invalid_grey(170, 170, 170);

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
  const double low = range.low * per_si, high = range.high * per_si;
  for (const Tick& tick : ticks(low, high)) {
    const int y = bar.y + static_cast<int>(std::lround((high - tick.value) / (high - low) * (bar.height - 1)));
    cv::line(canvas, {bar.x + bar.width, y}, {bar.x + bar.width + 4, y}, black);
    text(canvas, tick.label, {bar.x + bar.width + 8, y + 5});
  }
}

}  // namespace

/// color: an 8-bit PNG of the picture enlarged, with a scale; perceptually uniform colours (viridis), invalid pixels
/// grey; values beyond the range have the colours of its ends. uint16: a PNG of value / scale, rounded; 0 is invalid.
/// float32: a TIFF of the values in SI, NaN where they are invalid. Channels of whole numbers, like flags, have no
/// invalid values: 0 is a 0.
struct ImageWriter final : ChannelPictures {
  Param<Choice> format{
      this,
      "format",
      {.default_value = "auto", .choices = "auto color uint16 float32", .text = "auto: .png color, .tif float32"}};
  Param<double> scale{
      this,
      "scale",
      {.unit = "m|counts|1", .min = 1e-9, .text = "of one count of uint16; default: 1 mm, 1 counts or 1"}};
  Param<std::int64_t> zoom{
      this, "zoom", {.min = 1, .max = 64, .text = "of the colours' picture; default: so that it has 400 rows"}};

  void prepare(Setup& setup) {
    prepare_pictures(setup);
    choose_format();
    check_unit(scale);
    const double usual = unit_ == "m" ? 1e-3 : 1;
    scale_ = scale.given() ? *scale : usual;
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
    store(frame, bytes);
  }

 private:
  void choose_format() {
    const std::string extension = std::filesystem::path(std::string(*path)).extension().string();
    const bool png = extension == ".png", tiff = extension == ".tif" || extension == ".tiff";
    if (!png && !tiff) throw ConfigError("path", fmt::format("ends in '{}', expected .png or .tif", extension));
    format_ = *format != "auto" ? static_cast<const std::string&>(*format) : png ? "color" : "float32";
    if ((format_ == "float32") != tiff)
      throw ConfigError(
          "format", fmt::format("{} is written as {}, but path ends in {}", format_, png ? ".tif" : ".png", extension));
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
    const auto [unit, per_si] = shown_unit(shown);
    constexpr int margin = 12, title = 24, bar_width = 22, labels = 78;
    const int height = std::max(dots.rows, 160);
    cv::Mat canvas(height + title + 2 * margin, dots.cols + bar_width + labels + 3 * margin, CV_8UC3, white);
    dots.copyTo(canvas(cv::Rect(margin, margin + title, dots.cols, dots.rows)));
    text(canvas, title_of(unit, number), {margin, margin + 12});
    const cv::Rect bar(dots.cols + 2 * margin, margin + title, bar_width, height - 40);
    draw_scale(canvas, bar, shown, per_si);
    const cv::Rect sample(bar.x, bar.y + height - 20, bar_width, 18);
    cv::rectangle(canvas, sample, invalid_grey, cv::FILLED);
    text(canvas, "invalid", {sample.x + bar_width + 8, sample.y + 14});
    return canvas;
  }

  std::string format_;
  double scale_ = 1;
  mutable std::atomic<bool> warned_{false};
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::ImageWriter, "A channel as pictures: false colours, 16-bit counts, 32-bit floats")
