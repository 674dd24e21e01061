// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Reorients images that were stored mirrored or rotated.
#include "plugins/without_gaps.hpp"

#include <tofgraph/stage.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <deque>
#include <string>
#include <vector>

namespace tofgraph {

/// Mirrors images, then rotates them clockwise. Lens, rays, light sources, points and normals are transformed too, so
/// that clouds show the same scene in the new axes; with `camera: kept` only the images change, for a recording whose
/// images are oriented differently from its profile. Points that were moved into the world's frame keep their
/// coordinates. Channels other than images of the camera's size are unchanged.
struct Orient final : Filter {
  InOut<void> every{this, "*", {.text = "images are mirrored and turned"}};
  Param<Choice> mirror{this,
                       "mirror",
                       {.default_value = "none",
                        .choices = "none left_right top_bottom",
                        .text = "sides that are exchanged, before the turn"}};
  Param<Choice> turn{this, "turn", {.default_value = "0", .choices = "0 90 180 270", .text = "degrees clockwise"}};
  Param<Choice> camera{this,
                       "camera",
                       {.default_value = "turned",
                        .choices = "turned kept",
                        .text = "turned: lens and sources follow; kept: the profile is right, the images are not"}};

  void prepare(Setup& setup) {
    const tofgraph_camera& before = setup.camera();
    width_ = before.width;
    height_ = before.height;
    set_matrix();
    if (x_ == Row{1, 0} && y_ == Row{0, 1})
      throw ConfigError("turn", "nothing is changed: give turn, mirror or both, e.g. turn: 180");
    if (swaps() && *camera == "kept" && width_ != height_)
      throw ConfigError(
          "camera",
          "a turn by " + *turn + " deg exchanges width and height, which does not fit the camera: use camera: turned");
    if (swaps() && *camera == "turned" && before.skew != 0)
      throw ConfigError("turn", "by 90 or 270 deg is impossible for a lens with a skew");
    for (const char* name : {"points", "normals"}) {
      const tofgraph_channel* channel = setup.find(name);
      if (channel != nullptr && is_moved(channel->applied)) in_camera_frame_ = false;
    }
    for (const tofgraph_channel& channel : setup.channels()) announce(setup, channel);
    if (images_.empty()) throw std::runtime_error("the input has no image of the camera's size");
    if (*camera == "turned") turn_camera(setup);
  }

  void process(Frame& frame) const {
    for (const Image& image : images_) {
      const tofgraph_view in = frame.find(image.made.name);
      if (in.data == nullptr) throw std::runtime_error(std::string("the frame has no '") + image.made.name + "'");
      refuse_gaps(in);
      thread_local std::vector<char> copy;  // input and output may share memory
      const std::size_t bytes = image.planes * width_ * height_ * image.pixel;
      copy.assign(static_cast<const char*>(in.data), static_cast<const char*>(in.data) + bytes);
      auto* out = static_cast<char*>(frame.write(image.made).data);
      for (std::size_t plane = 0; plane < image.planes; ++plane)
        move_pixels(copy.data() + plane * width_ * height_ * image.pixel, out + plane * width_ * height_ * image.pixel,
                    image.pixel);
      if (image.vectors && *camera == "turned") turn_vectors(reinterpret_cast<float*>(out), width_ * height_);
    }
  }

 private:
  using Row = std::array<int, 2>;
  /// Image channel: the output channel, number of images in it, bytes per pixel.
  struct Image {
    tofgraph_channel made;
    std::size_t planes, pixel;
    bool vectors;
  };

  /// Sets the new coordinates relative to the image's centre: (x', y') = (x_ . (x, y), y_ . (x, y)).
  void set_matrix() {
    if (*mirror == "left_right") x_ = {-1, 0};
    if (*mirror == "top_bottom") y_ = {0, -1};
    for (std::string left(*turn); left != "0"; left = left == "270" ? "180" : left == "180" ? "90" : "0") {
      const Row before = x_;  // clockwise, y down: (x, y) -> (-y, x)
      x_ = {-y_[0], -y_[1]};
      y_ = before;
    }
  }
  bool swaps() const { return x_[0] == 0; }
  std::array<double, 2> turned(double x, double y) const { return {x_[0] * x + x_[1] * y, y_[0] * x + y_[1] * y}; }
  void turn_in_place(double& x, double& y) const {
    const auto [new_x, new_y] = turned(x, y);
    x = new_x;
    y = new_y;
  }

