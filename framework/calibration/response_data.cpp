// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/board_measurement.hpp"
#include "calibration/camera_identity.hpp"
#include "calibration/frame_mean.hpp"
#include "calibration/response.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tofgraph/physics/four_phase.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

namespace tofgraph::calibration {
namespace {

constexpr float not_known = std::numeric_limits<float>::quiet_NaN();

bool has_channel(const io::Recording& recording, const char* name) {
  return std::ranges::any_of(recording.reader().channels(),
                             [name](const io::CaptureChannel& c) { return c.name == name; });
}

/// Sums over the frames of one condition, per pixel.
class ResponseSums {
 public:
  explicit ResponseSums(const io::Camera& camera)
      : pixels_(std::size_t{camera.view().width} * camera.view().height),
        limit_(camera.view().full_well > 0 ? std::min(camera.view().full_well, 65535.0) : 65535.0),
        samples_(pixels_),
        amplitude_(pixels_),
        intensity_(pixels_) {
    for (std::size_t i = 0; i < pixels_; ++i) good_.push_back(camera.is_bad(i) ? 0 : 1);
  }

  void add(const io::Recording& recording, std::size_t frame) {
    using Kind = io::Recording::Kind;
    if (recording.kind() == Kind::taps) return add_taps(recording.taps(frame));
    const std::vector<float> light = recording.floats("intensity", frame);
    for (std::size_t i = 0; i < pixels_; ++i) add_light(i, light[i]);
    if (recording.kind() == Kind::phases) {
      const std::vector<float> phases = recording.floats("phases", frame);
      for (std::size_t i = 0; i < 4 * pixels_; ++i) add_sample(i / pixels_, i % pixels_, phases[i]);
    } else {
      const std::vector<float> amplitude = recording.floats("amplitude", frame);
      for (std::size_t i = 0; i < pixels_; ++i) {
        good_[i] = good_[i] != 0 && std::isfinite(amplitude[i]) ? 1 : 0;
        amplitude_[i] += amplitude[i];
      }
    }
  }

  /// @param decoded true: amplitudes were added; false: samples @returns number of saturated values
  std::size_t write_means(std::size_t frames, bool decoded, ResponseCondition& result) const {
    const auto n = static_cast<double>(frames);
    for (std::size_t i = 0; i < pixels_; ++i) {
      std::array<double, 4> c = samples_[i];
      for (double& sum : c) sum /= n;
      const double amplitude = decoded ? amplitude_[i] / n : physics::decode(c).amplitude;
      result.amplitude.push_back(good_[i] != 0 ? static_cast<float>(amplitude) : not_known);
      result.intensity.push_back(good_[i] != 0 ? static_cast<float>(intensity_[i] / n) : not_known);
    }
    return saturated_;
  }

 private:
  void add_taps(const std::vector<std::uint16_t>& taps) {
    for (std::size_t plane = 0; plane < 8; ++plane) {
      for (std::size_t i = 0; i < pixels_; ++i) {
        const double value = taps[plane * pixels_ + i];
        if (value >= limit_) {
          saturated_ += good_[i];
          good_[i] = 0;
        }
        intensity_[i] += value / 8;
        add_sample(plane / 2, i, plane % 2 == 0 ? value : -value);
      }
    }
  }
  void add_sample(std::size_t exposure, std::size_t i, double value) {
    if (!std::isfinite(value)) good_[i] = 0;
    samples_[i][exposure] += value;
  }
  void add_light(std::size_t i, double value) {
    if (!std::isfinite(value)) good_[i] = 0;
    if (value >= limit_) {  // mean of the taps: the brighter tap saturates earlier
      saturated_ += good_[i];
      good_[i] = 0;
    }
    intensity_[i] += value;
  }

