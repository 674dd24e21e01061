// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "recording/look.hpp"

#include "config/quantity.hpp"
#include "graph/frame.hpp"

#include <fmt/format.h>
#include <tofgraph/array.hpp>
#include <tofgraph/channels.hpp>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <vector>

namespace tofgraph::recording {
namespace {

constexpr std::uint64_t frames_of_a_look = 5;
constexpr std::size_t half_window = 10;   // px
constexpr std::size_t corner = 11;        // px
constexpr double min_change_seen = 0.03;  // m, variation of the distance offset between two boards
constexpr double noise_of_look = 0.01;    // m, of the difference of two measurements
constexpr double share_of_change = 0.5;   // fraction of a planned change that must be observed

/// Collects the central values of frames; called from the threads of a run.
class Middle {
 public:
  void add(const tofgraph_frame& frame) {
    const std::scoped_lock lock(mutex_);
    collect(frame, "depth", depth_);
    collect_corners(frame);
    collect(frame, "amplitude", amplitude_);
    const tofgraph_frame::Channel* channel = frame.find("flags");
    if (channel == nullptr) return;
    for (const std::uint16_t flags : Array<const std::uint16_t>(graph::view_of(*channel)).span()) {
      ++pixels_;
      if ((flags & flag::saturated) != 0) ++saturated_;
    }
  }
  Seen seen() {
    const double share = pixels_ == 0 ? 0 : static_cast<double>(saturated_) / static_cast<double>(pixels_);
    Seen seen{physics::median(depth_), physics::median(amplitude_), share};
    for (std::size_t k = 0; k < corners_.size(); ++k) seen.corners[k] = physics::median(corners_[k]);
    return seen;
  }

 private:
  void collect_corners(const tofgraph_frame& frame) {
    const tofgraph_frame::Channel* channel = frame.find("depth");
    if (channel == nullptr) return;
    const Array<const float> image(graph::view_of(*channel));
    const std::size_t rows = std::min(corner, image.rows()), columns = std::min(corner, image.columns());
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      const std::size_t top = k < 2 ? 0 : image.rows() - rows, left = k % 2 == 0 ? 0 : image.columns() - columns;
      for (std::size_t i = 0; i < rows * columns; ++i) {
        const float value = image(top + i / columns, left + i % columns);
        if (std::isfinite(value)) corners_[k].push_back(value);
      }
    }
  }

  static void collect(const tofgraph_frame& frame, const char* name, std::vector<float>& values) {
    const tofgraph_frame::Channel* channel = frame.find(name);
    if (channel == nullptr) return;
    const Array<const float> image(graph::view_of(*channel));
    const auto window = [](std::size_t size) {
      const std::size_t half = std::min(half_window, (size - 1) / 2);
      return std::pair{size / 2 - half, size / 2 + half};
    };
    const auto [top, bottom] = window(image.rows());
    const auto [left, right] = window(image.columns());
    for (std::size_t row = top; row <= bottom && row < image.rows(); ++row) {
      for (std::size_t column = left; column <= right && column < image.columns(); ++column)
        if (const float value = image(row, column); std::isfinite(value)) values.push_back(value);
    }
  }

  std::mutex mutex_;
  std::vector<float> depth_, amplitude_;
  std::array<std::vector<float>, 4> corners_;
  std::size_t pixels_ = 0, saturated_ = 0;
};

std::string difference_text(double difference) {
  return fmt::format("{} too {}", config::format_quantity(std::round(std::abs(difference) * 1e3) * 1e-3, "m"),
                     difference > 0 ? "far" : "near");
}

}  // namespace

std::string Seen::text() const {
  const std::string where =
      std::isnan(distance) ? "no distance in the middle" : fmt::format("distance {:.0f} mm", distance * 1e3);
  std::string text = fmt::format("{}, amplitude {:.0f} counts, {:.1f} % saturated", where,
                                 std::isnan(amplitude) ? 0 : amplitude, saturated * 100);
  if (std::isfinite(misalignment()))
    text += fmt::format("; corners: top {:.0f} and {:.0f} mm, bottom {:.0f} and {:.0f} mm", corners[0] * 1e3,
                        corners[1] * 1e3, corners[2] * 1e3, corners[3] * 1e3);
  return text;
}

double Seen::misalignment() const {
  if (std::ranges::any_of(corners, [](double c) { return std::isnan(c); })) return io::unknown;
  const auto [least, most] = std::ranges::minmax(corners);
  return most - least;
}

std::string misaligned(const Seen& seen, double tolerance) {
  const double difference = seen.misalignment();
  if (std::isnan(difference)) return "no distance can be seen in a corner of the image";
  if (difference <= tolerance) return {};
  const double right = (seen.corners[1] + seen.corners[3] - seen.corners[0] - seen.corners[2]) / 2;
  const double bottom = (seen.corners[2] + seen.corners[3] - seen.corners[0] - seen.corners[1]) / 2;
  return fmt::format(
      "the board is not perpendicular: its corners differ by {:.1f} mm; its right side is {:.1f} mm {}, "
      "its bottom {:.1f} mm {}",
      difference * 1e3, std::abs(right) * 1e3, right > 0 ? "farther" : "nearer", std::abs(bottom) * 1e3,
      bottom > 0 ? "farther" : "nearer");
}

Seen look(const CameraRequest& camera, const graph::GraphOptions& options, const Run& run) {
  const auto graph = looking_graph(camera, options);
  Middle middle;
  graph::RunOptions run_options;
  run_options.frames = frames_of_a_look;
  run_options.receivers[depth_node_name] = [&](tofgraph_frame& frame) { middle.add(frame); };
  graph::Runner runner(*graph, run_options);
  const graph::RunResult result = run(runner);
  if (!result.error.empty()) throw std::runtime_error(result.error);
  return middle.seen();
}

bool change_shows(double a, double b) { return std::abs(a - b) >= min_change_seen + noise_of_look; }

std::string contradiction(const Seen& seen, double planned, const std::optional<Reference>& before, double tolerance,
                          double unambiguous_range) {
  if (std::isnan(planned)) return {};
  if (std::isnan(seen.distance)) return "no distance can be seen in the middle of the image";
  const auto wrapped = [&](double difference) {
    return std::isnan(unambiguous_range) ? difference : std::remainder(difference, unambiguous_range);
  };
  const double difference = wrapped(seen.distance - planned);
  if (std::abs(difference) > tolerance)
    return fmt::format("the board is seen at {:.0f} mm, planned are {:.0f} mm: {}", seen.distance * 1e3, planned * 1e3,
                       difference_text(difference));
  if (!before || before->planned == planned) return {};
  const double change = planned - before->planned;
  const double unseen = wrapped(seen.distance - before->seen - change);
  if (std::abs(unseen) <= std::max(min_change_seen, share_of_change * std::abs(change))) return {};
  return fmt::format("the board has moved by {:.0f} mm, planned were {:.0f} mm: {}",
                     (seen.distance - before->seen) * 1e3, change * 1e3, difference_text(unseen));
}

}  // namespace tofgraph::recording
