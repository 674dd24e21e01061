// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/frame_mean.hpp"

#include "calibration/pixel_outliers.hpp"
#include "config/quantity.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/constants.hpp>
#include <tofgraph/physics/exposures.hpp>
#include <tofgraph/physics/four_phase.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tofgraph::calibration {
namespace {

enum : std::uint8_t { good, no_number, saturated };

/// Mean images, and the variance of each pixel's distance in one frame, m^2; meaningless for a single frame.
struct PixelMeans {
  MeanImages images;
  std::vector<double> variance;
};

/// Sums over frames for each pixel of the window.
class Sums {
 public:
  Sums(const std::vector<std::size_t>& window, const tofgraph_camera& camera)
      : window_(window),
        stride_(std::size_t{camera.width} * camera.height),
        scale_(physics::metres_per_radian(camera.modulation_frequency)),
        limit_(camera.full_well > 0 ? std::min(camera.full_well, 65535.0) : 65535.0),
        samples_(window.size()),
        square_(window.size()),
        distance_(window.size()),
        amplitude_(window.size()),
        state_(window.size(), good) {}

  void add_taps(const std::vector<std::uint16_t>& taps) {
    for (std::size_t i = 0; i < window_.size(); ++i) {
      std::array<double, 4> c{};
      for (std::size_t k = 0; k < 4; ++k) {
        const double a = taps[2 * k * stride_ + window_[i]], b = taps[(2 * k + 1) * stride_ + window_[i]];
        c[k] = a - b;
        if (std::max(a, b) >= limit_) state_[i] = saturated;
      }
      add(i, c);
    }
  }

  void add_phases(const std::vector<float>& phases) {
    for (std::size_t i = 0; i < window_.size(); ++i) {
      std::array<double, 4> c{};
      for (std::size_t k = 0; k < 4; ++k) c[k] = phases[k * stride_ + window_[i]];
      if (std::isfinite(c[0] + c[1] + c[2] + c[3]))
        add(i, c);
      else
        state_[i] = std::max<std::uint8_t>(state_[i], no_number);
    }
  }

  void add_decoded(const std::vector<float>& distance, const std::vector<float>& amplitude) {
    for (std::size_t i = 0; i < window_.size(); ++i) {
      const double d = distance[window_[i]], a = amplitude.empty() ? 1 : amplitude[window_[i]];
      if (!std::isfinite(d + a) || !(a > 0)) {
        state_[i] = no_number;
        continue;
      }
      distance_[i] += d;
      square_[i] += d * d;
      amplitude_[i] += a;
    }
  }

  /// @param decoded true: distances were added; false: samples
  PixelMeans means(std::size_t frames, bool decoded, bool with_amplitude, UnusablePixels left_out) const {
    PixelMeans result{.images = {.frames = frames}, .variance = {}};
    const auto n = static_cast<double>(frames);
    for (std::size_t i = 0; i < window_.size(); ++i) {
      left_out.saturated += state_[i] == saturated ? 1 : 0;
      left_out.invalid += state_[i] == no_number ? 1 : 0;
      if (state_[i] != good) continue;
      result.images.pixels.push_back(window_[i]);
      if (decoded) {
        result.images.distance.push_back(distance_[i] / n);
        if (with_amplitude) result.images.amplitude.push_back(amplitude_[i] / n);
        result.variance.push_back((square_[i] - distance_[i] * distance_[i] / n) / (n - 1));
        continue;
      }
      std::array<double, 4> c = samples_[i];
      double squares = square_[i];
      for (double& sum : c) {
        squares -= sum * sum / n;
        sum /= n;
      }
      const physics::Decoded pixel = physics::decode(c);
      result.images.distance.push_back(scale_ * pixel.phase);
      result.images.amplitude.push_back(pixel.amplitude);
      result.variance.push_back(std::pow(scale_ / pixel.amplitude, 2) * squares / (4 * (n - 1)) / 2);
    }
    result.images.saturated =
        static_cast<double>(left_out.saturated) / static_cast<double>(std::max<std::size_t>(window_.size(), 1));
    result.images.left_out = left_out;
    return result;
  }

