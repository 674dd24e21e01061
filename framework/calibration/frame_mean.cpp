// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/frame_mean.hpp"

#include "calibration/pixel_outliers.hpp"
#include "config/quantity.hpp"
#include "io/captures/condition_statistics.hpp"

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

  /// Sets the sums from those of taps or phases of four exposures of all pixels.
  void take(const io::PixelSums& sums) {
    for (std::size_t i = 0; i < window_.size(); ++i) {
      const std::size_t pixel = window_[i];
      for (std::size_t k = 0; k < 4; ++k) samples_[i][k] = sums.sum[4 * pixel + k];
      square_[i] = sums.square[pixel];
      state_[i] = (sums.bad[pixel] & io::PixelSums::saturated) != 0 ? saturated
                  : sums.bad[pixel] != 0                            ? no_number
                                                                    : good;
    }
  }

  /// @param decoded true: distances were added; false: samples
  MeanImages means(std::size_t frames, bool decoded, bool with_amplitude, UnusablePixels left_out) const {
    MeanImages result{.frames = frames};
    const auto n = static_cast<double>(frames);
    for (std::size_t i = 0; i < window_.size(); ++i) {
      left_out.saturated += state_[i] == saturated ? 1 : 0;
      left_out.invalid += state_[i] == no_number ? 1 : 0;
      if (state_[i] != good) continue;
      result.pixels.push_back(window_[i]);
      if (decoded) {
        result.distance.push_back(distance_[i] / n);
        if (with_amplitude) result.amplitude.push_back(amplitude_[i] / n);
        if (frames > 1) result.variance.push_back((square_[i] - distance_[i] * distance_[i] / n) / (n - 1));
        continue;
      }
      std::array<double, 4> c = samples_[i];
      double squares = square_[i];
      for (double& sum : c) {
        squares -= sum * sum / n;
        sum /= n;
      }
      const physics::Decoded pixel = physics::decode(c);
      result.distance.push_back(scale_ * pixel.phase);
      result.amplitude.push_back(pixel.amplitude);
      if (frames > 1) result.variance.push_back(std::pow(scale_ / pixel.amplitude, 2) * squares / (4 * (n - 1)) / 2);
    }
    result.saturated =
        static_cast<double>(left_out.saturated) / static_cast<double>(std::max<std::size_t>(window_.size(), 1));
    result.left_out = left_out;
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

/// @throws std::runtime_error if calibrations of the camera cannot use a capture
void check_fits(const io::CaptureFacts& capture, const tofgraph_camera& camera) {
  const io::CaptureHeader& header = capture.header;
  if (header.width != camera.width || header.height != camera.height)
    throw std::runtime_error(fmt::format("is {} x {} px, the camera '{}' has {} x {}", header.width, header.height,
                                         camera.name, camera.width, camera.height));
  if (capture.exposures != 0 && capture.exposures != physics::four_exposures.size())
    throw std::runtime_error(fmt::format(
        "has {} exposures per frame: a calibration needs four steps of 90 deg of one frequency, or recorded distances",
        capture.exposures));
  const std::string problem = header.exposures.empty() ? std::string() : physics::not_the_four(header.exposures);
  if (!problem.empty()) throw std::runtime_error("cannot be used: a calibration " + problem);
}

/// @throws std::runtime_error if the frames were recorded at a modulation frequency unlike the camera's
void check_frequency(const io::Recording& recording, io::Condition condition, const tofgraph_camera& camera) {
  condition.integration_time = 0;  // distances do not depend on it: it may be unknown
  io::complete(condition, io::facts_of(recording.reader(), condition), camera);
}

std::vector<std::size_t> without_bad(std::vector<std::size_t> window, const io::Camera& camera) {
  std::erase_if(window, [&](std::size_t pixel) { return camera.is_bad(pixel); });
  return window;
}

MeanImages means_of(const io::Recording& recording, const io::Condition& condition,
                    const std::vector<std::size_t>& wanted, const io::Camera& camera) {
  using Kind = io::Recording::Kind;
  const Kind kind = recording.kind();
  if (kind == Kind::images) throw std::runtime_error("has neither taps nor phases nor distance");
  const auto [first, last] = frames_of(recording, condition, camera.view());
  check_frequency(recording, condition, camera.view());
  const std::vector<std::size_t> window = without_bad(wanted, camera);
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
  MeanImages means = sums.means(last - first + 1, kind == Kind::decoded || kind == Kind::distances,
                                kind == Kind::decoded, {.pixels = wanted.size(), .map = wanted.size() - window.size()});
  means.shows_saturation = kind == Kind::taps;
  return means;
}

MeanImages means_of(const io::Statistics& statistics, const std::vector<std::size_t>& wanted,
                    const io::Camera& camera) {
  const std::vector<std::size_t> window = without_bad(wanted, camera);
  Sums sums(window, camera.view());
  sums.take(statistics.sums);
  MeanImages means =
      sums.means(statistics.sums.frames, false, false, {.pixels = wanted.size(), .map = wanted.size() - window.size()});
  means.shows_saturation = statistics.sums.kind == "taps";
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

/// @param samples number of independent samples of a pixel per frame
void leave_out_outliers(double samples, const std::vector<std::size_t>& window, const std::vector<double>& modelled,
                        const tofgraph_camera& camera, MeanImages& images) {
  std::vector<double> residual;
  for (std::size_t i = 0, k = 0; i < images.pixels.size(); ++i, ++k) {  // the pixels are a subset of the window
    while (window[k] != images.pixels[i]) ++k;
    residual.push_back(images.distance[i] - modelled[k]);
  }
  const FlatTarget target{.pixels = images.pixels,
                          .residual = residual,
                          .amplitude = images.amplitude,
                          .variance = images.variance,
                          .freedom = samples * static_cast<double>(images.frames - 1),
                          .range = physics::unambiguous_range(camera.modulation_frequency),
                          .columns = camera.width};
  const std::vector<std::uint8_t> keep = keep_like_neighbours(target, images.left_out);
  keep_marked(images.pixels, keep);
  keep_marked(images.distance, keep);
  keep_marked(images.amplitude, keep);
  keep_marked(images.variance, keep);
}

/// Sets the noise of a distance in one frame, over all pixels.
void set_frame_noise(MeanImages& images) {
  if (images.variance.empty()) return;
  double sum = 0;
  for (const double v : images.variance) sum += v;
  images.noise = std::sqrt(std::max(sum, 0.0) / static_cast<double>(images.variance.size()));
}

std::variant<io::Recording, io::Statistics> read(const io::Condition& condition, const io::Camera& camera) {
  using Frames = std::variant<io::Recording, io::Statistics>;
  if (!io::is_statistics(condition.capture)) return Frames(std::in_place_type<io::Recording>, condition.capture);
  io::Statistics statistics = io::read_statistics(condition, camera);
  check_fits(statistics.header.facts, camera.view());
  if (statistics.sums.kind != "taps" && statistics.sums.kind != "phases")
    throw std::runtime_error(
        "holds statistics of decoded frames, without sums of distances: give the campaign of captures");
  return statistics;
}

}  // namespace

void complete(io::Condition& condition, const io::CaptureReader& capture, const tofgraph_camera& camera) {
  io::check_one_integration_time(capture, io::used_frames(condition, capture.frames()));
  io::complete(condition, io::facts_of(capture, condition), camera);
}

std::array<std::size_t, 2> frames_of(const io::Recording& recording, const io::Condition& condition,
                                     const tofgraph_camera& camera) {
  const io::CaptureFacts facts = io::facts_of(recording.reader(), condition);
  check_fits(facts, camera);
  return io::used_frames(condition, facts.frames);
}

MeanImages mean_of(const io::Recording& recording, const io::Condition& condition,
                   const std::vector<std::size_t>& window, const io::Camera& camera) {
  MeanImages images = means_of(recording, condition, window, camera);
  set_frame_noise(images);
  return images;
}

BoardFrames::BoardFrames(const io::Condition& condition, const io::Camera& camera)
    : camera_(camera), condition_(condition), frames_(read(condition, camera)) {
  if (const auto* recording = std::get_if<io::Recording>(&frames_))
    complete(condition_, recording->reader(), camera.view());
  else
    io::complete(condition_, std::get<io::Statistics>(frames_).header.facts, camera.view());
}

const io::CaptureHeader& BoardFrames::header() const {
  if (const auto* recording = std::get_if<io::Recording>(&frames_)) return recording->reader().header();
  return std::get<io::Statistics>(frames_).header.facts.header;
}

double BoardFrames::recorded_time() const {
  if (const auto* recording = std::get_if<io::Recording>(&frames_))
    return io::facts_of(recording->reader(), condition_).first.integration_time;
  return std::get<io::Statistics>(frames_).header.facts.first.integration_time;
}

std::string BoardFrames::applied() const {
  const auto* recording = std::get_if<io::Recording>(&frames_);
  if (recording == nullptr) return {};  // statistics contain samples, to which no corrections are applied
  const auto& channels = recording->reader().channels();
  const auto distance = std::ranges::find(channels, "distance", &io::CaptureChannel::name);
  return distance == channels.end() ? std::string() : distance->applied;
}

MeanImages BoardFrames::mean(const std::vector<std::size_t>& window, const std::vector<double>& modelled) const {
  using Kind = io::Recording::Kind;
  double samples = 4;
  MeanImages images;
  if (const auto* recording = std::get_if<io::Recording>(&frames_)) {
    if (recording->kind() != Kind::taps && recording->kind() != Kind::phases) samples = 1;
    images = means_of(*recording, condition_, window, camera_);
  } else {
    images = means_of(std::get<io::Statistics>(frames_), window, camera_);
  }
  leave_out_outliers(samples, window, modelled, camera_.view(), images);
  set_frame_noise(images);
  return images;
}

}  // namespace tofgraph::calibration
