// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "report/scene_preview.hpp"

#include "report/chart.hpp"
#include "report/gnuplot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <vector>

namespace tofgraph::report {
namespace {

/// Draws every n-th pixel: a picture of a few hundred dots cannot show more.
std::size_t stride_of(const PreviewFrame& frame) { return std::max<std::size_t>(1, frame.columns / 320); }

/// Position of an element in the picture, dots from its upper left corner. gnuplot's own layout lets titles, scales and
/// the cloud overlap.
struct Place {
  double left, top, width, height;
};

/// Size of the drawing, dots.
constexpr int picture_width = 1500;
constexpr double image_width = 290, gap = 40, edge = 30, title_height = 80, below = 60, bar_width = 18, bar_room = 120,
                 cloud_more = 130;

class Layout {
 public:
  explicit Layout(const PreviewFrame& frame)
      : image_height_(std::clamp(image_width * static_cast<double>(frame.rows) / static_cast<double>(frame.columns),
                                 0.4 * image_width, 1.6 * image_width)) {}

  int height() const {
    return static_cast<int>(std::lround(title_height + 2 * image_height_ + below + 2 * edge + cloud_more));
  }
  Place phase(std::size_t i) const {
    return {edge + static_cast<double>(i) * (image_width + gap), title_height, image_width, image_height_};
  }
  /// Amplitude and distance, each with a scale beside it.
  Place lower(std::size_t i) const {
    return {edge + static_cast<double>(i) * (image_width + bar_room), title_height + image_height_ + below + edge,
            image_width, image_height_};
  }
  Place cloud() const {
    const Place before = lower(2);
    return {before.left + gap, before.top, picture_width - before.left - gap - bar_room, image_height_ + cloud_more};
  }
  static Place bar(const Place& image) { return {image.left + image.width + 12, image.top, bar_width, image.height}; }

  std::string margins(const Place& place) const {
    return fmt::format(
        "set lmargin at screen {}\nset rmargin at screen {}\nset tmargin at screen {}\nset bmargin at screen {}\n",
        across(place.left), across(place.left + place.width), up(place.top), up(place.top + place.height));
  }
  /// Title at a fixed position, because gnuplot places the title of a drawing inside it.
  std::string title(const Place& place, const std::string& words) const {
    return fmt::format("unset title\nset label {} at screen {}, {} center font ',13'\n", quoted(words),
                       across(place.left + place.width / 2), up(place.top - 27));
  }
  std::string scale(const Place& bar, const std::string& unit) const {
    return fmt::format("set colorbox user origin {}, {} size {}, {}\nset cblabel {} offset 1.2\n", across(bar.left),
                       up(bar.top + bar.height), across(bar.width), bar.height / height(), quoted(unit));
  }

 private:
  static double across(double dots) { return dots / picture_width; }
  double up(double dots) const { return 1 - dots / height(); }

  double image_height_;
};

std::vector<double> seen(const PreviewFrame& frame, std::span<const float> image) {
  const std::size_t stride = stride_of(frame), rows = frame.rows / stride, columns = frame.columns / stride;
  std::vector<double> values;
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) values.push_back(image[r * stride * frame.columns + c * stride]);
  }
  return values;
}

/// Image with its title; its colours and range are set before.
std::string panel(const PreviewFrame& frame, std::span<const float> image, const std::string& title) {
  const std::size_t stride = stride_of(frame), rows = frame.rows / stride, columns = frame.columns / stride;
  return fmt::format("set title {}\nset xrange [-0.5:{}]\nset yrange [-0.5:{}]\n", quoted(title),
                     static_cast<double>(columns) - 0.5, static_cast<double>(rows) - 0.5) +
         matrix_block("image", rows, columns, seen(frame, image)) + "plot $image matrix using 1:2:3 with image\n";
}

/// Title such as "image 3: 0 deg, 16 MHz".
std::string title_of(const physics::Exposures& exposures, std::size_t k) {
  const double phase = exposures[k].phase, frequency = exposures[k].frequency;
  std::string title = fmt::format("image {}: {} deg", k, physics::short_number(phase * 180 / M_PI));
  return frequency > 0 ? title + fmt::format(", {} MHz", physics::short_number(frequency * 1e-6)) : title;
}

/// Up to four of the images, with the same colours and one scale.
std::string phases(const PreviewFrame& frame, const Layout& layout) {
  constexpr std::size_t most = 4;
  const std::size_t n = frame.rows * frame.columns, images = frame.exposures.size();
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < std::min(most, images); ++i)
    shown.push_back(images > most ? i * (images - 1) / (most - 1) : i);
  std::vector<double> values;
  for (const std::size_t k : shown)
    std::ranges::copy(seen(frame, frame.phases.subspan(k * n, n)), std::back_inserter(values));
  const double usual = percentile_98(values), limit = usual > 0 ? usual : 1;  // scale for all-zero images
  std::string script = signed_palette() + fmt::format("set cbrange [{}:{}]\nunset colorbox\n", -limit, limit);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const Place place = layout.phase(i);
    if (i + 1 == shown.size()) script += layout.scale(Layout::bar(place), "counts");
    script += layout.margins(place) +
              panel(frame, frame.phases.subspan(shown[i] * n, n), title_of(frame.exposures, shown[i]));
  }
  return script;
}

