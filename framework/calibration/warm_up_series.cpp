// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/camera_identity.hpp"
#include "calibration/warm_up.hpp"
#include "config/diagnostics.hpp"
#include "io/captures/condition_statistics.hpp"
#include "io/captures/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <tuple>

namespace tofgraph::calibration {
namespace {

constexpr std::uint64_t max_points = 400;  ///< limit per recording: more add no information on a drift over minutes

/// Time since power-on of a frame: that of the condition for its first frame plus the elapsed time, or the frame's own
/// value.
double time_of(const io::Condition& c, const io::CaptureReader& capture, std::uint64_t first, std::uint64_t frame) {
  const tofgraph_metadata m = capture.metadata(frame), begin = capture.metadata(first);
  if (std::isnan(c.time_since_power_on)) return m.time_since_power_on;
  const double passed = m.time_since_power_on - begin.time_since_power_on;
  return c.time_since_power_on +
         (std::isfinite(passed) ? passed : static_cast<double>(m.timestamp_ns - begin.timestamp_ns) * 1e-9);
}

/// Splits a recording into points in time.
class Splitter {
 public:
  explicit Splitter(std::vector<io::Condition>& points) : points_(points) {}

  void split(const io::Condition& condition, config::Diagnostics& diagnostics) {
    try {
      split_capture(condition, diagnostics);
    } catch (const std::runtime_error& error) {
      diagnostics.error(place_of(condition), capture_problem(condition, error));
    }
  }

 private:
  void split_capture(const io::Condition& condition, config::Diagnostics& diagnostics) {
    const io::CaptureReader capture(condition.capture);
    const auto [first, last] = io::used_frames(condition, capture.frames());
    const std::uint64_t count = last - first + 1, at_once = (count + max_points - 1) / max_points;
    if (!std::isfinite(time_of(condition, capture, first, first))) {
      diagnostics.error(place_of(condition),
                        "the time since power-on is unknown: neither the condition nor its capture states it",
                        "example: time_since_power_on: 60 s");
      return;
    }
    // Frames within a short time are one point.
    constexpr double moment = 2;  // s
    const double span = time_of(condition, capture, first, last) - time_of(condition, capture, first, first);
    const std::uint64_t step = span <= moment ? count : at_once;
    for (std::uint64_t begin = first; begin <= last; begin += step) {
      io::Condition point = condition;
      const std::uint64_t end = std::min(begin + step - 1, last);
      point.frames = std::array<std::uint64_t, 2>{begin, end};
      point.time_since_power_on =
          (time_of(condition, capture, first, begin) + time_of(condition, capture, first, end)) / 2;
      points_.push_back(point);
    }
  }

  std::vector<io::Condition>& points_;
};

/// Mean over a window of the image, or over the four centre pixels, of the pixels used. NaN: there are none.
double window_mean(const tofgraph_camera& camera, const std::optional<io::Roi>& window, const MeanImages& images) {
  const std::uint32_t u = camera.width / 2, v = camera.height / 2;
  const io::Roi roi = window.value_or(io::Roi{u - 1, u, v - 1, v});
  std::vector<double> inside;
  for (std::size_t i = 0; i < images.pixels.size(); ++i) {
    const auto column = images.pixels[i] % camera.width, row = images.pixels[i] / camera.width;
    if (column >= roi.first_column && column <= roi.last_column && row >= roi.first_row && row <= roi.last_row)
      inside.push_back(images.distance[i]);
  }
  return moments_of(inside).mean;
}

bool of_no_use(const io::Condition& c) { return !c.has_board() || c.capture.empty(); }

void check_times(const Series& series, const Request& request) {
  constexpr std::size_t few = 6;
  if (series.points.size() >= few) return;
  throw config::ConfigurationError(fmt::format(
      "{}: error: {} points in time of the board at {:.4g} m and {:.3g} ms: a time constant needs {} or more\n  record "
      "the same board repeatedly from power-on, for an hour",
      request.campaign.string(), series.points.size(), series.distance, series.integration_time * 1e3, few));
}

}  // namespace

Moments Series::window_moments() const {
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < window_means.size(); ++i) {
    if (std::isfinite(window_means[i])) known.push_back(i);
  }
  if (known.size() < 2) return moments_of(known.empty() ? std::vector<double>() : std::vector{window_means[known[0]]});
  std::vector<double> weights;  // s, trapezoidal rule: half the distance between both neighbours
  for (std::size_t k = 0; k < known.size(); ++k)
    weights.push_back((time(known[std::min(k + 1, known.size() - 1)]) - time(known[k == 0 ? 0 : k - 1])) / 2);
  const double total = time(known.back()) - time(known.front());
  if (!(total > 0)) weights.assign(known.size(), 1);
  const double sum = total > 0 ? total : static_cast<double>(known.size());
  Moments m{0, 0};
  for (std::size_t k = 0; k < known.size(); ++k) m.mean += weights[k] / sum * window_means[known[k]];
  for (std::size_t k = 0; k < known.size(); ++k)
    m.sd += weights[k] / sum * (window_means[known[k]] - m.mean) * (window_means[known[k]] - m.mean);
  m.sd = std::sqrt(m.sd);
  return m;
}

