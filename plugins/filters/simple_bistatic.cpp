// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Highway compiles the plain loops over a table for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/simple_bistatic.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <hwy/highway.h>

#include "plugins/filters/linear_model.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

/// Adds to each pixel its weighted distance from a source at (x, y, z), in m, to the point where its ray (tangents)
/// meets the plane; `beyond` is the plane's distance from the lens.
void AddPaths(const float* tangent_x, const float* tangent_y, std::size_t pixels, float beyond, float x, float y,
              float z, float weight, float* paths) {
  float* __restrict sum = paths;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float dx = tangent_x[i] * beyond - x, dy = tangent_y[i] * beyond - y;
    sum[i] += weight * std::sqrt(dx * dx + dy * dy + z * z);
  }
}

/// Offset and slope of each pixel from the mean path, equation (5.158); paths become the offsets.
void Linearise(const float* cosine, std::size_t pixels, float plane, float lens, float* paths, float* slopes) {
  float* __restrict offset = paths;
  float* __restrict slope = slopes;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float angle = offset[i] / plane, share = cosine[i] / (1 + cosine[i] * angle);
    slope[i] = 2 * share;
    offset[i] = lens - share * (lens * angle + lens / cosine[i]);
  }
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tofgraph {

HWY_EXPORT(AddPaths);
HWY_EXPORT(Linearise);

/// Uses the sources' angles for a perpendicular plane, equations (5.144), (5.158): exact for a board at the plane's
/// depth. The depth is given, e.g. by a laser range finder, or estimated from each frame: the mean depth of the valid
/// pixels, starting with the perpendicular model and iterated until it converges.
struct SimpleBistatic final : LinearModel {
  Param<double> plane_depth{this,
                            "plane_depth",
                            {.unit = "m",
                             .default_value = "auto",
                             .min = 0.02,
                             .max = 1000,
                             .choices = "auto",
                             .text = "of the plane from the sensor plane; auto: estimated from the frame"}};

  void prepare(Setup& setup) {
    prepare_model(setup);
    if (estimates()) {
      perpendicular_ =
          table([this](physics::Vector3 ray) { return physics::perpendicular_illumination(geometry, ray); });
      for (const physics::Vector3& ray : rays) {
        tangent_x_.push_back(static_cast<float>(ray.x / ray.z));
        tangent_y_.push_back(static_cast<float>(ray.y / ray.z));
        cosine_.push_back(static_cast<float>(ray.z));
      }
      return;
    }
    if (*plane_depth <= geometry.focal_length) throw ConfigError("plane_depth", "must be in front of the lens");
    table_ = table([this](physics::Vector3 ray) { return physics::simple_bistatic(geometry, ray, *plane_depth); });
  }

  void process(Frame& frame) const {
    if (!estimates()) {
      apply(frame, table_);
      return;
    }
    thread_local LinearTable table_of_frame;
    const double plane = estimate(distance(frame));
    if (std::isfinite(plane)) fill_table(static_cast<float>(plane), table_of_frame);
    apply(frame, std::isfinite(plane) ? table_of_frame : perpendicular_);
  }

 private:
  bool estimates() const { return plane_depth.keyword() == "auto"; }

  /// Mean depth of a subset of the valid pixels; NaN if there are none.
  double estimate(const Array<const float>& measured) const {
    constexpr std::size_t step = 97;  // prime, so that no column is left out; some hundred pixels suffice
    double plane = std::numeric_limits<double>::quiet_NaN();
    for (int round = 0; round < 4; ++round) {
      double sum = 0, count = 0;
      for (std::size_t i = 0; i < measured.size(); i += step) {
        const double first =
            static_cast<double>(perpendicular_.offset[i]) + static_cast<double>(perpendicular_.slope[i]) * measured[i];
        if (!(first > geometry.focal_length) || !is_valid_length(measured[i])) continue;
        const physics::LinearDepth pixel =
            round == 0 ? physics::LinearDepth{} : physics::simple_bistatic(geometry, rays[i], plane);
        sum += round == 0 ? first : pixel.offset + pixel.slope * measured[i];
        ++count;
      }
      plane = sum / count;
    }
    return plane > geometry.focal_length ? plane : std::numeric_limits<double>::quiet_NaN();
  }

  /// Coefficients of the model for a plane, in single precision: g is known to 1e-7, the depth to 1 um at 7.4 m.
  void fill_table(float plane, LinearTable& result) const {
    const std::size_t pixels = rays.size();
    result.offset.assign(pixels, 0);
    result.slope.resize(pixels);
    const auto lens = static_cast<float>(geometry.focal_length);
    // The offsets hold the mean path at first.
    for (const physics::WeightedSource& source : geometry.sources) {
      const auto x = static_cast<float>(source.position.x), y = static_cast<float>(source.position.y);
      const auto z = plane - static_cast<float>(source.position.z), weight = static_cast<float>(source.weight);
      HWY_DYNAMIC_DISPATCH(AddPaths)
      (tangent_x_.data(), tangent_y_.data(), pixels, plane - lens, x, y, z, weight, result.offset.data());
    }
    HWY_DYNAMIC_DISPATCH(Linearise)(cosine_.data(), pixels, plane, lens, result.offset.data(), result.slope.data());
  }

  LinearTable table_, perpendicular_;
  std::vector<float> tangent_x_, tangent_y_, cosine_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::SimpleBistatic, "Distance to depth with the sources' angles for a plane, given or estimated")
#endif
