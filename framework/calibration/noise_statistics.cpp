// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/camera_identity.hpp"
#include "calibration/frame_mean.hpp"
#include "calibration/noise.hpp"
#include "config/quantity.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tofgraph/physics/constants.hpp>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

namespace tofgraph::calibration {
namespace {

using Kind = io::Recording::Kind;

/// Sums over the frames of one condition, per pixel.
class Sums {
 public:
  /// @param roi pixels outside it are ignored
  Sums(const tofgraph_camera& camera, const std::optional<io::Roi>& roi)
      : pixels_(std::size_t{camera.width} * camera.height),
        range_(physics::unambiguous_range(camera.modulation_frequency)),
        scale_(physics::metres_per_radian(camera.modulation_frequency)),
        limit_(camera.full_well > 0 ? std::min(camera.full_well, 65535.0) : 65535.0),
        use_(pixels_, PixelUse::good),
        frozen_(pixels_, ~std::uint64_t{0}),
        level_(pixels_),
        differences_(pixels_),
        squares_(pixels_),
        amplitude_(pixels_),
        distance_(pixels_),
        last_distance_(pixels_) {
    for (std::size_t i = 0; i < pixels_ && roi; ++i) {
      const std::size_t u = i % camera.width, v = i / camera.width;
      const bool inside = u >= roi->first_column && u <= roi->last_column && v >= roi->first_row && v <= roi->last_row;
      if (!inside) use_[i] = PixelUse::outside;
    }
  }

  /// @param values `planes` images of samples @param taps true: samples are taps, false: differences of taps
  template <class T> void add_samples(const std::vector<T>& values, bool taps) {
    const std::size_t planes = values.size() / pixels_;
    if (last_.empty()) {
      last_.resize(values.size());
      sum_.resize(values.size());
    }
    std::vector<double> c(4 * pixels_);
    for (std::size_t plane = 0; plane < planes; ++plane) {
      for (std::size_t i = 0; i < pixels_; ++i) {
        const std::size_t at = plane * pixels_ + i;
        const double value = values[at];
        judge(i, value, taps);
        if (frames_ > 0 && value != last_[at]) frozen_[i] &= ~(std::uint64_t{1} << plane % 64);
        if (frames_ > 0) differences_[i] += (value - last_[at]) * (value - last_[at]);
        // Relative to the first frame's value, to avoid cancellation of the squares of large counts.
        if (frames_ == 0) sum_[at] = 0;
        const double change = frames_ == 0 ? 0 : value - first_[at];
        squares_[i] += change * change;
        sum_[at] += change;
        level_[i] += value / static_cast<double>(planes);
        last_[at] = value;
        if (taps)
          c[(plane / 2) * pixels_ + i] += plane % 2 == 0 ? value : -value;
        else
          c[at] = value;
      }
    }
    if (frames_ == 0) first_ = last_;
    for (std::size_t i = 0; i < pixels_; ++i) {
      const physics::Decoded d = physics::decode({c[i], c[pixels_ + i], c[2 * pixels_ + i], c[3 * pixels_ + i]});
      add_distance(i, scale_ * d.phase, d.amplitude);
    }
    ++frames_;
  }

  void add_decoded(const std::vector<float>& distance, const std::vector<float>& amplitude) {
    for (std::size_t i = 0; i < pixels_; ++i) {
      if (!std::isfinite(distance[i]) || !std::isfinite(amplitude[i]) || !(amplitude[i] > 0)) set(i, PixelUse::invalid);
      if (frames_ > 0 && distance[i] != last_distance_[i]) frozen_[i] = 0;
      add_distance(i, distance[i], amplitude[i]);
    }
    ++frames_;
  }

  PixelNoise result(NoiseSource source, double contrast) const {
    const std::size_t count = sum_.size() / pixels_;
    PixelNoise result{.use = use_, .frozen = frozen_, .images = std::max<std::size_t>(count, 1)};
    const auto n = static_cast<double>(frames_), planes = static_cast<double>(count);
    // A phase sample is the difference of two taps, and a distance has the information of two of four samples.
    const double taps = source == NoiseSource::taps ? planes : source == NoiseSource::phases ? 2 * planes : 0;
    result.samples = PixelNoise::freedom(frames_) * (source == NoiseSource::taps     ? planes
                                                     : source == NoiseSource::phases ? planes
                                                                                     : 1);
    std::vector<double> slow;
    for (std::size_t i = 0; i < pixels_; ++i) {
      const double a = amplitude_[i] / n, distance_variance = distance_[i] / (2 * (n - 1));
      double level = level_[i] / n, variance = differences_[i] / (2 * (n - 1)) / std::max(taps, 1.0);
      if (source != NoiseSource::taps) level = a / (2 * contrast);
      if (source == NoiseSource::decoded) variance = distance_variance * a * a / (scale_ * scale_);
      result.level.push_back(static_cast<float>(level));
      result.variance.push_back(static_cast<float>(variance));
      result.amplitude.push_back(static_cast<float>(a));
      result.distance_variance.push_back(static_cast<float>(distance_variance));
      if (use_[i] == PixelUse::good && variance > 0 && taps > 0)
        slow.push_back(about_the_mean(i) / std::max(taps, 1.0) / variance);
    }
    result.slow = slow.empty() ? 1 : physics::median(slow);
    return result;
  }

