// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "report/scene_preview.hpp"

#include "report/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace tofgraph::report {
namespace {

/// Every n-th pixel: a picture of a few hundred dots shows no more.
std::size_t stride_of(const PreviewFrame& frame) { return std::max<std::size_t>(1, frame.columns / 320); }

std::string panel(const PreviewFrame& frame, std::span<const float> image, const std::string& title,
                  const std::string& unit, bool around_zero) {
  const std::size_t stride = stride_of(frame), rows = frame.rows / stride, columns = frame.columns / stride;
  std::vector<double> values;
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) values.push_back(image[r * stride * frame.columns + c * stride]);
  }
  const double usual = percentile_98(values), limit = usual > 0 ? usual : 1;  // a dark image has a scale too
  const std::string range = around_zero ? fmt::format("set cbrange [{}:{}]\n", -limit, limit) : "set cbrange [*:*]\n";
  return fmt::format(
             "set title {}\nset cblabel {}\nset size ratio -1\n{}{}set xrange [-0.5:{}]\nset yrange [-0.5:{}]\n",
             quoted(title), quoted(unit), around_zero ? signed_palette : rising_palette, range,
             static_cast<double>(columns) - 0.5, static_cast<double>(rows) - 0.5) +
         matrix_block("image", rows, columns, values) + "plot $image matrix using 1:2:3 with image\n";
}

/// "image 3: 0 deg, 16 MHz"
std::string title_of(const physics::Exposures& exposures, std::size_t k) {
  const double phase = exposures[k].phase, frequency = exposures[k].frequency;
  std::string title = fmt::format("image {}: {} deg", k, physics::short_number(phase * 180 / M_PI));
  return frequency > 0 ? title + fmt::format(", {} MHz", physics::short_number(frequency * 1e-6)) : title;
}

std::string cloud(const PreviewFrame& frame) {
  std::string script =
      "set title 'the points, seen from above right'\nset cblabel 'z / m'\nset view 65, 25, 1.4, 1\n"
      "set colorbox user origin 0.93, 0.08 size 0.01, 0.3\n"
      "set view equal xyz\nset autoscale\nset border 0\nunset xlabel\nunset ylabel\nunset ztics\n";
  script += rising_palette;
  script += "set cbrange [*:*]\n$points << END\n";
  const std::size_t stride = 2 * stride_of(frame);
  std::vector<std::span<const float>> points;
  for (std::size_t r = 0; r < frame.rows; r += stride) {
    for (std::size_t c = 0; c < frame.columns; c += stride) {
      const auto p = frame.points.subspan(3 * (r * frame.columns + c), 3);
      if (!std::isfinite(p[2])) continue;
      points.push_back(p);
    }
  }
  std::ranges::sort(points, [](auto a, auto b) { return a[2] > b[2]; });  // near ones hide those behind
  for (const auto& p : points) script += fmt::format("{:.5g} {:.5g} {:.5g}\n", p[0], p[2], -p[1]);
  return !points.empty() ? script + "END\nsplot $points using 1:2:3:2 with points pt 7 ps 0.25 palette\n"
                         : std::string();
}

}  // namespace

std::string scene_preview(const PreviewFrame& frame) {
  const std::size_t n = frame.rows * frame.columns;
  std::string script = fmt::format(
      "set multiplot layout 2,4 title {}\nunset key\nunset xtics\nunset ytics\n",
      quoted(frame.exposures.size() > 4 ? fmt::format("{}: four of {} images", frame.title, frame.exposures.size())
                                        : frame.title));
  constexpr std::size_t shown = 4;
  const std::size_t images = frame.exposures.size();
  for (std::size_t i = 0; i < shown; ++i) {
    const std::size_t k = images > shown ? i * (images - 1) / (shown - 1) : i;
    script += k < images ? panel(frame, frame.phases.subspan(k * n, n), title_of(frame.exposures, k), "counts", true)
                         : "set multiplot next\n";
  }
  script += panel(frame, frame.amplitude, "amplitude", "counts", false);
  script += panel(frame, frame.distance, "distance", "m", false);
  script += "set size noratio 0.52, 0.6\nset origin 0.48, -0.06\n" + cloud(frame) + "unset multiplot\n";
  return gnuplot_png(script, 1500, 720);
}

}  // namespace tofgraph::report
