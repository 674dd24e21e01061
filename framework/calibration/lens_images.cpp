// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Mean images and distances of the board from captures.
#include "calibration/frame_mean.hpp"
#include "calibration/lens_views.hpp"
#include "calibration/pixel_outliers.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/constants.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>

namespace tofgraph::calibration {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Mean and scatter of one quantity over frames, per pixel.
class Accumulator {
 public:
  explicit Accumulator(std::size_t pixels) : count_(pixels), sum_(pixels), square_(pixels) {}

  std::size_t pixels() const { return count_.size(); }
  void add(std::size_t pixel, double value) {
    count_[pixel] += 1;
    sum_[pixel] += value;
    square_[pixel] += value * value;
  }
  /// Mean of each pixel; NaN unless every frame had a value.
  std::vector<double> mean(std::size_t frames) const {
    std::vector<double> result(sum_.size(), nan);
    for (std::size_t i = 0; i < result.size(); ++i)
      if (count_[i] == frames) result[i] = sum_[i] / static_cast<double>(frames);
    return result;
  }
  /// Standard deviation of the mean, root mean square over the pixels. NaN: one frame.
  double noise(std::size_t frames) const {
    if (frames < 2) return nan;
    const auto n = static_cast<double>(frames);
    double variance = 0, pixels = 0;
    for (std::size_t i = 0; i < sum_.size(); ++i) {
      if (count_[i] != frames) continue;
      variance += std::max(square_[i] - sum_[i] * sum_[i] / n, 0.0) / (n - 1);
      pixels += 1;
    }
    return std::sqrt(variance / std::max(pixels, 1.0) / n);
  }

 private:
  std::vector<std::size_t> count_;
  std::vector<double> sum_, square_;
};

bool has_channel(const io::Recording& recording, const char* name) {
  return std::ranges::any_of(recording.reader().channels(),
                             [name](const io::CaptureChannel& c) { return c.name == name; });
}

/// Adds the brightness of one frame (amplitude, or the camera's intensity if there is none) and its distances.
void add_frame(const io::Recording& recording, std::size_t frame, const io::Condition& condition,
               const io::Camera& camera, Accumulator& brightness, Accumulator& distance) {
  using Kind = io::Recording::Kind;
  const Kind kind = recording.kind();
  const bool by_intensity = kind == Kind::distances || (kind == Kind::images && !has_channel(recording, "amplitude"));
  if (by_intensity && !has_channel(recording, "intensity"))
    throw std::runtime_error("has neither amplitude nor intensity: there is no image to find the pattern in");
  const std::vector<float> image = by_intensity           ? recording.floats("intensity", frame)
                                   : kind == Kind::images ? recording.floats("amplitude", frame)
                                                          : std::vector<float>{};
  if (kind == Kind::images) {
    for (std::size_t i = 0; i < image.size(); ++i)
      if (std::isfinite(image[i]) && !camera.is_bad(i)) brightness.add(i, image[i]);
    return;
  }
  io::Condition one = condition;
  one.frames = std::array<std::uint64_t, 2>{frame, frame};
  std::vector<std::size_t> all(brightness.pixels());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const MeanImages means = mean_of(recording, one, all, camera);
  for (std::size_t i = 0; i < means.pixels.size(); ++i) {
    const std::size_t pixel = means.pixels[i];
    brightness.add(pixel, by_intensity ? double{image[pixel]} : means.amplitude[i]);
    distance.add(pixel, means.distance[i]);
  }
}

/// Returns true if a pixel and its neighbours are similar and bright, i.e. away from edges and markers.
bool even_and_bright(const Image& image, long u, long v, double level) {
  if (u < 1 || v < 1 || u + 1 >= static_cast<long>(image.width) || v + 1 >= static_cast<long>(image.height))
    return false;
  double low = image.at(u, v), high = low;
  for (long y = v - 1; y <= v + 1; ++y) {
    for (long x = u - 1; x <= u + 1; ++x) {
      if (!std::isfinite(image.at(x, y))) return false;
      low = std::min(low, image.at(x, y));
      high = std::max(high, image.at(x, y));
    }
  }
  return low > level && low > 0.75 * high;
}

/// Pixels that see the board, including its edge, row-major.
std::vector<std::size_t> board_pixels(const Image& image, const LensViews& views, const LensParameters& lens,
                                      const Pose& pose) {
  double hx = 0, hy = 0;
  for (const BoardPoint& p : views.observations.points) {
    hx = std::max(hx, std::abs(p.x));
    hy = std::max(hy, std::abs(p.y));
  }
  const double edge = 0.8 * views.pattern.square;  // the outer squares belong to the board
  const auto& r = pose.rotation;
  const auto& t = pose.translation;
  const double offset = r[2] * t[0] + r[5] * t[1] + r[8] * t[2];
  std::vector<std::size_t> pixels;
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    const std::size_t column = i % image.width, row = i / image.width;
    double xy[2];
    if (!unproject(lens, static_cast<double>(column), static_cast<double>(row), xy)) continue;
    const double along = offset / (r[2] * xy[0] + r[5] * xy[1] + r[8]);
    const double dx = along * xy[0] - t[0], dy = along * xy[1] - t[1], dz = along - t[2];
    const double a = r[0] * dx + r[3] * dy + r[6] * dz, b = r[1] * dx + r[4] * dy + r[7] * dz;
    if (along > 0 && std::abs(a) < hx + edge && std::abs(b) < hy + edge) pixels.push_back(i);
  }
  return pixels;
}

}  // namespace

