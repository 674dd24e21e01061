// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Corrects the distance offset by integration time and reflectivity, chapter 6 of the reference.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/offset_correction.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/bistatic_tables.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "io/offset_calibration.hpp"
#include "plugins/calibrated_serial.hpp"
#include "plugins/filters/nearest_offsets.hpp"
#include "plugins/filters/offset_grid.hpp"
#include "plugins/filters/offset_vector.hpp"
#include "plugins/filters/surface_mean.hpp"

#if HWY_ONCE
namespace tofgraph {

HWY_EXPORT(Look);
HWY_EXPORT(Average);
HWY_EXPORT(Interpolate);
HWY_EXPORT(Weigh);
HWY_EXPORT(Correct);

/// per_pixel: each pixel's depth z and reflectivity, averaged over neighbouring pixels on the same surface, determine
/// the true depth T of a board for which they would be measured; D(T) - D(z) for the pixel's ray is added (6.5), (6.6).
/// per_path: the same with the z of a board whose mean range over the image is the range measured by the pixel, and the
/// change of that board's mean range; light falling off towards the corners is treated as a darker surface. Since the
/// lookup values are averaged, the noise of the distance and its sigma are unchanged. board: one offset matrix from the
/// means over the whole image, as in the reference, for a single board.
///
/// D(z) is computed for one source at the centre of the sources, with their mean square distance: for sources 10 cm
/// apart the difference of two such distances is accurate to 0.1 % of the offset from 300 mm on.
struct OffsetCorrection final : Filter {
  InOut<float> distance{
      this,
      "distance",
      {.text = "half of the travelled path", .refuses = "denoised non_linearity offset", .adds = "offset"}};
  In<float> amplitude{
      this, "amplitude", {.optional = true, .text = "determines the reflectivity, unless `target` is given"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created, or combined with the incoming flags"}};
  Param<InputFile> calibration{
      this,
      "calibration",
      {.required = true, .choices = "offset", .text = "a calibration file of the kind offset, see calibrate offset"}};
  Param<Choice> method{this,
                       "method",
                       {.default_value = "per_pixel",
                        .choices = "per_pixel per_path board",
                        .text = "per_pixel: any scene, by depth and reflectivity; per_path: by range and light, as a "
                                "camera errs, for boards that are close together; board: one offset matrix for one "
                                "board that fills the image"}};
  Param<std::string> target{
      this, "target", {.text = "the calibration's target that matches all surfaces; default: found by amplitude"}};
  Param<std::int64_t> window{
      this,
      "window",
      {.default_value = "5",
       .min = 1,
       .max = 15,
       .text = "side in pixels of the square over which depth and reflectivity are averaged before they "
               "are looked up, odd; 1: not averaged, the offset then adds noise"}};
  Param<Choice> extrapolation{this,
                              "extrapolation",
                              {.default_value = "flag",
                               .choices = "flag refuse hold",
                               .text = "outside the calibrated range; flag: the nearest offset, flagged as "
                                       "extrapolated; refuse: the pixel becomes invalid; hold: not flagged"}};
  Out<float> offset{this,
                    "offset",
                    {.shape = "H W",
                     .unit = "m",
                     .optional = true,
                     .text = "offset that was added to the distance; written with `keep_offset`"}};
  Param<bool> keep_offset{
      this, "keep_offset", {.default_value = "false", .text = "writes the image `offset` of the added offset, (6.5)"}};
  Param<std::string> serial{
      this,
      "serial",
      {.text = "the camera's serial number, compared with the calibration's; default: the recording's"}};
  SerialCheck check_serial_{this};

  void prepare(Setup& setup) {
    const tofgraph_camera& camera = setup.camera();
    read(camera);
    check_serial_("calibration", calibration_.serial, serial.given() ? std::string(*serial) : serial_of(setup));
    if (!setup.knows(TOFGRAPH_KNOWS_INTEGRATION_TIME))
      throw std::runtime_error("needs the frames' integration time, which these frames do not state");
    const std::optional<std::size_t> only = chosen_target();
    if (!only && !amplitude.present())
      throw std::runtime_error(
          "needs the amplitude, which determines the reflectivity: put it after a decoder, read a recording with the "
          "channel amplitude, or name the target that matches the surfaces, e.g. " +
          ("target: " + calibration_.targets.front()));
    if (!only && !table_->knows_reflectivities())
      throw ConfigError("calibration",
                        "has no reflectivities: name the target that matches the surfaces, e.g. target: " +
                            calibration_.targets.front());
    if (*window % 2 == 0) throw ConfigError("window", "must be odd, e.g. window: 5");
    if (std::string_view(setup.find("distance")->applied).find("model_correction") != std::string_view::npos)
      note(
          "errors that both the calibration and the model before it contain are removed twice: calibrate boards with "
          "the same model undone, or remove the model");
    grid_ = OffsetGrid(*table_, only);
    if (table_->shape() == physics::OffsetTable::Shape::scattered)
      nearest_ = std::make_unique<NearestOffsets>(only ? table_->scattered_of(*only) : *table_);
    only_ = only;
    prepare_pixels(setup);
    flags.provide(setup);
    if (*keep_offset) offset.provide(setup);
    lengths_.prepare(setup, {"distance"});
  }

  void process(Frame& frame) const {
    const double time = frame.metadata().integration_time;
    if (!(time > 0)) throw std::runtime_error("the frame does not state its integration time");
    check_frequency(frame.metadata().modulation_frequency);
    const Array<float> image = distance(frame);
    if (image.rows() != rows_ || image.columns() != columns_)
      throw std::runtime_error("distance is " + std::to_string(image.rows()) + " x " + std::to_string(image.columns()) +
                               ", the camera has " + std::to_string(rows_) + " x " + std::to_string(columns_));
    const Array<std::uint16_t> bits = flags(frame, rows_, columns_);
    mark_invalid(image, Array<float>(), bits);
    const std::vector<float> before =
        *keep_offset ? std::vector<float>(image.begin(), image.end()) : std::vector<float>{};
    thread_local Surface seen;
    look(image, only_ ? nullptr : amplitude(frame).data(), time, seen);
    if (*method == "board")
      correct_board(image, bits, seen, time);
    else
      correct_pixels(image, bits, seen, time);
    if (*keep_offset) std::ranges::transform(image, before, offset(frame, rows_, columns_).begin(), std::minus<>());
    lengths_.invalidate(frame, bits);
  }

 private:
  void read(const tofgraph_camera& camera) {
    try {
      calibration_ = io::read_offset_calibration(std::string(*calibration), camera);
      table_.emplace(calibration_.samples);
    } catch (const std::exception& error) {
      throw ConfigError("calibration", std::string("the calibration cannot be used:\n") + error.what());
    }
  }

  void check_frequency(double frequency) const {
    if (!(std::abs(frequency / calibration_.modulation_frequency - 1) > 1e-3)) return;  // NaN: unknown
    throw std::runtime_error("the frame was taken at " + std::to_string(frequency * 1e-6) +
                             " MHz, the calibration is for " +
                             std::to_string(calibration_.modulation_frequency * 1e-6) + " MHz");
  }

  std::optional<std::size_t> chosen_target() const {
    const std::vector<std::string>& labels = calibration_.targets;
    if (!target.given()) return std::nullopt;
    const auto found = std::ranges::find(labels, std::string(*target));
    if (found != labels.end()) return static_cast<std::size_t>(found - labels.begin());
    std::string list;
    for (const std::string& label : labels) list += (list.empty() ? "" : ", ") + label;
    throw ConfigError("target", "the calibration has no target '" + std::string(*target) + "'; it has: " + list);
  }

  void prepare_pixels(const Setup& setup) {
    const tofgraph_camera& camera = setup.camera();
    rows_ = camera.height;
    columns_ = camera.width;
    std::vector<physics::Vector3> rays;
    for (std::size_t i = 0; i < rows_ * columns_; ++i) {
      rays.push_back(physics::unit_ray(camera.rays + 3 * i));
      cosine_.push_back(static_cast<float>(rays.back().z));
      response_.push_back(static_cast<float>(io::response_of(calibration_.falloff, camera.rays + 3 * i)));
    }
    seen_cosine_ = cosine_;
    if (*method == "per_path") take_means();
    for (const float response : response_) brightness_.push_back(static_cast<float>(4 / calibration_.gain) / response);
    tables_ = std::make_unique<physics::BistaticTables>(physics::geometry_of(camera), rays);
  }

  /// Replaces per-pixel factors by means over the image, because boards were averaged over the image: a pixel is
  /// treated like a board with the pixel's range as mean range, and less light like a darker surface.
  void take_means() {
    double inverse = 0, level = 0;
    for (const float cosine : cosine_) inverse += 1 / double{cosine};
    for (const float response : response_) level += std::log(double{response});
    const auto n = static_cast<double>(cosine_.size());
    seen_cosine_.assign(cosine_.size(), static_cast<float>(n / inverse));
    response_.assign(response_.size(), static_cast<float>(std::exp(level / n)));
  }

  /// Pointers to the pixels of a row.
  OffsetRow row_of(const Array<float>& image, Surface& seen, std::size_t row) const {
    const physics::BistaticCamera& camera = tables_->camera();
    const std::size_t first = row * columns_;
    return {.columns = columns_,
            .first = first,
            .distance = &image[first],
            .amplitude = nullptr,
            .sensor_path = camera.sensor_path + first,
            .mean_along = camera.mean_along + first,
            .cosine = &seen_cosine_[first],
            .brightness = &brightness_[first],
            .sources = tables_->sources().data(),
            .source_count = tables_->sources().size(),
            .focal_length = camera.focal_length,
            .mean_square = camera.mean_square,
            .rate = 0,
            .depth = seen.depth(row),
            .reflectivity = seen.reflectivity(row),
            .path = seen.path(row),
            .error = seen.error(row),
            .beyond = seen.beyond()};
  }

  /// Computes z, reflectivity and D_ref of each pixel.
  void look(const Array<float>& image, const float* amplitudes, double time, Surface& seen) const {
    seen.resize(rows_, columns_);
    for (std::size_t v = 0; v < rows_; ++v) {
      OffsetRow row = row_of(image, seen, v);
      row.amplitude = amplitudes != nullptr ? amplitudes + v * columns_ : nullptr;
      row.rate = static_cast<float>(1 / time);
      HWY_DYNAMIC_DISPATCH(Look)(row);
    }
  }

  void correct_pixels(const Array<float>& image, const Array<std::uint16_t>& bits, Surface& seen, double time) const {
    const OffsetPlane plane = grid_.at(time);
    if (*window > 1) {
      seen.average(static_cast<std::size_t>(*window), !only_, [](const AverageRow& row) {
        HWY_DYNAMIC_DISPATCH(Average)(row);
      });
    }
    std::vector<OffsetRow> rows;
    for (std::size_t v = 0; v < rows_; ++v) rows.push_back(row_of(image, seen, v));
    if (nearest_)
      nearest_->look_up(time, rows, [](const NearestGroup& group) { HWY_DYNAMIC_DISPATCH(Weigh)(group); });
    else
      for (const OffsetRow& row : rows) HWY_DYNAMIC_DISPATCH(Interpolate)(row, plane);
    const bool marks = *extrapolation != "hold";
    for (std::size_t v = 0; v < rows_; ++v) {
      HWY_DYNAMIC_DISPATCH(Correct)(rows[v], plane);
      for (std::size_t u = 0; marks && u < columns_; ++u) {
        if (seen.beyond()[u] != 0) mark(image, bits, v * columns_ + u);
      }
    }
  }

  /// Mean path from the sources to the pixel's point at D_ref.
  float mean_path(std::size_t i, float r) const {
    float mean = 0;
    for (const physics::BistaticSource& source : tables_->sources())
      mean += source.weight * std::sqrt(r * r + 2 * r * source.along[i] + source.square);
    return mean;
  }

  void mark(const Array<float>& image, const Array<std::uint16_t>& bits, std::size_t i) const {
    if ((bits[i] & flag::invalid) != 0) return;
    bits[i] |= flag::extrapolated;
    if (*extrapolation != "refuse") return;
    bits[i] |= flag::invalid;
    image[i] = std::numeric_limits<float>::quiet_NaN();
  }

  /// Applies (6.3) to (6.6) with the means over the valid pixels.
  void correct_board(const Array<float>& image, const Array<std::uint16_t>& bits, Surface& seen, double time) const {
    double depth = 0, level = 0, count = 0;
    for (std::size_t row = 0; row < rows_; ++row) {
      for (std::size_t u = 0; u < columns_; ++u) {
        const float z = seen.depth(row)[u], reflectivity = seen.reflectivity(row)[u];
        if (!std::isfinite(z) || !(reflectivity > 0)) continue;
        depth += double{z};
        level += std::log(double{reflectivity});
        ++count;
      }
    }
    if (count == 0) return;
    depth /= count;
    const auto found =
        only_ ? table_->of_target(*only_, depth, time) : table_->across(depth, time).at(std::exp(level / count));
    const auto error = static_cast<float>(found.depth - depth), z = static_cast<float>(depth);
    const physics::BistaticCamera& camera = tables_->camera();
    for (std::size_t i = 0; i < image.size(); ++i) {
      const float r = (z - camera.focal_length) / cosine_[i], step = error / cosine_[i];
      const float reflected = calibration_.variant == io::OffsetVariant::printed ? error : step;
      image[i] += (reflected + mean_path(i, r + step) - mean_path(i, r)) / 2;
      if (found.extrapolated && *extrapolation != "hold") mark(image, bits, i);
    }
  }

  io::OffsetCalibration calibration_;
  std::optional<physics::OffsetTable> table_;
  std::optional<std::size_t> only_;  // index of the target
  OffsetGrid grid_;
  std::unique_ptr<NearestOffsets> nearest_;  // for scattered samples only
  std::unique_ptr<physics::BistaticTables> tables_;
  std::vector<float> cosine_, response_, brightness_;  // per pixel; brightness: 4 / (gain response)
  std::vector<float> seen_cosine_;                     // converts a range to the depth used for the lookup
  std::size_t rows_ = 0, columns_ = 0;
  OtherLengths lengths_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::OffsetCorrection,
               "Removes the offset by integration time and reflectivity, from a calibration of boards")
#endif
