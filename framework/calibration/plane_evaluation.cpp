// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/plane_evaluation.hpp"

#include "calibration/board_measurement.hpp"
#include "calibration/camera_identity.hpp"
#include "calibration/frame_mean.hpp"
#include "io/captures/capture.hpp"
#include "io/serial.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tofgraph/channels.hpp>
#include <tofgraph/physics/constants.hpp>
#include <tofgraph/physics/non_linearity.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace tofgraph::calibration {
namespace {

namespace fs = std::filesystem;

/// Error of one pixel over the frames of a condition.
struct PixelError {
  std::size_t pixel = 0;
  double mean = 0, variance = io::unknown;  ///< m, m^2 between frames
  double frames = 0;
};

/// Condition, or the reason for its exclusion.
struct ReadPlane {
  EvaluatedCondition result;
  std::vector<PixelError> pixels;
  std::string serial, left_out;
};

/// Channel of lengths, converted to depths.
class LengthChannel {
 public:
  LengthChannel(const io::CaptureReader& capture, const tofgraph_camera& camera) : capture_(capture) {
    for (const char* name : {"depth", "range", "points"}) {
      const std::optional<std::size_t> index = index_of(name);
      if (!index || !fits(capture.channels()[*index], camera)) continue;
      index_ = *index;
      name_ = name;
      return;
    }
  }
  bool found() const { return !name_.empty(); }
  const std::string& name() const { return name_; }

  std::vector<float> read(std::size_t frame) const { return read(index_, frame); }
  std::vector<float> read_sigma(std::size_t frame) const {
    const std::optional<std::size_t> index = index_of("sigma");
    const bool own =
        index && capture_.channels()[*index].of == name_ && capture_.channels()[*index].type == TOFGRAPH_TYPE_F32;
    return own ? read(*index, frame) : std::vector<float>{};
  }
  /// Depth of a pixel from the sensor plane, m; NaN if the length is invalid. @param ray of the pixel
  double depth(const std::vector<float>& values, std::size_t pixel, const physics::Geometry& geometry,
               physics::Vector3 ray) const {
    if (name_ == "points")
      return points_.is_valid(&values[3 * pixel]) ? geometry.focal_length + double{values[3 * pixel + 2]} : io::unknown;
    if (!is_valid_length(values[pixel])) return io::unknown;
    return name_ == "depth" ? double{values[pixel]} : physics::depth_of(geometry, ray, double{values[pixel]});
  }
  /// Flags of the pixels of a frame; empty: the capture has no flags.
  std::vector<std::uint16_t> read_flags(std::size_t frame) const {
    const std::optional<std::size_t> index = index_of("flags");
    if (!index || capture_.channels()[*index].type != TOFGRAPH_TYPE_U16) return {};
    std::vector<std::uint16_t> flags(capture_.channels()[*index].elements());
    capture_.read(*index, frame, flags.data());
    return flags;
  }

 private:
  static bool fits(const io::CaptureChannel& channel, const tofgraph_camera& camera) {
    return channel.type == TOFGRAPH_TYPE_F32 && channel.extent.size() >= 2 && channel.extent[0] == camera.height &&
           channel.extent[1] == camera.width;
  }
  std::optional<std::size_t> index_of(std::string_view name) const {
    const auto& channels = capture_.channels();
    const auto found = std::ranges::find(channels, name, &io::CaptureChannel::name);
    if (found == channels.end()) return std::nullopt;
    return static_cast<std::size_t>(found - channels.begin());
  }
  std::vector<float> read(std::size_t index, std::size_t frame) const {
    std::vector<float> values(capture_.channels()[index].elements());
    capture_.read(index, frame, values.data());
    return values;
  }

  const io::CaptureReader& capture_;
  std::size_t index_ = 0;
  std::string name_;
  PointRule points_{""};
};

class PlaneReader {
 public:
  explicit PlaneReader(const io::Campaign& campaign)
      : profile_(*campaign.camera),
        camera_(profile_.view()),
        range_(physics::unambiguous_range(camera_.modulation_frequency)),
        models_(camera_, io::OffsetVariant::geometric, campaign.conditions) {}

  ReadPlane read(const io::Condition& condition) const {
    ReadPlane read;
    read.result.condition = condition;
    if (!condition.has_board() || !condition.scene.empty() || condition.is_capped()) {
      read.left_out = "it shows no board";
      return read;
    }
    try {
      const io::CaptureReader capture(condition.capture);
      read.serial = capture.header().serial;
      const LengthChannel lengths(capture, camera_);
      const std::vector<std::size_t> window = models_.of(condition).window(condition);
      if (window.empty()) throw std::runtime_error("shows no pixel of the board");
      if (lengths.found())
        from_lengths(lengths, capture, window, read);
      else
        from_samples(window, read);
      read.result.missing = 1 - static_cast<double>(read.pixels.size()) / static_cast<double>(window.size());
      if (read.pixels.empty()) read.left_out = "no pixel of the board is valid in half of the frames";
    } catch (const std::runtime_error& error) {
      read.left_out = capture_problem(condition, error);
    }
    return read;
  }

