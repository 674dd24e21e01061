// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A channel as a surface in space, seen from above its image plane: one picture per frame.
#include <tofgraph/physics/to_integer.hpp>
#include <tofgraph/stage.hpp>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "plugins/sinks/channel_pictures.hpp"

namespace tofgraph {
namespace {

constexpr int bar_width = 16;
constexpr int supersampling = 3;  // samples per dot and axis, averaged for smooth edges
const cv::Scalar wall_grey(228, 228, 228), grid_grey(205, 205, 205);

/// Parallel projection of the box [-1/2, 1/2] x [-1/2, 1/2] x [0, height] (columns, rows, values) to a picture.
class View {
 public:
  /// @param azimuth rotation of the box about its value axis, rad; at 0 the last row is in front
  /// @param elevation of the viewer above the image plane, rad
  View(double azimuth, double elevation, const cv::Point3d& box)
      : c_(std::cos(azimuth)),
        s_(std::sin(azimuth)),
        rise_(std::sin(elevation)),
        flat_(std::cos(elevation)),
        box_(box) {}

  /// Scales the box to fit the frame.
  void fit(const cv::Rect2d& frame) {
    cv::Point2d least(1e9, 1e9), most(-1e9, -1e9);
    const auto side = [](int corner, int axis) { return (corner >> axis & 1) != 0 ? 1.0 : 0.0; };
    for (int corner = 0; corner < 8; ++corner) {
      const cv::Point2d p = direct({side(corner, 0) - 0.5, side(corner, 1) - 0.5, side(corner, 2)});
      least = {std::min(least.x, p.x), std::min(least.y, p.y)};
      most = {std::max(most.x, p.x), std::max(most.y, p.y)};
    }
    scale_ = std::min(frame.width / (most.x - least.x), frame.height / (most.y - least.y));
    shift_ = cv::Point2d(frame.x + frame.width / 2, frame.y + frame.height / 2) - scale_ / 2 * (least + most);
  }

  /// Maps a point of the unit box to the picture: x, y from -1/2 to 1/2, z from 0 to 1.
  cv::Point2d operator()(const cv::Point3d& p) const { return scale_ * direct(p) + shift_; }
  /// The same view for a picture enlarged by an integer factor.
  View enlarged(int factor) const {
    View result = *this;
    result.scale_ *= factor;
    result.shift_ = result.shift_ * factor + cv::Point2d(factor - 1, factor - 1) / 2;
    return result;
  }

 private:
  cv::Point2d direct(const cv::Point3d& p) const {
    const double x = p.x * box_.x, y = p.y * box_.y, z = p.z * box_.z;
    return {c_ * x - s_ * y, rise_ * (s_ * x + c_ * y) - flat_ * z};
  }

  double c_, s_, rise_, flat_;
  cv::Point3d box_;
  double scale_ = 1;
  cv::Point2d shift_;
};

/// Draws a text centred on a point.
void centred(cv::Mat& canvas, const std::string& words, const cv::Point2d& at) {
  const cv::Size size = cv::getTextSize(words, cv::FONT_HERSHEY_SIMPLEX, text_scale, 1, nullptr);
  text(canvas, words, cv::Point(cvRound(at.x - size.width / 2.0), cvRound(at.y + size.height / 2.0)));
}

/// The box around the surface: its far walls with a grid, and its axes.
class Box {
 public:
  /// @param front signs of columns and rows on the side of the box that is nearer to the viewer
  Box(const View& view, cv::Point2d front) : view_(view), front_(front / 2) {}

  /// Draws the bottom and the two walls behind the surface.
  void draw_walls(cv::Mat& canvas) const {
    const cv::Point2d f = front_;
    fill(canvas, {{{-0.5, -0.5, 0}, {0.5, -0.5, 0}, {0.5, 0.5, 0}, {-0.5, 0.5, 0}}}, white);
    fill(canvas, {{{-f.x, -f.y, 0}, {f.x, -f.y, 0}, {f.x, -f.y, 1}, {-f.x, -f.y, 1}}}, white);
    fill(canvas, {{{-f.x, -f.y, 0}, {-f.x, f.y, 0}, {-f.x, f.y, 1}, {-f.x, -f.y, 1}}}, wall_grey);
  }

