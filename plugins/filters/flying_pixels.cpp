// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/geometry.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "plugins/filters/noise_estimate.hpp"

namespace tofgraph {

/// Marks pixels at depth edges that received light from both sides and report a length in between: along a row, a
/// column or a diagonal one neighbour is nearer and the opposite one farther, both by more than a limit. The limit is
/// the maximum of `threshold`, of `deviations` times the pixel's sigma (without sigma, times the noise of the frame
/// around it, from second differences along its rows), and of the step between pixels on a surface seen at the angle
/// `grazing` from its normal: length x angle between the pixels x tan(grazing). The angle between pixels comes from the
/// rays; without a camera this limit is not used. Lengths are changed only if `invalidate` is true.
struct FlyingPixels final : Filter {
  InOut<float> image{this, "depth|range|distance", {.text = "in which edges are looked for"}};
  InOut<float> sigma{this, "sigma", {.optional = true, .text = "invalidated with the pixel"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created, or combined with the incoming flags"}};
  Param<double> threshold{
      this,
      "threshold",
      {.unit = "m", .default_value = "20 mm", .min = 0, .max = 1e3, .text = "least step to each side", .live = true}};
  Param<double> deviations{
      this,
      "deviations",
      {.default_value = "5",
       .min = 0,
       .max = 1e3,
       .text = "minimum step to each side in units of the pixel's sigma; without sigma, of the frame's "
               "own noise around the pixel",
       .live = true}};
  Param<double> grazing{this,
                        "grazing",
                        {.unit = "rad",
                         .default_value = "80 deg",
                         .min = 0,
                         .max = 1.56,
                         .text = "surfaces seen at a less grazing angle than this are never marked; 0 deg: no limit"}};
  Param<bool> invalidate{
      this,
      "invalidate",
      {.default_value = "false", .text = "marked pixels become invalid, in all lengths", .live = true}};
  Param<Choice> channel{this,
                        "channel",
                        {.default_value = "auto",
                         .choices = "auto depth range distance",
                         .text = "in which edges are searched; auto: the first of these that exists"}};

  void prepare(Setup& setup) {
    const tofgraph_channel& what = *setup.find(image.channel());
    rows_ = what.extent[0];
    columns_ = what.extent[1];
    check_sigma(setup, sigma.present(), image.channel());
    flags.provide(setup);
    others_.prepare(setup, {image.channel(), "sigma"});
    steps_.assign(4 * rows_ * columns_, 0);
    const tofgraph_camera* camera = setup.stream().camera;
    if (camera == nullptr || camera->width != columns_ || camera->height != rows_) return;
    for (std::size_t r = 1; r + 1 < rows_; ++r) {
      for (std::size_t c = 1; c + 1 < columns_; ++c) {
        for (std::size_t line = 0; line < 4; ++line) steps_[4 * (r * columns_ + c) + line] = step(*camera, r, c, line);
      }
    }
  }

  void process(Frame& frame) const {
    const Array<float> lengths = image(frame), noise = sigma(frame);
    const Array<std::uint16_t> bits = flags(frame, rows_, columns_);
    mark_invalid(lengths, noise, bits);
    const bool own = !sigma.present() && *deviations > 0;
    thread_local std::vector<float> differences;
    thread_local TileNoise tiles;
    if (own) {
      second_differences(lengths.data(), rows_, columns_, differences);
      tiles.estimate(differences, rows_, columns_);
    }
    std::vector<std::size_t> marked;
    for (std::size_t r = 1; r + 1 < rows_; ++r) {
      for (std::size_t c = 1; c + 1 < columns_; ++c) {
        const std::size_t i = r * columns_ + c;
        const float known = own ? tiles.at(r, c) : noise && noise[i] > 0 ? noise[i] : 0;
        const float least = std::max(static_cast<float>(*threshold), static_cast<float>(*deviations) * known);
        bool flying = false;
        for (std::size_t line = 0; line < 4; ++line) flying |= is_between(lengths, i, line, least);
        if (flying) marked.push_back(i);
      }
    }
    for (const std::size_t i : marked) mark(i, lengths, noise, bits);
    others_.invalidate(frame, bits);
  }

 private:
  /// Index offset of a pixel's neighbour along a row, a column or a diagonal; the opposite one has the negative offset.
  std::size_t neighbour(std::size_t line) const {
    const std::size_t steps[] = {1, columns_, columns_ + 1, columns_ - 1};
    return steps[line];
  }

  /// Step between neighbouring pixels on a surface at the maximum angle, relative to the length.
  float step(const tofgraph_camera& camera, std::size_t r, std::size_t c, std::size_t line) const {
    const std::size_t i = r * columns_ + c;
    const physics::Vector3 one = physics::unit_ray(camera.rays + 3 * (i - neighbour(line))),
                           other = physics::unit_ray(camera.rays + 3 * (i + neighbour(line)));
    const double x = one.x - other.x, y = one.y - other.y, z = one.z - other.z;
    const double angle = std::sqrt(x * x + y * y + z * z) / 2;
    return std::isnan(angle) ? 0 : static_cast<float>(angle * std::tan(*grazing));
  }

  bool is_between(const Array<float>& lengths, std::size_t i, std::size_t line, float least) const {
    const float before = lengths[i - neighbour(line)], here = lengths[i], after = lengths[i + neighbour(line)];
    const float limit = std::max(least, here * steps_[4 * i + line]);
    const float rise = here - before, further = after - here;  // NaN: compares as false
    return (rise > limit && further > limit) || (-rise > limit && -further > limit);
  }

  void mark(std::size_t i, const Array<float>& lengths, const Array<float>& noise,
            const Array<std::uint16_t>& bits) const {
    bits[i] = static_cast<std::uint16_t>(bits[i] | flag::mixed | (*invalidate ? flag::invalid : 0));
    if (!*invalidate) return;
    lengths[i] = std::numeric_limits<float>::quiet_NaN();
    if (noise) noise[i] = lengths[i];
  }

  std::size_t rows_ = 0, columns_ = 0;
  OtherLengths others_;
  std::vector<float> steps_;  // per pixel, along the four lines
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::FlyingPixels, "Marks mixed pixels: lengths between the two sides of a depth edge")