 private:
  double true_depth(const io::Condition& condition, std::size_t pixel) const {
    const BoardModel& model = models_.of(condition);
    const physics::Vector3 ray = model.ray(pixel);
    return physics::depth_of(model.geometry(), ray,
                             physics::reflected_path(model.geometry(), ray, plane_of(condition)));
  }

  void from_lengths(const LengthChannel& lengths, const io::CaptureReader& capture,
                    const std::vector<std::size_t>& window, ReadPlane& read) const {
    const io::Condition& condition = read.result.condition;
    if (capture.frames() == 0) throw std::runtime_error("has no frames");
    const auto [first, last] = condition.frames.value_or(std::array<std::uint64_t, 2>{0, capture.frames() - 1});
    if (last >= capture.frames()) throw std::runtime_error(fmt::format("has {} frames", capture.frames()));
    const BoardModel& model = models_.of(condition);
    std::vector<double> truth, sum(window.size()), square(window.size()), count(window.size());
    for (const std::size_t pixel : window) truth.push_back(true_depth(condition, pixel));
    double predicted = 0, predictions = 0;
    for (std::size_t frame = first; frame <= last; ++frame) {
      const std::vector<float> values = lengths.read(frame), sigma = lengths.read_sigma(frame);
      const std::vector<std::uint16_t> flags = lengths.read_flags(frame);
      for (std::size_t i = 0; i < window.size(); ++i) {
        if (!flags.empty() && (flags[window[i]] & flag::invalid) != 0) continue;
        const double e = lengths.depth(values, window[i], model.geometry(), model.ray(window[i])) - truth[i];
        if (!std::isfinite(e)) continue;
        sum[i] += e;
        square[i] += e * e;
        ++count[i];
        if (sigma.empty() || !std::isfinite(sigma[window[i]])) continue;
        predicted += double{sigma[window[i]]} * sigma[window[i]];
        ++predictions;
      }
    }
    read.result.channel = lengths.name();
    read.result.frames = last - first + 1;
    if (predictions > 0) read.result.predicted_noise = std::sqrt(predicted / predictions);
    for (std::size_t i = 0; i < window.size(); ++i) {
      if (2 * count[i] < static_cast<double>(read.result.frames) || count[i] == 0) continue;
      const double mean = sum[i] / count[i];
      const double variance =
          count[i] > 1 ? std::max((square[i] - count[i] * mean * mean) / (count[i] - 1), 0.0) : io::unknown;
      read.pixels.push_back({window[i], mean, variance, count[i]});
    }
  }

  /// Converts distances, measured or decoded from taps and phases, to depths by the geometry of the camera.
  void from_samples(const std::vector<std::size_t>& window, ReadPlane& read) const {
    const io::Condition& condition = read.result.condition;
    const MeanImages images = mean_of(io::Recording(condition.capture), condition, window, profile_);
    const BoardModel& model = models_.of(condition);
    const std::vector<double> modelled = model.modelled(condition, images.pixels);
    read.result.channel = "raw";
    read.result.frames = images.frames;
    for (std::size_t i = 0; i < images.pixels.size(); ++i) {
      const std::size_t pixel = images.pixels[i];
      const double distance = modelled[i] + std::remainder(images.distance[i] - modelled[i], range_);
      const auto depth_at = [&](double d) {
        const physics::Vector3 ray = model.ray(pixel);
        return physics::depth_of(model.geometry(), ray, physics::optimized_bistatic_newton(model.geometry(), ray, d));
      };
      if (!std::isfinite(distance)) continue;  // e.g. a pixel without light
      const double depth = depth_at(distance), slope = (depth_at(distance + 1e-3) - depth) / 1e-3;
      const double variance = images.variance.empty() ? io::unknown : std::max(images.variance[i], 0.0) * slope * slope;
      read.pixels.push_back(
          {pixel, depth - true_depth(condition, pixel), variance, static_cast<double>(images.frames)});
    }
  }

  const io::Camera& profile_;
  const tofgraph_camera& camera_;
  double range_;
  BoardModels models_;
};

DepthErrors errors_of(const std::vector<PixelError>& pixels) {
  DepthErrors errors{.pixels = pixels.size()};
  if (pixels.empty()) return errors;
  const auto n = static_cast<double>(pixels.size());
  double sum = 0, squares = 0, noise = 0, of_mean = 0, known = 0;
  for (const PixelError& p : pixels) {
    sum += p.mean / n;
    if (!std::isfinite(p.variance)) continue;  // valid in a single frame
    noise += p.variance;
    of_mean += p.variance / p.frames;
    known += 1;
  }
  noise = known > 0 ? noise / known : io::unknown;
  of_mean /= std::max(known, 1.0);
  for (const PixelError& p : pixels) squares += (p.mean - sum) * (p.mean - sum) / std::max(n - 1, 1.0);
  errors.bias = sum;
  errors.noise = std::sqrt(noise);
  errors.flatness = std::sqrt(std::max(squares - of_mean, 0.0));
  errors.rms = std::sqrt(sum * sum + errors.flatness * errors.flatness + (std::isfinite(noise) ? noise : 0));
  return errors;
}

/// Distances of the pixels from the principal point, in units of the ring width.
class Rings {
 public:
  explicit Rings(const tofgraph_camera& camera) : camera_(camera) {
    double corner = 0;
    for (const std::size_t pixel :
         {std::size_t{0}, std::size_t{camera.width} - 1, std::size_t{camera.width} * (camera.height - 1),
          std::size_t{camera.width} * camera.height - 1})
      corner = std::max(corner, radius(pixel));
    width_ = corner / static_cast<double>(ring_count);
  }
  std::size_t ring_of(std::size_t pixel) const {
    return std::min(static_cast<std::size_t>(radius(pixel) / width_), ring_count - 1);
  }
  double end(std::size_t ring) const { return width_ * static_cast<double>(ring + 1); }

