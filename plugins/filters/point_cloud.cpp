// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Depth or range to points in the optical frame: scaled rays of the pixels.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/point_cloud.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <hwy/highway.h>
#include <tofgraph/lengths.hpp>

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#ifndef TOFGRAPH_POINT_CLOUD_ONCE
#define TOFGRAPH_POINT_CLOUD_ONCE
namespace tofgraph {

/// Images of a frame and the tables; point = (length - offset) * direction.
struct CloudImages {
  const float* length;
  const float* direction;  // pixels x 3
  float offset;            // m
  float* points;           // pixels x 3
  std::uint16_t* flags;    // read and combined
  std::size_t pixels;
};

}  // namespace tofgraph
#endif

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Processes whole vectors of pixels from `begin` on. @returns the first unprocessed pixel
template <class D> HWY_INLINE std::size_t ScaleSome(D d, const CloudImages images, std::size_t begin) {
  using V = hn::Vec<D>;
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::uint16_t, D> du16;
  const std::size_t lanes = hn::Lanes(d);
  // Expands one vector of lengths to three vectors of coordinates: pixels 0 0 0 1 1 1 2 2 | 2 3 3 3 ..
  HWY_ALIGN std::int32_t pixel_of[3 * hn::MaxLanes(d)];
  for (std::size_t k = 0; k < 3 * lanes; ++k) pixel_of[k] = static_cast<std::int32_t>(k / 3);
  const decltype(hn::SetTableIndices(d, pixel_of)) spread[] = {hn::SetTableIndices(d, pixel_of),
                                                               hn::SetTableIndices(d, pixel_of + lanes),
                                                               hn::SetTableIndices(d, pixel_of + 2 * lanes)};
  std::size_t i = begin;
  for (; i + lanes <= images.pixels; i += lanes) {
    const V measured = hn::LoadU(d, images.length + i);
    V length = hn::Sub(measured, hn::Set(d, images.offset));
    auto flags = hn::PromoteTo(di, hn::LoadU(du16, images.flags + i));
    const auto good = hn::Eq(hn::And(flags, hn::Set(di, flag::invalid)), hn::Zero(di));
    const auto ahead = hn::And(hn::Gt(length, hn::Zero(d)), hn::Le(measured, hn::Set(d, max_length)));
    const auto valid = hn::And(ahead, hn::RebindMask(d, good));
    flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, hn::Not(valid)), hn::Set(di, flag::invalid)));
    hn::StoreU(hn::DemoteTo(du16, flags), du16, images.flags + i);
    length = hn::IfThenElse(valid, length, hn::NaN(d));
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t at = 3 * i + k * lanes;
      const V direction = hn::LoadU(d, images.direction + at);
      hn::StoreU(hn::Mul(direction, hn::TableLookupLanes(length, spread[k])), d, images.points + at);
    }
  }
  return i;
}