  void column_axis(cv::Mat& canvas, const std::vector<Tick>& at, const std::string& name) const {
    for (const Tick& t : at) {
      line(canvas, {t.value, front_.y, 0}, {t.value, -front_.y, 0}, grid_grey);
      line(canvas, {t.value, -front_.y, 0}, {t.value, -front_.y, 1}, grid_grey);
      centred(canvas, t.label, beyond({t.value, front_.y, 0}, {0, front_.y}, 16));
    }
    line(canvas, {-0.5, front_.y, 0}, {0.5, front_.y, 0}, black);
    centred(canvas, name, beyond({0, front_.y, 0}, {0, front_.y}, 56));
  }

  void row_axis(cv::Mat& canvas, const std::vector<Tick>& at, const std::string& name) const {
    for (const Tick& t : at) {
      line(canvas, {front_.x, t.value, 0}, {-front_.x, t.value, 0}, grid_grey);
      line(canvas, {-front_.x, t.value, 0}, {-front_.x, t.value, 1}, grid_grey);
      centred(canvas, t.label, beyond({front_.x, t.value, 0}, {front_.x, 0}, 16));
    }
    line(canvas, {front_.x, -0.5, 0}, {front_.x, 0.5, 0}, black);
    centred(canvas, name, beyond({front_.x, 0, 0}, {front_.x, 0}, 56));
  }

  /// Draws the value axis along the leftmost vertical edge, with lines along both walls.
  void value_axis(cv::Mat& canvas, const std::vector<Tick>& at, const std::string& name) const {
    const cv::Point2d one(-front_.x, front_.y), other(front_.x, -front_.y);
    const bool left = view_({one.x, one.y, 0}).x < view_({other.x, other.y, 0}).x;
    const cv::Point2d edge = left ? one : other;
    for (const Tick& t : at) {
      line(canvas, {-front_.x, -front_.y, t.value}, {-front_.x, front_.y, t.value}, grid_grey);
      line(canvas, {-front_.x, -front_.y, t.value}, {front_.x, -front_.y, t.value}, grid_grey);
      centred(canvas, t.label, view_({edge.x, edge.y, t.value}) - cv::Point2d(24, 0));
    }
    line(canvas, {edge.x, edge.y, 0}, {edge.x, edge.y, 1}, black);
    centred(canvas, name, view_({edge.x, edge.y, 1}) - cv::Point2d(0, 22));
  }

 private:
  void fill(cv::Mat& canvas, const std::array<cv::Point3d, 4>& corners, const cv::Scalar& colour) const {
    std::array<cv::Point, 4> points;
    std::ranges::transform(corners, points.begin(), [&](const cv::Point3d& p) { return cv::Point(view_(p)); });
    cv::fillConvexPoly(canvas, points.data(), 4, colour, cv::LINE_AA);
  }
  void line(cv::Mat& canvas, const cv::Point3d& from, const cv::Point3d& to, const cv::Scalar& colour) const {
    cv::line(canvas, cv::Point(view_(from)), cv::Point(view_(to)), colour, 1, cv::LINE_AA);
  }
  /// Position in the picture at some distance in dots from an axis, in a direction of the image plane.
  cv::Point2d beyond(const cv::Point3d& from, const cv::Point2d& direction, double dots) const {
    const cv::Point2d start = view_(from), step = view_({from.x + direction.x, from.y + direction.y, from.z}) - start;
    return start + dots / cv::norm(step) * cv::Point2d(1.4 * step.x, step.y) + cv::Point2d(0, 4);
  }

  const View& view_;
  cv::Point2d front_;
};

/// Draws the surface through the pixels' values from back to front, so that near facets cover far ones: one facet for
/// every four valid neighbours.
class Surface {
 public:
  /// @param heights of the pixels, 0 to 1; not finite: invalid
  /// @param levels colour values: 0 to 1 is the scale, beyond it they are clamped
  Surface(const cv::Mat& heights, const cv::Mat& levels, const cv::Point3d& box)
      : heights_(heights), levels_(levels), box_(box) {}