 private:
  void add(std::size_t i, const std::array<double, 4>& c) {
    for (std::size_t k = 0; k < 4; ++k) {
      samples_[i][k] += c[k];
      square_[i] += c[k] * c[k];
    }
  }

  const std::vector<std::size_t>& window_;
  std::size_t stride_;
  double scale_, limit_;
  std::vector<std::array<double, 4>> samples_;
  std::vector<double> square_, distance_, amplitude_;
  std::vector<std::uint8_t> state_;
};

void check_exposures(const io::CaptureReader& capture) {
  for (const io::CaptureChannel& channel : capture.channels()) {
    if (channel.name != "taps" && channel.name != "phases") continue;
    if (channel.extent[0] != physics::four_exposures.size())
      throw std::runtime_error(fmt::format(
          "has {} exposures a frame: a calibration needs four steps of 90 deg of one frequency, or recorded distances",
          channel.extent[0]));
  }
  const physics::Exposures& own = capture.header().exposures;
  const std::string problem = own.empty() ? std::string() : physics::not_the_four(own);
  if (!problem.empty()) throw std::runtime_error("cannot be used: a calibration " + problem);
}

PixelMeans means_of(const io::Recording& recording, const io::Condition& condition,
                    const std::vector<std::size_t>& wanted, const io::Camera& camera) {
  using Kind = io::Recording::Kind;
  const Kind kind = recording.kind();
  if (kind == Kind::images) throw std::runtime_error("has neither taps nor phases nor distance");
  const auto [first, last] = frames_of(recording, condition, camera.view());
  std::vector<std::size_t> window = wanted;
  std::erase_if(window, [&](std::size_t pixel) { return camera.is_bad(pixel); });
  Sums sums(window, camera.view());
  for (std::size_t f = first; f <= last; ++f) {
    if (kind == Kind::taps)
      sums.add_taps(recording.taps(f));
    else if (kind == Kind::phases)
      sums.add_phases(recording.floats("phases", f));
    else
      sums.add_decoded(recording.floats("distance", f),
                       kind == Kind::decoded ? recording.floats("amplitude", f) : std::vector<float>{});
  }
  PixelMeans means = sums.means(last - first + 1, kind == Kind::decoded || kind == Kind::distances,
                                kind == Kind::decoded, {.pixels = wanted.size(), .map = wanted.size() - window.size()});
  means.images.shows_saturation = kind == Kind::taps;
  return means;
}

/// Keeps the values with a nonzero mark.
template <class T> void keep_marked(std::vector<T>& values, const std::vector<std::uint8_t>& marks) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (marks[i] != 0) values[kept++] = values[i];
  }
  values.resize(kept);
}

void leave_out_outliers(const io::Recording& recording, const std::vector<std::size_t>& window,
                        const std::vector<double>& modelled, const tofgraph_camera& camera, PixelMeans& means) {
  MeanImages& images = means.images;
  std::vector<double> residual;
  for (std::size_t i = 0, k = 0; i < images.pixels.size(); ++i, ++k) {  // the pixels are a subset of the window
    while (window[k] != images.pixels[i]) ++k;
    residual.push_back(images.distance[i] - modelled[k]);
  }
  const double samples =
      recording.kind() == io::Recording::Kind::taps || recording.kind() == io::Recording::Kind::phases
          ? 4  // independent samples per frame
          : 1;
  FlatTarget target{.pixels = images.pixels,
                    .residual = residual,
                    .amplitude = images.amplitude,
                    .variance = {},
                    .freedom = samples * static_cast<double>(images.frames - 1),
                    .range = physics::unambiguous_range(camera.modulation_frequency),
                    .columns = camera.width};
  if (images.frames > 1) target.variance = means.variance;
  const std::vector<std::uint8_t> keep = keep_like_neighbours(target, images.left_out);
  keep_marked(images.pixels, keep);
  keep_marked(images.distance, keep);
  keep_marked(images.amplitude, keep);
  keep_marked(means.variance, keep);
}

