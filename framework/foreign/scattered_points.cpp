// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "foreign/scattered_points.hpp"

#include "foreign/foreign_frames.hpp"

#include <tofgraph/channels.hpp>
#include <tofgraph/physics/lens.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tofgraph::foreign {

std::vector<std::size_t> pixels_of_points(const tofgraph_camera& camera, const std::vector<float>& points) {
  const physics::Lens lens(camera);
  const PointRule rule("");
  std::vector<std::size_t> pixels(points.size() / 3, no_pixel);
  std::vector<std::size_t> owner(std::size_t{camera.width} * camera.height, no_pixel);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const float* p = &points[3 * i];
    if (!rule.is_valid(p) || !(p[2] > 0)) continue;
    const physics::ImagePoint at{static_cast<double>(p[0] / p[2]), static_cast<double>(p[1] / p[2])};
    const auto pixel = physics::pixel_of(camera, lens, at);
    if (!pixel) continue;
    const double u = std::round(pixel->x), v = std::round(pixel->y);
    if (!(u >= 0 && v >= 0 && u < camera.width && v < camera.height)) continue;
    const std::size_t index = static_cast<std::size_t>(v) * camera.width + static_cast<std::size_t>(u);
    std::size_t& before = owner[index];
    if (before != no_pixel && points[3 * before + 2] <= p[2]) continue;
    if (before != no_pixel) pixels[before] = no_pixel;
    before = i;
    pixels[i] = index;
  }
  return pixels;
}

const ForeignFrames::Cloud& ForeignFrames::cloud(std::uint64_t frame) {
  if (cloud_.frame == frame) return cloud_;
  const auto channel =
      static_cast<std::size_t>(std::ranges::find(channels_, "points", &ForeignChannel::name) - channels_.begin());
  cloud_.points.resize(sources_[channel].elements);
  cloud_.flags.assign(cloud_.points.size() / 3, 0);
  convert(frame, channel, cloud_.points.data(), cloud_.flags.data());
  cloud_.pixels = pixels_of_points(camera(), cloud_.points);
  cloud_.frame = frame;
  return cloud_;
}

void ForeignFrames::read_scattered(std::uint64_t frame, std::size_t channel, void* out, std::uint16_t* flags) {
  const Cloud& all = cloud(frame);
  const std::size_t pixels = std::size_t{camera().width} * camera().height;
  auto* image = static_cast<float*>(out);
  constexpr float none = std::numeric_limits<float>::quiet_NaN();
  std::vector<std::uint16_t> of_points(all.pixels.size());
  if (channels_[channel].name == "points") {
    of_points = all.flags;
    place(all.pixels, all.points, 3, none, image, pixels);
    mark_invalid_points(image, flags, pixels, values_[channel].refused);
  } else if (channels_[channel].type == TOFGRAPH_TYPE_U16) {
    std::vector<std::uint16_t> values(sources_[channel].elements);
    convert(frame, channel, values.data(), of_points.data());
    place(all.pixels, values, 1, std::uint16_t{0}, static_cast<std::uint16_t*>(out), pixels);
  } else {
    std::vector<float> values(sources_[channel].elements);
    convert(frame, channel, values.data(), of_points.data());
    place(all.pixels, values, 1, none, image, pixels);
  }
  for (std::size_t p = 0; p < of_points.size() && flags != nullptr; ++p)
    if (all.pixels[p] != no_pixel) flags[all.pixels[p]] |= of_points[p];
}

void ForeignFrames::check_scattered() const {
  const auto points = std::ranges::find(channels_, "points", &ForeignChannel::name);
  const bool cloud =
      points != channels_.end() && sources_[static_cast<std::size_t>(points - channels_.begin())].scattered;
  for (const Source& source : sources_) {
    if (!source.scattered) continue;
    const std::string where = request_.files[0].string();
    if (!cloud)
      throw ForeignError(
          fmt::format("{}: '{}' belongs to unordered points: read these as well, e.g. --as "
                      "points,{}={}",
                      where, source.like.name, source.layout.channel, source.like.name));
    const Source& of = sources_[static_cast<std::size_t>(points - channels_.begin())];
    const std::string& channel = source.layout.channel;
    if (channel == "phases" || channel == "taps")
      throw ForeignError(fmt::format("{}: '{}' are images: unordered points have none", where, channel));
    if (channel != "points" && 3 * source.elements != of.elements)
      throw ForeignError(fmt::format("{}: '{}' has {} values, but there are {} points", where, source.like.name,
                                     source.elements, of.elements / 3));
  }
}

}  // namespace tofgraph::foreign