  void draw(cv::Mat& canvas, const View& view, const cv::Point2d& front) const {
    const int rows = heights_.rows - 1, columns = heights_.cols - 1;
    for (int i = 0; i < rows; ++i) {
      const int r = front.y > 0 ? i : rows - 1 - i;
      for (int k = 0; k < columns; ++k) draw_facet(canvas, view, r, front.x > 0 ? k : columns - 1 - k);
    }
  }

  double column(int c) const { return c / (heights_.cols - 1.0) - 0.5; }
  double row(int r) const { return r / (heights_.rows - 1.0) - 0.5; }

 private:
  void draw_facet(cv::Mat& canvas, const View& view, int r, int c) const {
    constexpr int fraction_bits = 4;
    const std::array<cv::Point, 4> around = {cv::Point(c, r), {c + 1, r}, {c + 1, r + 1}, {c, r + 1}};
    std::array<cv::Point, 4> corners;
    double level = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const float height = heights_.at<float>(around[i]);
      if (!std::isfinite(height)) return;
      const cv::Point2d p = view({column(around[i].x), row(around[i].y), height}) * (1 << fraction_bits);
      corners[i] = cv::Point(cvRound(p.x), cvRound(p.y));
      level += std::clamp(levels_.at<float>(around[i]), 0.0F, 1.0F) / 4;
    }
    const auto& colour = level_colours().at<cv::Vec3b>(physics::to_integer(level * 255, 0));
    const cv::Scalar lit = cv::Scalar(colour) * brightness(r, c);
    cv::fillConvexPoly(canvas, corners.data(), 4, lit, cv::LINE_8, fraction_bits);
  }

  /// Shading of a facet: light from the upper left and above, plus ambient light.
  double brightness(int r, int c) const {
    const auto h = [&](int dr, int dc) { return static_cast<double>(heights_.at<float>(r + dr, c + dc)); };
    const double along_columns = (h(0, 1) + h(1, 1) - h(0, 0) - h(1, 0)) / 2 * box_.z / box_.x * (heights_.cols - 1),
                 along_rows = (h(1, 0) + h(1, 1) - h(0, 0) - h(0, 1)) / 2 * box_.z / box_.y * (heights_.rows - 1);
    const cv::Vec3d normal = cv::normalize(cv::Vec3d(-along_columns, -along_rows, 1)),
                    light = cv::normalize(cv::Vec3d(-0.6, 0.3, 1));
    return 0.45 + 0.55 * std::max(0.0, normal.dot(light));
  }

  const cv::Mat &heights_, &levels_;
  cv::Point3d box_;
};

/// Range of all values, at least `shown`.
Range whole_range(const cv::Mat& image, Range shown) {
  for (const float value : cv::Mat_<float>(image)) {
    if (!std::isfinite(value)) continue;
    shown.low = std::min(shown.low, double{value});
    shown.high = std::max(shown.high, double{value});
  }
  return shown;
}

}  // namespace

/// Draws values as heights over the image plane; for lengths, near is up. Colours represent values as in the
/// pictures of image_writer (near is dark), with their scale beside the surface; they are clamped to `minimum` and
/// `maximum`, heights are not. They are shaded by a light from the left. A facet between four neighbours one of
/// which is invalid is omitted. The axes of columns and rows are in pixels, that of the values in m, or mm below 1
/// m.
struct SurfaceWriter final : ChannelPictures {
  Param<double> azimuth{this,
                        "azimuth",
                        {.unit = "rad",
                         .default_value = "-35 deg",
                         .min = -std::numbers::pi,
                         .max = std::numbers::pi,
                         .text = "of the viewer about the viewing axis, from the middle of the last row; positive: "
                                 "to the right"}};
  Param<double> elevation{this,
                          "elevation",
                          {.unit = "rad",
                           .default_value = "40 deg",
                           .min = 0.05,
                           .max = 1.5,
                           .text = "of the viewer above the image plane"}};
  Param<std::int64_t> size{
      this, "size", {.default_value = "720", .min = 300, .max = 8000, .text = "width of the picture in pixels"}};