  std::size_t pixels_;
  double limit_;
  std::vector<std::array<double, 4>> samples_;
  std::vector<double> amplitude_, intensity_;
  std::vector<std::uint8_t> good_;
  std::size_t saturated_ = 0;
};

struct ResponseRead {
  std::optional<ResponseCondition> condition;
  CameraSeen seen;
  std::size_t saturated = 0;
  std::string mistake, left_out;
};

std::string other_use(const io::Condition& c) {
  if (c.ambient != "dark") return "there is ambient light, which adds to the taps but not to the amplitude";
  if (std::isfinite(c.velocity) && c.velocity != 0) return "the board moves";
  return "";
}

/// Relative light, reflectivity t_int / D_t^2, of each pixel that sees the board.
std::vector<float> light_of(const io::Condition& c, const tofgraph_camera& camera, const BoardModel& model) {
  if (!c.has_board() || !c.scene.empty() || c.is_capped() || !c.sources.empty() || !std::isfinite(c.reflectivity))
    return {};
  std::vector<float> light(std::size_t{camera.width} * camera.height, not_known);
  const std::vector<std::size_t> window = model.window(c);
  const std::vector<double> path = model.modelled(c, window);  // half of D_t
  for (std::size_t k = 0; k < window.size(); ++k)
    light[window[k]] = static_cast<float>(c.reflectivity * c.integration_time / (4 * path[k] * path[k]));
  return light;
}

ResponseRead read_response_condition(std::size_t index, const io::Condition& written, const io::Camera& profile,
                                     const BoardModel& model) {
  const tofgraph_camera& camera = profile.view();
  ResponseRead result;
  io::Condition condition = written;
  result.left_out = other_use(condition);
  if (!result.left_out.empty()) return result;
  try {
    const io::Recording recording(condition.capture);
    result.seen = {recording.reader().header().camera, recording.reader().header().serial};
    using Kind = io::Recording::Kind;
    const bool samples = recording.kind() == Kind::taps || recording.kind() == Kind::phases;
    if (recording.kind() != Kind::taps &&
        (!has_channel(recording, "intensity") || (!samples && !has_channel(recording, "amplitude"))))
      throw std::runtime_error(
          "has neither taps nor intensity in addition to phases or amplitude: the light to which the contrast refers "
          "is unknown");
    complete(condition, recording.reader(), camera);
    const auto [first, last] = frames_of(recording, condition, camera);
    ResponseSums sums(profile);
    for (std::size_t f = first; f <= last; ++f) sums.add(recording, f);
    ResponseCondition read{.index = index, .integration_time = condition.integration_time};
    result.saturated = sums.write_means(last - first + 1, !samples, read);
    read.light = light_of(condition, camera, model);
    result.condition = std::move(read);
  } catch (const std::runtime_error& error) {
    result.mistake = capture_problem(condition, error);
  }
  return result;
}

/// Sets the levels: distances if there are three or more, else integration times, else single conditions.
void set_levels(const io::Campaign& campaign, ResponseData& data) {
  std::set<double> distances, times;
  for (const ResponseCondition& c : data.conditions) {
    const io::Condition& written = campaign.conditions[c.index];
    if (written.has_board()) distances.insert(std::round(written.board_distance * 1e3));
    times.insert(c.integration_time);
  }
  data.axis = distances.size() > 2 ? "distance" : times.size() > 2 ? "integration time" : "condition";
  for (ResponseCondition& c : data.conditions) {
    const double distance = campaign.conditions[c.index].board_distance;
    c.level = data.axis == "distance"    ? (std::isfinite(distance) ? std::round(distance * 1e3) : -1)
              : data.axis == "condition" ? static_cast<double>(c.index)
                                         : c.integration_time;
  }
}

}  // namespace

ResponseData read_response(const io::Campaign& campaign, const std::function<void(double share)>& progress) {
  const tofgraph_camera& camera = campaign.camera->view();
  const BoardModel model(camera, io::OffsetVariant::geometric);
  ResponseData data{.rows = camera.height, .columns = camera.width};
  for (std::size_t i = 0; i < data.rows * data.columns; ++i) data.angle.push_back(model.angle(i));
  const std::size_t n = campaign.conditions.size();
  std::vector<ResponseRead> read(n);
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
    read[i] = read_response_condition(i, campaign.conditions[i], *campaign.camera, model);
    if (progress) progress(static_cast<double>(++done) / static_cast<double>(n));
  });
  config::Diagnostics diagnostics;
  std::vector<CameraSeen> seen;
  for (const ResponseRead& r : read) seen.push_back(r.seen);
  data.serial = check_one_camera(campaign, seen, data.notes, diagnostics);
  for (std::size_t i = 0; i < n; ++i) {
    const io::Condition& c = campaign.conditions[i];
    if (!read[i].mistake.empty()) diagnostics.error(place_of(c), read[i].mistake);
    if (!read[i].left_out.empty()) data.notes.push_back(fmt::format("{}: excluded: {}", c.id, read[i].left_out));
    data.saturated += read[i].saturated;
    if (read[i].condition) data.conditions.push_back(std::move(*read[i].condition));
  }
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  set_levels(campaign, data);
  return data;
}

}  // namespace tofgraph::calibration