void set_frame_errors(double corrected_at, Series& series) {
  const auto& points = series.points;
  const auto nearest = std::ranges::min_element(
      points, {}, [&](const Board* b) { return std::abs(b->condition.time_since_power_on - corrected_at); });
  const double correction = (*nearest)->offset.mean;
  series.corrected_at = (*nearest)->condition.time_since_power_on;
  series.errors.clear();
  for (const Board* b : points) {
    // The board's own correction leaves a mean and a spread over the pixels; the fixed one differs by a constant.
    const double own = b->offset_corrected.mean - b->modelled.mean;
    FrameError e{.bias = own + correction - b->offset.mean,
                 .pattern = std::sqrt(std::max(b->rmse * b->rmse - own * own, 0.0))};
    if (std::isfinite(b->noise)) {
      e.noise = b->noise;
      // The spread over the pixels includes the noise that remains after averaging.
      e.pattern =
          std::sqrt(std::max(e.pattern * e.pattern - b->noise * b->noise / static_cast<double>(b->frames), 0.0));
    }
    e.rmse = std::hypot(e.bias, std::isfinite(e.noise) ? e.noise : 0.0, e.pattern);
    series.errors.push_back(e);
  }
}

WarmUpData read_warm_up(const Request& request) {
  io::Campaign written = read_conditions(request);
  if (written.from_table)
    throw config::ConfigurationError(fmt::format(
        "{}: error: a table has no times since power-on\n  give conditions with captures", request.campaign.string()));
  refuse_duplicates(written);
  config::Diagnostics diagnostics;
  WarmUpData data{.campaign = {.conditions = written, .boards = {}}, .series = {}};
  std::vector<io::Condition>& points = data.campaign.conditions.conditions;
  points.clear();
  Splitter splitter(points);
  for (const io::Condition& c : written.conditions) {
    if (!of_no_use(c)) splitter.split(c, diagnostics);
  }
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  if (points.empty())
    throw config::ConfigurationError(
        fmt::format("{}: error: no condition shows a board at a known distance\n  record a board that stands still",
                    request.campaign.string()));
  const auto progress = [&](double share) {
    if (request.progress) request.progress(0.9 * share, "reading the campaign");
  };
  std::vector<std::optional<double>> window_means(points.size());
  const auto visit = [&](std::size_t condition, const Board&, const MeanImages& images) {
    const std::optional<io::Roi>& own = points[condition].roi;
    window_means[condition] =
        window_mean(data.campaign.conditions.camera->view(), request.roi ? request.roi : own, images);
  };
  try {
    data.campaign.boards = read_boards(data.campaign.conditions, request.variant,
                                       {.progress = progress, .repeats = Repeats::kept, .visit = visit});
  } catch (const std::invalid_argument& problem) {
    throw config::ConfigurationError(fmt::format("{}: error: {}", request.campaign.string(), problem.what()));
  }
  // The boards are those visited, in the order of the conditions.
  auto mean = window_means.begin();
  std::map<std::tuple<std::size_t, double, double>, std::vector<std::pair<const Board*, double>>> series;
  for (const Board& b : data.campaign.boards.boards) {
    mean = std::find_if(mean, window_means.end(), [](const auto& m) { return m.has_value(); });
    series[{data.campaign.boards.target_of(b), b.distance, b.condition.integration_time}].emplace_back(&b, **mean);
    ++mean;
  }
  for (auto& [key, measured] : series) {
    std::ranges::stable_sort(measured, {}, [](const auto& m) { return m.first->condition.time_since_power_on; });
    Series s{.target = std::get<0>(key), .distance = std::get<1>(key), .integration_time = std::get<2>(key)};
    for (const auto& [board, window] : measured) {
      s.points.push_back(board);
      s.window_means.push_back(window);
    }
    check_times(s, request);
    set_frame_errors(request.corrected_at.value_or(usual_settling_time), s);
    data.series.push_back(std::move(s));
  }
  if (data.series.empty())
    throw config::ConfigurationError(fmt::format("{}: error: no usable condition\n  {}", request.campaign.string(),
                                                 sentence_of(data.campaign.boards.notes)));
  return data;
}

}  // namespace tofgraph::calibration
