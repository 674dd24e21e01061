// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A channel as pictures, one per frame: false colours for viewing, counts or floats for further processing.
#include <tofgraph/stage.hpp>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>

#include "config/log.hpp"
#include "io/output_file.hpp"
#include "plugins/sinks/channel_pictures.hpp"

namespace tofgraph {
namespace {

const cv::Scalar invalid_grey(dot_of(io::invalid_colour));
constexpr int margin = 12, title_height = 24, bar_width = 22, legend_line = 20;

/// Draws each pixel as zoom x zoom dots in the colour of its value; invalid pixels are grey.
cv::Mat colours(const cv::Mat& image, const Range& range, int zoom) {
  cv::Mat level, picture, valid, large;
  cv::compare(image, image, valid, cv::CMP_EQ);  // NaN compares unequal
  cv::Mat((image - range.low) * (255 / (range.high - range.low))).convertTo(level, CV_8U);
  cv::applyColorMap(level, picture, level_colours());
  picture.setTo(invalid_grey, ~valid);
  cv::resize(picture, large, {}, zoom, zoom, cv::INTER_NEAREST);
  return large;
}

/// Colours of a pixel's flags. `invalid` is shown only if no other flag gives the reason.
std::vector<io::Colour> flag_colours_of(std::uint32_t flags) {
  if (flags == 0) return {io::no_flag_colour};
  if (flags == flag::invalid) return {io::invalid_colour};
  flags &= ~std::uint32_t{flag::invalid};
  std::vector<io::Colour> colours;
  for (const io::FlagColour& known : io::flag_colours) {
    if ((flags & known.bit) != 0) colours.push_back(known.colour);
    flags &= ~std::uint32_t{known.bit};
  }
  if (flags != 0) colours.push_back(io::other_flag_colour);
  return colours;
}

/// Colour in a picture of flags and its meaning: a flag's name and its number of pixels.
struct LegendLine {
  io::Colour colour;
  std::string words;
};

std::vector<LegendLine> flag_legend(const cv::Mat& image) {
  std::array<std::size_t, io::flag_colours.size()> counts{};
  std::size_t none = 0, other = 0;
  std::for_each(image.begin<float>(), image.end<float>(), [&](float value) {
    auto flags = static_cast<std::uint32_t>(value);
    none += flags == 0 ? 1 : 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      counts[i] += (flags & io::flag_colours[i].bit) != 0 ? 1 : 0;
      flags &= ~std::uint32_t{io::flag_colours[i].bit};
    }
    other += flags != 0 ? 1 : 0;
  });
  std::vector<LegendLine> lines = {{io::no_flag_colour, fmt::format("none: {}", none)}};
  for (std::size_t i = 0; i < counts.size(); ++i)
    lines.push_back({io::flag_colours[i].colour, fmt::format("{}: {}", io::flag_colours[i].name, counts[i])});
  lines.push_back({io::other_flag_colour, fmt::format("other: {}", other)});
  return lines;
}

/// Draws each pixel as zoom x zoom dots that alternate between the colours of its flags.
cv::Mat flag_dots(const cv::Mat& image, int zoom) {
  cv::Mat dots(image.rows * zoom, image.cols * zoom, CV_8UC3);
  for (int r = 0; r < image.rows; ++r) {
    for (int c = 0; c < image.cols; ++c) {
      const std::vector<io::Colour> colours = flag_colours_of(static_cast<std::uint32_t>(image.at<float>(r, c)));
      for (int y = r * zoom; y < (r + 1) * zoom; ++y) {
        for (int x = c * zoom; x < (c + 1) * zoom; ++x)
          dots.at<cv::Vec3b>(y, x) = dot_of(colours[static_cast<std::size_t>(x + y) % colours.size()]);
      }
    }
  }
  return dots;
}

/// Returns a canvas with the picture, its title above it, and room for a legend beside it.
cv::Mat framed(const cv::Mat& dots, const cv::Size& legend, const std::string& title) {
  const int width = std::max(dots.cols + legend.width + 3 * margin, width_of(title) + 2 * margin);
  cv::Mat canvas(std::max(dots.rows, legend.height) + title_height + 2 * margin, width, CV_8UC3, white);
  dots.copyTo(canvas(cv::Rect(margin, margin + title_height, dots.cols, dots.rows)));
  text(canvas, title, {margin, margin + 12});
  return canvas;
}

void draw_sample(cv::Mat& canvas, const cv::Rect& place, const cv::Scalar& colour, const std::string& words) {
  cv::rectangle(canvas, place, colour, cv::FILLED);
  text(canvas, words, {place.x + place.width + beside_bar, place.y + 14});
}

}  // namespace