 private:
  double radius(std::size_t pixel) const {
    const std::size_t column = pixel % camera_.width, row = pixel / camera_.width;
    return std::hypot(static_cast<double>(column) - camera_.principal_point[0],
                      static_cast<double>(row) - camera_.principal_point[1]);
  }
  const tofgraph_camera& camera_;
  double width_ = 1;
};

/// Mean shape of the error over the image, accumulated over the conditions.
class ShapeSum {
 public:
  explicit ShapeSum(std::size_t pixels) : sum_(pixels), count_(pixels) {}
  void add(const ReadPlane& read) {
    for (const PixelError& p : read.pixels) {
      sum_[p.pixel] += p.mean - read.result.all.bias;
      ++count_[p.pixel];
    }
  }
  std::vector<double> mean() const {
    std::vector<double> shape(sum_.size(), io::unknown);
    for (std::size_t i = 0; i < sum_.size(); ++i)
      if (count_[i] > 0) shape[i] = sum_[i] / count_[i];
    return shape;
  }

 private:
  std::vector<double> sum_, count_;
};

PlaneEvaluation evaluate_one(const fs::path& file, const std::function<void(double)>& progress) {
  config::Diagnostics diagnostics;
  PlaneEvaluation result{.campaign = io::read_campaign(file, diagnostics), .file = file};
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  const io::Campaign& campaign = result.campaign;
  if (campaign.from_table)
    throw config::ConfigurationError(fmt::format(
        "{}: error: a table of statistics has no images to evaluate: give a campaign of captures", file.string()));
  std::optional<PlaneReader> reader;
  try {
    reader.emplace(campaign);
  } catch (const std::invalid_argument& problem) {
    throw config::ConfigurationError(fmt::format("{}: error: {}", file.string(), problem.what()));
  }
  const std::size_t n = campaign.conditions.size();
  const tofgraph_camera& camera = campaign.camera->view();
  const Rings rings(camera);
  for (std::size_t r = 0; r < ring_count; ++r) result.ring_ends[r] = rings.end(r);
  std::vector<ReadPlane> read(n);
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
    read[i] = reader->read(campaign.conditions[i]);
    std::array<std::vector<PixelError>, ring_count> parts;
    for (const PixelError& p : read[i].pixels) parts[rings.ring_of(p.pixel)].push_back(p);
    read[i].result.all = errors_of(read[i].pixels);
    for (std::size_t r = 0; r < ring_count; ++r) read[i].result.rings[r] = errors_of(parts[r]);
    progress(static_cast<double>(++done) / static_cast<double>(n));
  });
  ShapeSum shape(std::size_t{camera.width} * camera.height);
  std::vector<std::string> serials;
  for (ReadPlane& one : read) {
    serials.push_back(one.serial);
    if (!one.left_out.empty()) {
      result.notes.push_back(fmt::format("{}: excluded: {}", one.result.condition.id, one.left_out));
      continue;
    }
    shape.add(one);
    result.conditions.push_back(std::move(one.result));
  }
  result.shape = shape.mean();
  result.serial = io::common_serial(campaign, serials, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  if (result.conditions.empty())
    throw config::ConfigurationError(fmt::format("{}: error: no board can be evaluated{}{}", file.string(),
                                                 result.notes.empty() ? "" : ":\n         ",
                                                 result.notes.empty() ? "" : result.notes.front()));
  return result;
}

}  // namespace

EvaluationResult evaluate_planes(const EvaluationRequest& request) {
  const auto progress = [&](double from, const char* what) {
    return [&request, from, what](double share) {
      if (request.progress) request.progress(from + share / 2, what);
    };
  };
  EvaluationResult result{evaluate_one(request.campaign, progress(0, "reading the campaign")), std::nullopt};
  const bool chosen = !request.before.empty();
  const fs::path before = chosen ? request.before : result.now.campaign.source;
  std::error_code error;
  if (before.empty()) return result;
  if (!chosen && !fs::is_regular_file(before, error)) {
    result.now.notes.push_back(
        fmt::format("the campaign's source {} is missing: there is no comparison with it", before.string()));
    return result;
  }
  result.before = evaluate_one(before, progress(0.5, "reading the campaign before"));
  return result;
}

}  // namespace tofgraph::calibration