/// Sets the noise of a distance in one frame, over all pixels.
void set_frame_noise(PixelMeans& means) {
  if (means.images.frames < 2 || means.variance.empty()) return;
  double sum = 0;
  for (const double v : means.variance) sum += v;
  means.images.noise = std::sqrt(std::max(sum, 0.0) / static_cast<double>(means.variance.size()));
}

}  // namespace

void complete(io::Condition& condition, const io::CaptureReader& capture, const tofgraph_camera& camera) {
  using config::format_quantity;
  if (capture.frames() == 0) throw std::runtime_error("has no frames");
  const auto [first_frame, last_frame] =
      condition.frames.value_or(std::array<std::uint64_t, 2>{0, capture.frames() - 1});
  const tofgraph_metadata first = capture.metadata(first_frame);
  for (std::uint64_t frame = first_frame; frame <= last_frame && frame < capture.frames(); ++frame) {
    const double time = capture.metadata(frame).integration_time;
    if (time != first.integration_time && !(std::isnan(time) && std::isnan(first.integration_time)))
      throw std::runtime_error(fmt::format(
          "was recorded with several integration times, {} and {}: give each a condition with its frames, e.g. "
          "frames: [0, 19]",
          format_quantity(first.integration_time, "s"), format_quantity(time, "s")));
  }
  if (std::isnan(condition.integration_time)) condition.integration_time = first.integration_time;
  if (std::isnan(condition.integration_time))
    throw std::runtime_error("does not know its integration time; write e.g. integration_time: 1 ms in the campaign");
  if (std::isnan(condition.time_since_power_on)) condition.time_since_power_on = first.time_since_power_on;
  const double frequency = first.modulation_frequency;
  if (std::isfinite(frequency) && std::abs(frequency / camera.modulation_frequency - 1) > 1e-3)
    throw std::runtime_error(fmt::format("was recorded at {}, the camera '{}' works at {}",
                                         format_quantity(frequency, "Hz"), camera.name,
                                         format_quantity(camera.modulation_frequency, "Hz")));
}

std::array<std::size_t, 2> frames_of(const io::Recording& recording, const io::Condition& condition,
                                     const tofgraph_camera& camera) {
  const io::CaptureReader& capture = recording.reader();
  const auto& header = capture.header();
  if (header.width != camera.width || header.height != camera.height)
    throw std::runtime_error(fmt::format("is {} x {} px, the camera '{}' has {} x {}", header.width, header.height,
                                         camera.name, camera.width, camera.height));
  if (capture.frames() == 0) throw std::runtime_error("has no frames");
  check_exposures(capture);
  const std::size_t first = condition.frames ? (*condition.frames)[0] : 0;
  const std::size_t last = condition.frames ? (*condition.frames)[1] : capture.frames() - 1;
  if (last >= capture.frames())
    throw std::runtime_error(fmt::format("has {} frames, the campaign wants frame {}", capture.frames(), last));
  return {first, last};
}

MeanImages mean_of(const io::Recording& recording, const io::Condition& condition,
                   const std::vector<std::size_t>& window, const io::Camera& camera) {
  PixelMeans means = means_of(recording, condition, window, camera);
  set_frame_noise(means);
  return std::move(means.images);
}

MeanImages mean_of_flat(const io::Recording& recording, const io::Condition& condition,
                        const std::vector<std::size_t>& window, const std::vector<double>& modelled,
                        const io::Camera& camera) {
  PixelMeans means = means_of(recording, condition, window, camera);
  leave_out_outliers(recording, window, modelled, camera.view(), means);
  set_frame_noise(means);
  return std::move(means.images);
}

}  // namespace tofgraph::calibration