/// color: an 8-bit PNG of the picture, enlarged, with a scale; perceptually uniform colours (viridis), invalid pixels
/// grey; values outside the range are clamped. uint16: a PNG of value / scale, rounded; 0 is invalid. float32: a TIFF
/// of the values in SI, NaN where they are invalid. Channels of integers, like flags, have no invalid values: 0 is a 0.
/// `flags` in colour, without given limits: one colour per flag, and a legend with their names.
struct ImageWriter final : ChannelPictures {
  Param<Choice> format{
      this,
      "format",
      {.default_value = "auto", .choices = "auto color uint16 float32", .text = "auto: .png color, .tif float32"}};
  Param<double> scale{
      this,
      "scale",
      {.unit = "m|counts|1", .min = 1e-9, .text = "value of one count of uint16; default: 1 mm, 1 counts or 1"}};
  Param<std::int64_t> zoom{
      this,
      "zoom",
      {.min = 1, .max = 64, .text = "magnification of the colour picture; default: such that it has 400 rows"}};

  void prepare(Setup& setup) {
    prepare_pictures(setup);
    choose_format();
    check_unit(scale);
    const double usual = unit_ == "m" ? 1e-3 : 1;
    scale_ = scale.given() ? *scale : usual;
  }

  void process(Frame& frame) const {
    const cv::Mat image = values(frame.find(channel_.c_str()));
    if (image.empty()) throw std::runtime_error(fmt::format("'{}' has no pixel", channel_));
    const std::uint64_t number = frame.metadata().number;
    std::vector<std::uint8_t> bytes;
    if (format_ == "float32") {
      bytes = encoded(".tiff", image, {cv::IMWRITE_TIFF_COMPRESSION, 1});
    } else if (format_ == "uint16") {
      bytes = with_description(encoded(".png", counts(image)),
                               fmt::format("{}, {}{} per count{}", channel_, scale_, unit_.empty() ? "" : " " + unit_,
                                           whole_numbers_ ? "" : ", 0 is invalid"));
    } else if (flags_as_colours()) {
      const std::vector<LegendLine> legend = flag_legend(image);
      std::string words;
      for (const LegendLine& line : legend) words += (words.empty() ? "" : ", ") + line.words;
      bytes = with_description(encoded(".png", flag_picture(image, legend, number)), "flags, pixels: " + words);
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
      warn(fmt::format("{} of {} clipped to 0 to {} {}: use a larger scale", config::counted(beyond, "pixel"), channel_,
                       greatest * scale_, unit_));
    return result;
  }

  bool flags_as_colours() const {
    return channel_ == "flags" && whole_numbers_ && minimum.keyword() == "auto" && maximum.keyword() == "auto";
  }

  int factor(const cv::Mat& image) const {
    return zoom.given() ? static_cast<int>(*zoom) : std::max(1, (400 + image.rows - 1) / image.rows);
  }

  cv::Mat picture(const cv::Mat& image, const Range& shown, std::uint64_t number) const {
    const cv::Mat dots = colours(image, shown, factor(image));
    const auto [unit, per_si] = shown_unit(shown);
    constexpr int usual_labels = 78;  // minimum, so that all pictures of a series have the same size
    const int labels = std::max({usual_labels, scale_labels_width(shown, per_si), beside_bar + width_of("invalid")});
    const int height = std::max(dots.rows, 160);
    cv::Mat canvas = framed(dots, {bar_width + labels, height}, title_of(unit, number));
    const cv::Rect bar(dots.cols + 2 * margin, margin + title_height, bar_width, height - 2 * legend_line);
    draw_scale(canvas, bar, shown, per_si);
    draw_sample(canvas, {bar.x, bar.y + height - legend_line, bar_width, legend_line - 2}, invalid_grey, "invalid");
    return canvas;
  }

  cv::Mat flag_picture(const cv::Mat& image, const std::vector<LegendLine>& legend, std::uint64_t number) const {
    const cv::Mat dots = flag_dots(image, factor(image));
    const int words = beside_bar + width_of(fmt::format("extrapolated: {}", image.total()));
    const cv::Size beside(bar_width + words, legend_line * static_cast<int>(legend.size()));
    cv::Mat canvas = framed(dots, beside, title_of(unit_, number));
    cv::Rect place(dots.cols + 2 * margin, margin + title_height, bar_width, legend_line - 4);
    for (const LegendLine& line : legend) {
      draw_sample(canvas, place, cv::Scalar(dot_of(line.colour)), line.words);
      cv::rectangle(canvas, place, black);
      place.y += legend_line;
    }
    return canvas;
  }

  std::string format_;
  double scale_ = 1;
  mutable std::atomic<bool> warned_{false};
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::ImageWriter, "A channel as pictures: false colours, 16-bit counts, 32-bit floats")