  void announce(const Setup& setup, const tofgraph_channel& channel) {
    const std::string_view name = channel.name;
    if (name == "rays") return;  // rays of the camera
    std::uint32_t axis = 0;
    while (axis + 1 < channel.rank && (channel.extent[axis] != height_ || channel.extent[axis + 1] != width_)) ++axis;
    if (axis + 1 >= channel.rank) return;
    names_.emplace_back(channel.name);
    units_.emplace_back(channel.unit);
    const bool vectors = in_camera_frame_ && (name == "points" || name == "normals");
    Image image{channel, 1, element_size(channel.type), vectors};
    for (std::uint32_t i = 0; i < axis; ++i) image.planes *= channel.extent[i];
    for (std::uint32_t i = axis + 2; i < channel.rank; ++i) image.pixel *= channel.extent[i];
    if (swaps()) std::swap(image.made.extent[axis], image.made.extent[axis + 1]);
    const std::string applied = *channel.applied != 0 ? std::string(channel.applied) + " orient" : "orient";
    image.made.applied = applied.c_str();
    setup.provide(image.made);
    image.made.name = names_.back().c_str();
    image.made.unit = units_.back().c_str();
    image.made.of = image.made.applied = image.made.from = "";
    images_.push_back(image);
  }

  void move_pixels(const char* in, char* out, std::size_t pixel) const {
    const std::size_t new_width = swaps() ? height_ : width_;
    for (std::size_t v = 0; v < height_; ++v) {
      for (std::size_t u = 0; u < width_; ++u) {
        const std::size_t new_u = place(x_, u, v), new_v = place(y_, u, v);
        std::memcpy(out + (new_v * new_width + new_u) * pixel, in + (v * width_ + u) * pixel, pixel);
      }
    }
  }
  std::size_t place(const Row& row, std::size_t u, std::size_t v) const {
    const std::size_t at = row[0] != 0 ? u : v, last = (row[0] != 0 ? width_ : height_) - 1;
    return row[0] + row[1] > 0 ? at : last - at;
  }

  void turn_vectors(float* vectors, std::size_t count) const {
    for (std::size_t i = 0; i < count; ++i) {
      const auto [x, y] = turned(vectors[3 * i], vectors[3 * i + 1]);
      vectors[3 * i] = static_cast<float>(x);
      vectors[3 * i + 1] = static_cast<float>(y);
    }
  }

  void turn_camera(const Setup& setup) const {
    tofgraph_camera changed = setup.camera();
    std::vector<float> rays(width_ * height_ * 3);
    move_pixels(reinterpret_cast<const char*>(changed.rays), reinterpret_cast<char*>(rays.data()), 3 * sizeof(float));
    turn_vectors(rays.data(), width_ * height_);
    changed.rays = rays.data();
    double(&centre)[2] = changed.principal_point;
    centre[0] -= (static_cast<double>(width_) - 1) / 2;
    centre[1] -= (static_cast<double>(height_) - 1) / 2;
    turn_in_place(centre[0], centre[1]);
    if (swaps()) {
      std::swap(changed.width, changed.height);
      std::swap(changed.focal_px[0], changed.focal_px[1]);
      std::swap(changed.pitch[0], changed.pitch[1]);
    }
    centre[0] += (changed.width - 1) / 2.0;
    centre[1] += (changed.height - 1) / 2.0;
    if (changed.lens_model == TOFGRAPH_LENS_OPENCV) turn_distortion(changed);
    changed.skew *= x_[0] * y_[1];  // 0 for a rotation by 90 deg
    std::vector<tofgraph_light> lights;
    for (const tofgraph_light& light : lights_of(setup.camera())) lights.push_back(light);
    for (tofgraph_light& light : lights) turn_in_place(light.position[0], light.position[1]);
    changed.lights = lights.data();
    changed.light_size = sizeof(tofgraph_light);
    setup.set_camera(changed);
  }

  void turn_distortion(tofgraph_camera& changed) const {
    // The tangential part is r^2 t + 2 (t . p) p with t = (p2, p1), the prism s (s1, s3) + s^2 (s2, s4): vectors.
    turn_in_place(changed.distortion[3], changed.distortion[2]);
    double(&further)[7] = changed.further_distortion;
    turn_in_place(further[3], further[5]);
    turn_in_place(further[4], further[6]);
  }

  std::size_t width_ = 0, height_ = 0;
  bool in_camera_frame_ = true;  // the points and normals
  Row x_{1, 0}, y_{0, 1};
  std::deque<std::string> names_, units_;
  std::vector<Image> images_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Orient, "Mirrors and turns images together with the lens and the light sources")