ViewImages images_of(const io::Condition& condition, const io::Camera& camera, CameraSeen& seen) {
  const io::Recording recording(condition.capture);
  seen = {recording.reader().header().camera, recording.reader().header().serial};
  const auto [first, last] = frames_of(recording, condition, camera.view());
  const tofgraph_camera& view = camera.view();
  Accumulator brightness(std::size_t{view.width} * view.height), distance(brightness.pixels());
  for (std::size_t f = first; f <= last; ++f) add_frame(recording, f, condition, camera, brightness, distance);
  ViewImages result{.frames = last - first + 1};
  result.image = {view.width, view.height, brightness.mean(result.frames), brightness.noise(result.frames)};
  if (recording.kind() != io::Recording::Kind::images) {
    result.distance = distance.mean(result.frames);
    result.distance_noise = distance.noise(result.frames);
  }
  result.isolated = mark_isolated(result.image.values, view.width, result.image.noise);
  for (std::size_t i = 0; condition.roi && i < result.image.values.size(); ++i) {
    const std::size_t u = i % view.width, v = i / view.width;
    if (u < condition.roi->first_column || u > condition.roi->last_column || v < condition.roi->first_row ||
        v > condition.roi->last_row)
      result.image.values[i] = nan;
  }
  return result;
}

std::vector<BoardDistance> board_distances(const ViewImages& images, const LensViews& views, const LensParameters& lens,
                                           const Pose& pose) {
  constexpr double wanted = 120;    // blocks per view: more do not change the result
  constexpr double assumed = 5e-3;  // m, noise of a pixel if there is only one frame; its factor is estimated
  constexpr double near = 0.25;     // m, from the median: others are wrapped or see something else
  std::vector<BoardDistance> result;
  if (images.distance.empty()) return result;
  const Image& image = images.image;
  std::vector<std::size_t> pixels = board_pixels(image, views, lens, pose);
  if (pixels.size() < 9) return result;
  std::vector<double> values, distances;
  for (const std::size_t i : pixels) {
    if (std::isfinite(image.values[i])) values.push_back(image.values[i]);
    if (std::isfinite(images.distance[i])) distances.push_back(images.distance[i]);
  }
  if (values.empty() || distances.empty()) return result;
  std::ranges::sort(values);
  std::ranges::sort(distances);
  const double level = (values[values.size() / 10] + values[values.size() - 1 - values.size() / 10]) / 2;
  const double middle = distances[distances.size() / 2];
  std::erase_if(pixels, [&](std::size_t i) {
    const auto u = static_cast<long>(i % image.width), v = static_cast<long>(i / image.width);
    return !even_and_bright(image, u, v, level) || !(std::abs(images.distance[i] - middle) < near);
  });
  const auto block =
      static_cast<std::size_t>(std::max(1.0, std::ceil(std::sqrt(static_cast<double>(pixels.size()) / wanted))));
  struct Sum {
    double u = 0, v = 0, distance = 0, count = 0;
  };
  std::map<std::size_t, Sum> blocks;
  for (const std::size_t i : pixels) {
    const std::size_t u = i % image.width, v = i / image.width;
    Sum& sum = blocks[v / block * image.width + u / block];
    sum.u += static_cast<double>(u);
    sum.v += static_cast<double>(v);
    sum.distance += images.distance[i];
    sum.count += 1;
  }
  const double noise =
      std::isfinite(images.distance_noise) && images.distance_noise > 0 ? images.distance_noise : assumed;
  for (const auto& [key, s] : blocks)
    result.push_back({s.u / s.count, s.v / s.count, s.distance / s.count, noise / std::sqrt(s.count)});
  return result;
}

}  // namespace tofgraph::calibration