/// Valid points, the far ones first so that near points cover them.
std::vector<std::span<const float>> points_of(const PreviewFrame& frame) {
  const std::size_t stride = 2 * stride_of(frame);
  std::vector<std::span<const float>> points;
  for (std::size_t r = 0; r < frame.rows; r += stride) {
    for (std::size_t c = 0; c < frame.columns; c += stride) {
      const auto p = frame.points.subspan(3 * (r * frame.columns + c), 3);
      if (std::isfinite(p[2])) points.push_back(p);
    }
  }
  std::ranges::sort(points, [](auto a, auto b) { return a[2] > b[2]; });
  return points;
}

/// Axis of the point cloud: its limits are half steps.
struct PreviewAxis {
  double first, last;
  PreviewAxis(double low, double high, double step)
      : first(std::floor(2 * low / step) * step / 2),
        last(std::max(std::ceil(2 * high / step) * step / 2, first + step / 2)) {}
  double length() const { return last - first; }
  std::string script(const char* name, double step) const {
    return fmt::format("set {0}range [{1}:{2}]\nset {0}tics {3} nomirror textcolor rgb '#333333'\n", name, first, last,
                       step);
  }
};

constexpr double tilt = 65, turn = 25;  // deg, of gnuplot's view

/// Position of gnuplot's axes box for which it and its numbers stay within `place`: the longest axis is as long as the
/// height given to gnuplot, for any `set view`.
Place place_of_box(const PreviewAxis& x, const PreviewAxis& y, const PreviewAxis& z, const Place& place) {
  constexpr double radian = std::numbers::pi / 180, numbers_beside = 130, numbers_below = 50;
  const double c = std::cos(turn * radian), s = std::sin(turn * radian);
  const double longest = std::max({x.length(), y.length(), z.length()});
  const double width = (c * x.length() + s * y.length()) / longest;
  const double height =
      (std::sin(tilt * radian) * z.length() + std::cos(tilt * radian) * (s * x.length() + c * y.length())) / longest;
  const double share =
      std::min((place.width - numbers_beside) / width, (place.height - numbers_below) / height) / place.height;
  const Place box{place.left, place.top, share * place.width, share * place.height};
  return {place.left + (place.width - box.width) / 2, place.top + (place.height - numbers_below - box.height) / 2,
          box.width, box.height};
}

/// Step of 1, 2 or 5 times a power of ten, for about four steps in a length.
double step_of(double length) {
  const double power = std::pow(10, std::floor(std::log10(length / 4)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (length / (factor * power) <= 5) return factor * power;
  }
  return 10 * power;
}

std::string cloud(const PreviewFrame& frame, const Layout& layout) {
  const std::vector<std::span<const float>> points = points_of(frame);
  if (points.empty()) return {};
  std::array<double, 3> low, high;
  double length = 1e-3;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto [least, most] = std::ranges::minmax(points, {}, [i](auto p) { return p[i]; });
    low[i] = least[i];
    high[i] = most[i];
    length = std::max(length, high[i] - low[i]);
  }
  const double step = step_of(length);
  const PreviewAxis x(low[0], high[0], step), y(low[2], high[2], step), z(-high[1], -low[1], step);
  const Place place = layout.cloud();
  std::string script = layout.margins(place_of_box(x, y, z, place)) + layout.scale(Layout::bar(place), "z / m") +
                       layout.title(place, "the points, seen from above right");
  script += fmt::format("set view {}, {}\nset view equal xyz\n", tilt, turn);
  script +=
      "set border 4095 lc rgb '#bbbbbb'\nset xyplane relative 0\n"
      "set xlabel 'x / m' offset 0,-0.7\nset ylabel 'z / m' offset 3,-0.5\nset zlabel '-y / m' rotate\n";
  script += x.script("x", step) + y.script("y", step) + z.script("z", step);
  script += "$points << END\n";
  for (const auto& p : points) script += fmt::format("{:.5g} {:.5g} {:.5g}\n", p[0], p[2], -p[1]);
  return script + "END\nsplot $points using 1:2:3:2 with points pt 7 ps 0.3 palette\n";
}

}  // namespace

std::string scene_preview(const PreviewFrame& frame) {
  const Layout layout(frame);
  std::string script = fmt::format(
      "set multiplot title {} font ',15'\nunset key\nunset xtics\nunset ytics\n",
      quoted(frame.exposures.size() > 4 ? fmt::format("{}: four of {} images", frame.title, frame.exposures.size())
                                        : frame.title));
  script += phases(frame, layout) + rising_palette() + "set cbrange [*:*]\n";
  script += layout.margins(layout.lower(0)) + layout.scale(Layout::bar(layout.lower(0)), "counts") +
            panel(frame, frame.amplitude, "amplitude");
  script += layout.margins(layout.lower(1)) + layout.scale(Layout::bar(layout.lower(1)), "m") +
            panel(frame, frame.distance, "distance");
  script += cloud(frame, layout) + "unset multiplot\n";
  return gnuplot_png(script, picture_width, layout.height());
}

}  // namespace tofgraph::report