void Scale(const CloudImages& images) {
  const std::size_t done = ScaleSome(hn::ScalableTag<float>(), images, 0);
  ScaleSome(hn::CappedTag<float, 1>(), images, done);
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tofgraph {

HWY_EXPORT(Scale);

/// Points in the optical frame (origin at the lens centre, x right, y down, z forward): from a depth z, the point of
/// the ray with z = depth - focal_length; from a range, range times the ray. Invalid pixels and points not in front of
/// the lens become NaN. Sigma becomes that along the ray: that of the depth divided by cos(theta).
struct PointCloud final : Filter {
  static constexpr bool steady = true;
  In<float> length{this,
                   "depth|range|distance",
                   {.name = "length", .text = "depth from the sensor plane or range from the lens centre"}};
  Out<float> points{this, "points", {.from = "depth range distance rays"}};
  InOut<float> sigma{
      this,
      "sigma",
      {.optional = true, .text = "standard deviation of the length; becomes that along the ray", .of = "points"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created, or combined with the incoming flags"}};
  Param<Choice> channel{this,
                        "channel",
                        {.default_value = "auto",
                         .choices = "auto depth range distance",
                         .text = "auto: the first of depth, range, distance that exists"}};
  Param<Choice> assume{this,
                       "assume",
                       {.choices = "range lens_depth",
                        .text = "range: 'distance' already is a straight distance from the lens centre; without this "
                                "distances are refused. lens_depth: 'depth' counts from the lens centre, as in ROS and "
                                "OpenCV, not from the sensor plane"}};

  void prepare(Setup& setup) {
    const tofgraph_camera& camera = setup.camera();
    const std::string_view source = length.channel();
    if (source == "distance" && *assume != "range") {
      throw ConfigError(
          "assume",
          "'distance' is half of the travelled path, not a range: put optimized_bistatic before it, or write "
          "assume: range if the camera's distances already are ranges");
    }
    if (source == "depth" && *assume != "lens_depth" && !(camera.focal_length > 0)) {
      throw std::runtime_error(
          std::string("depth counts from the sensor plane, but the camera '") + camera.name +
          "' has no focal length in metres: its profile must give lengths, e.g. pixel_pitch: 40 um and "
          "focal_length: 12.8 mm; or write assume: lens_depth if the depths count from the lens centre, as in ROS");
    }
    if (sigma.present() && setup.find("sigma")->of != source) {
      throw std::runtime_error(std::string("sigma is that of '") + setup.find("sigma")->of +
                               "', the points come from '" + length.channel() + "'");
    }
    flags.provide(setup);
    lengths_.prepare(setup, {"sigma"});
    rows_ = camera.height;
    columns_ = camera.width;
    make_directions(camera, source == "depth");
    if (!outside_.empty())
      warn(std::to_string(outside_.size()) + " of " + std::to_string(rows_ * columns_) +
           " pixels have no ray: the camera's lens model does not reach them");
  }

  void process(Frame& frame) const {
    const Array<const float> image = length(frame);
    if (image.rows() != rows_ || image.columns() != columns_) {
      throw std::runtime_error(std::string(length.channel()) + " is " + std::to_string(image.rows()) + " x " +
                               std::to_string(image.columns()) + ", the camera has " + std::to_string(rows_) + " x " +
                               std::to_string(columns_));
    }
    const Array<std::uint16_t> bits = flags(frame, rows_, columns_);
    HWY_DYNAMIC_DISPATCH(Scale)
    ({.length = image.data(),
      .direction = directions_.data(),
      .offset = offset_,
      .points = points(frame, rows_, columns_, 3).data(),
      .flags = bits.data(),
      .pixels = image.size()});
    for (const std::size_t i : outside_) bits[i] |= flag::invalid | flag::outside_lens;
    lengths_.invalidate(frame, bits);
    if (!sigma.present()) return;
    const Array<float> deviation = sigma(frame);
    for (std::size_t i = 0; i < deviation.size(); ++i) {
      deviation[i] = (bits[i] & flag::invalid) == 0 ? deviation[i] * per_length_[i] : std::nanf("");
    }
  }

 private:
  /// Rays of unit length, or with z = 1 for depths; and their length relative to the given length.
  void make_directions(const tofgraph_camera& camera, bool depth) {
    offset_ = depth && *assume != "lens_depth" ? static_cast<float>(camera.focal_length) : 0.0F;
    for (std::size_t i = 0; i < rows_ * columns_; ++i) {
      const float* ray = camera.rays + 3 * i;
      const double along_z = ray[2];
      for (std::size_t k = 0; k < 3; ++k) directions_.push_back(depth ? static_cast<float>(ray[k] / along_z) : ray[k]);
      per_length_.push_back(depth ? static_cast<float>(1 / along_z) : 1.0F);
      if (std::isnan(ray[2])) outside_.push_back(i);
    }
  }

  OtherLengths lengths_;
  std::size_t rows_ = 0, columns_ = 0;
  float offset_ = 0;
  std::vector<float> directions_, per_length_;
  std::vector<std::size_t> outside_;  // pixels outside the lens model
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::PointCloud, "Depth or range to points in the optical frame")
#endif