 private:
  void set(std::size_t pixel, PixelUse use) {
    if (use_[pixel] == PixelUse::good || (use > use_[pixel] && use_[pixel] != PixelUse::outside)) use_[pixel] = use;
  }
  void judge(std::size_t pixel, double value, bool taps) {
    if (!std::isfinite(value)) set(pixel, PixelUse::invalid);
    if (taps && value <= 0) set(pixel, PixelUse::clipped);
    if (taps && value >= limit_) set(pixel, PixelUse::saturated);
  }
  /// Sum over the planes of the variances about the means.
  double about_the_mean(std::size_t pixel) const {
    const auto n = static_cast<double>(frames_);
    double squares = squares_[pixel];
    for (std::size_t at = pixel; at < sum_.size(); at += pixels_) squares -= sum_[at] * sum_[at] / n;
    return squares / (n - 1);
  }
  void add_distance(std::size_t i, double distance, double amplitude) {
    amplitude_[i] += amplitude;
    if (frames_ > 0) {  // modulo the range
      const double change = std::remainder(distance - last_distance_[i], range_);
      distance_[i] += change * change;
    }
    last_distance_[i] = distance;
  }

  std::size_t pixels_;
  double range_, scale_, limit_;
  std::size_t frames_ = 0;
  std::vector<PixelUse> use_;
  std::vector<std::uint64_t> frozen_;
  std::vector<double> level_, differences_, squares_, amplitude_, distance_, last_distance_;
  std::vector<double> first_, last_, sum_;  // per sample
};

/// Reason why a condition is not used for the noise; empty: it is used.
std::string other_purpose(const io::Condition& c) {
  if (std::isfinite(c.velocity) && c.velocity != 0) return "the board moves";
  return "";
}

struct Read {
  NoiseCondition condition;
  NoiseSource source = NoiseSource::taps;
  CameraSeen seen;
  std::string mistake, left_out;
};

NoiseSource source_of(Kind kind) {
  if (kind == Kind::taps) return NoiseSource::taps;
  if (kind == Kind::phases) return NoiseSource::phases;
  if (kind == Kind::decoded) return NoiseSource::decoded;
  throw std::runtime_error(kind == Kind::images
                               ? "has neither taps nor phases nor distance"
                               : "has distances without amplitudes: the noise follows the light, so both are needed");
}

void read_frames(const io::Recording& recording, std::array<std::size_t, 2> frames, const std::optional<io::Roi>& roi,
                 const tofgraph_camera& camera, Read& result) {
  Sums sums(camera, roi);
  for (std::size_t f = frames[0]; f <= frames[1]; ++f) {
    if (result.source == NoiseSource::taps)
      sums.add_samples(recording.taps(f), true);
    else if (result.source == NoiseSource::phases)
      sums.add_samples(recording.floats("phases", f), false);
    else
      sums.add_decoded(recording.floats("distance", f), recording.floats("amplitude", f));
  }
  result.condition.pixels = sums.result(result.source, camera.contrast);
}

Read read_condition(const io::Condition& written, const tofgraph_camera& camera) {
  Read result;
  io::Condition condition = written;
  result.left_out = other_purpose(condition);
  if (!result.left_out.empty()) return result;
  try {
    const io::Recording recording(condition.capture);
    result.seen = {recording.reader().header().camera, recording.reader().header().serial};
    result.source = source_of(recording.kind());
    if (result.source != NoiseSource::taps && !(camera.contrast > 0))
      throw std::runtime_error(
          "has no taps, and the camera's profile no contrast: how much light there was is unknown");
    complete(condition, recording.reader(), camera);
    const auto frames = frames_of(recording, condition, camera);
    result.condition.frames = frames[1] - frames[0] + 1;
    result.condition.integration_time = condition.integration_time;
    result.condition.capped = condition.is_capped();
    result.condition.flat = condition.has_board() && condition.scene.empty() && !condition.is_capped();
    if (result.condition.frames < 2)
      result.left_out = "it has a single frame: noise shows between frames";
    else
      read_frames(recording, frames, condition.roi, camera, result);
  } catch (const std::runtime_error& error) {
    result.mistake = capture_problem(condition, error);
  }
  return result;
}

}  // namespace

double PixelNoise::freedom(std::size_t frames) {
  const auto n = static_cast<double>(frames);
  return 2 * (n - 1) * (n - 1) / (3 * n - 4);
}

NoiseData read_noise(const io::Campaign& campaign, const std::function<void(double share)>& progress) {
  const tofgraph_camera& camera = campaign.camera->view();
  NoiseData data{.rows = camera.height, .columns = camera.width, .modulation_frequency = camera.modulation_frequency};
  for (std::size_t i = 0; i < data.rows * data.columns; ++i)
    data.listed.push_back(campaign.camera->is_bad(i) ? bad_listed : 0);
  const std::size_t n = campaign.conditions.size();
  std::vector<Read> read(n);
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
    read[i] = read_condition(campaign.conditions[i], camera);
    if (progress) progress(static_cast<double>(++done) / static_cast<double>(n));
  });
  config::Diagnostics diagnostics;
  std::vector<CameraSeen> seen;
  for (const Read& r : read) seen.push_back(r.seen);
  data.serial = check_one_camera(campaign, seen, data.notes, diagnostics);
  for (std::size_t i = 0; i < n; ++i) {
    const io::Condition& c = campaign.conditions[i];
    if (!read[i].mistake.empty()) diagnostics.error(place_of(c), read[i].mistake, "");
    if (!read[i].left_out.empty()) data.notes.push_back(fmt::format("{}: left out: {}", c.id, read[i].left_out));
    if (!read[i].mistake.empty() || !read[i].left_out.empty()) continue;
    data.source = std::max(data.source, read[i].source);
    read[i].condition.index = i;
    data.conditions.push_back(std::move(read[i].condition));
    if (data.conditions.back().pixels.slow > 1.2)
      data.notes.push_back(fmt::format("{}: the samples drift from frame to frame, by {:.0f} % of the noise's variance",
                                       c.id, 100 * (data.conditions.back().pixels.slow - 1)));
  }
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return data;
}

}  // namespace tofgraph::calibration