  void prepare(Setup& setup) {
    prepare_pictures(setup);
    const std::string extension = std::filesystem::path(std::string(*path)).extension().string();
    if (extension != ".png") throw ConfigError("path", fmt::format("ends in '{}', expected .png", extension));
    const tofgraph_channel& image = *setup.find(channel_.c_str());
    if (image.extent[0] == 1 || image.extent[1] == 1)
      throw ConfigError("channel", fmt::format("'{}' has {} x {} pixels, a surface needs at least 2 x 2", channel_,
                                               image.extent[1], image.extent[0]));
  }

  void process(Frame& frame) const {
    const cv::Mat image = values(frame.find(channel_.c_str()));
    if (image.rows < 2 || image.cols < 2)
      throw std::runtime_error(
          fmt::format("'{}' has {} x {} pixels, a surface needs at least 2 x 2", channel_, image.cols, image.rows));
    const std::uint64_t number = frame.metadata().number;
    const Range shown = range(image);
    store(frame, with_description(encoded(".png", picture(image, shown, number)),
                                  fmt::format("{} as a surface from {:.6g} to {:.6g}{}", channel_, shown.low,
                                              shown.high, unit_.empty() ? "" : " " + unit_)));
  }

 private:
  static constexpr double relief = 0.5;  // height of the box relative to its longest side

  cv::Mat picture(const cv::Mat& image, const Range& shown, std::uint64_t number) const {
    const cv::Size dots(static_cast<int>(*size), static_cast<int>(*size * 3 / 4));
    const double max_length = std::max(image.cols, image.rows);
    const cv::Point3d box(image.cols / max_length, image.rows / max_length, relief);
    const bool near_up = unit_ == "m";
    const Range whole = whole_range(image, shown);
    const cv::Mat levels = (image - shown.low) / (shown.high - shown.low);
    cv::Mat heights = (image - whole.low) / (whole.high - whole.low);
    if (near_up) heights = 1 - heights;
    const cv::Point2d front(std::sin(*azimuth) < 0 ? -1 : 1, std::cos(*azimuth) < 0 ? -1 : 1);
    View view(*azimuth, *elevation, box);
    const auto [unit, per_si] = shown_unit(whole);
    const cv::Rect bar(dots.width - bar_width - scale_labels_width(shown, per_si) - 12, 55, bar_width, dots.height / 3);
    constexpr int room_for_scale = 480;  // narrower pictures have only the value axis
    const bool with_scale = dots.width >= room_for_scale;
    view.fit(cv::Rect2d(75, 55, (with_scale ? bar.x : dots.width) - 115, dots.height - 115));
    cv::Mat canvas(dots, CV_8UC3, white);
    draw_axes(canvas, Box(view, front), image, whole, near_up);
    if (with_scale) {
      draw_scale(canvas, bar, shown, per_si);
      text(canvas, unit, {bar.x, bar.y - 12});
    }
    text(canvas, title_of(unit, number), {16, 24});
    cv::Mat large;
    cv::resize(canvas, large, {}, supersampling, supersampling, cv::INTER_NEAREST);
    Surface(heights, levels, box).draw(large, view.enlarged(supersampling), front);
    cv::resize(large, canvas, dots, 0, 0, cv::INTER_AREA);
    return canvas;
  }

  void draw_axes(cv::Mat& canvas, const Box& box, const cv::Mat& image, const Range& whole, bool near_up) const {
    const auto [unit, per_si] = shown_unit(whole);
    const auto scaled = [](std::vector<Tick> all, double low, double high, double first, double last) {
      for (Tick& t : all) t.value = first + (t.value - low) / (high - low) * (last - first);
      return all;
    };
    const auto pixels = [&](int count) { return scaled(ticks(0, count - 1), 0, count - 1, -0.5, 0.5); };
    const double low = whole.low * per_si, high = whole.high * per_si;
    box.draw_walls(canvas);
    box.column_axis(canvas, pixels(image.cols), "column / px");
    box.row_axis(canvas, pixels(image.rows), "row / px");
    box.value_axis(canvas, scaled(ticks(low, high), low, high, near_up ? 1 : 0, near_up ? 0 : 1), unit);
  }
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::SurfaceWriter, "A channel as a surface in space, as pictures")
