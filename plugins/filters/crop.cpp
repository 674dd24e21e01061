// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/lengths.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <limits>
#include <string>
#include <vector>

namespace tofgraph {

/// Crops the images, and the camera with them, to a region of columns and rows; marks pixels outside a range of lengths
/// or below an amplitude as invalid. Other channels than images of the frame's size are unchanged.
struct Crop final : Filter {
  InOut<void> every{this, "*", {.text = "images are cut to the region"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created if pixels are marked"}};
  Param<std::vector<double>> columns{
      this, "columns", {.min = 0, .text = "first and last, from 0, both kept; default: all"}};
  Param<std::vector<double>> rows{this, "rows", {.min = 0, .text = "first and last, from 0, both kept; default: all"}};
  Param<double> minimum{this, "minimum", {.unit = "m", .text = "shorter lengths are marked invalid"}};
  Param<double> maximum{this, "maximum", {.unit = "m", .text = "longer lengths are marked invalid"}};
  Param<double> minimum_amplitude{
      this, "minimum_amplitude", {.unit = "counts", .min = 0, .text = "pixels with less are marked invalid"}};
  Param<Choice> channel{this,
                        "channel",
                        {.default_value = "auto",
                         .choices = "auto depth range distance",
                         .text = "the length that minimum and maximum refer to; auto: the first of these that exists"}};

  void prepare(Setup& setup) {
    find_size(setup);
    columns_ = bounds("columns", *columns, width_);
    rows_ = bounds("rows", *rows, height_);
    if (minimum.given() && maximum.given() && *minimum >= *maximum)
      throw ConfigError("maximum", "must be greater than minimum");
    if (minimum.given() || maximum.given()) length_ = find_length(setup);
    if (minimum_amplitude.given() && setup.find("amplitude") == nullptr)
      throw ConfigError("minimum_amplitude", "what arrives has no amplitude");
    if (marks()) flags.provide(setup);
    lengths_.prepare(setup, {});
    for (const tofgraph_channel& c : setup.channels()) {
      if (std::string_view(c.name) != "rays") announce(setup, c);
    }
    if (flags.made_here()) {
      const tofgraph_channel made{.type = TOFGRAPH_TYPE_U16,
                                  .rank = 2,
                                  .name = "flags",
                                  .extent = {height_, width_},
                                  .unit = "",
                                  .of = "",
                                  .applied = "",
                                  .from = ""};
      setup.provide(made);  // of the images' size, which may differ from the camera's
      announce(setup, made);
    }
    const tofgraph_camera* camera = setup.stream().camera;
    if (cuts() && camera != nullptr && camera->height == height_ && camera->width == width_) cut_camera(setup);
  }

  void process(Frame& frame) const {
    if (marks()) mark(frame);
    for (const Cut& cut : cuts_) {
      const tofgraph_view in = frame.find(cut.made.name);
      if (in.data == nullptr) throw std::runtime_error(std::string("the frame has no '") + cut.made.name + "'");
      // If the frame is the only owner, input and output share memory: copying row by row in ascending order is safe.
      const tofgraph_view out = frame.write(cut.made);
      copy(in, out, cut.axis);
    }
  }

 private:
  struct Bounds {
    std::size_t first, count;
  };
  /// Image channel: index of the extent for its rows, and the output channel.
  struct Cut {
    std::uint32_t axis;
    tofgraph_channel made;
  };

  bool cuts() const { return columns_.count != width_ || rows_.count != height_; }
  bool marks() const { return minimum.given() || maximum.given() || minimum_amplitude.given(); }

  void find_size(const Setup& setup) {
    for (const tofgraph_channel& c : setup.channels()) {
      const ChannelInfo* known = known_channel(c.name);
      if (known == nullptr || c.rank < 2 || std::string_view(c.name) == "rays") continue;  // rays: the sensor's size
      const std::size_t row =
          std::string_view(known->shape) == "H W 3" || std::string_view(known->shape) == "H W" ? 0 : c.rank - 2;
      height_ = c.extent[row];
      width_ = c.extent[row + 1];
      return;
    }
    throw std::runtime_error("what arrives has no image to cut");
  }

  static Bounds bounds(const std::string& name, const std::vector<double>& given, std::size_t size) {
    if (given.empty()) return {0, size};
    if (size == 0)
      throw ConfigError(name, "what arrives changes in size, like a cloud: there is no fixed region to cut");
    const std::string all = "0 to " + std::to_string(size - 1);
    if (given.size() != 2)
      throw ConfigError(name, "needs two numbers, first and last, e.g. [10, " + std::to_string(size - 1) + "]");
    if (given[0] != std::floor(given[0]) || given[1] != std::floor(given[1]))
      throw ConfigError(name, "must be whole numbers");
    if (given[0] > given[1]) throw ConfigError(name, "the first is greater than the last");
    if (given[1] >= static_cast<double>(size)) throw ConfigError(name, "reach outside the image, which has " + all);
    return {static_cast<std::size_t>(given[0]), static_cast<std::size_t>(given[1] - given[0]) + 1};
  }

  std::string find_length(const Setup& setup) const {
    for (const char* name : {"depth", "range", "distance"}) {
      if ((*channel == "auto" || *channel == name) && setup.find(name) != nullptr) return name;
    }
    throw ConfigError("channel", "what arrives has no " + (*channel == "auto" ? std::string("depth, range or distance")
                                                                              : std::string(*channel)));
  }

  /// Announces the cropped image; other channels are unchanged.
  void announce(const Setup& setup, const tofgraph_channel& c) {
    std::uint32_t axis = 0;
    while (axis + 1 < c.rank && (c.extent[axis] != height_ || c.extent[axis + 1] != width_)) ++axis;
    if (!cuts() || axis + 1 >= c.rank) return;
    names_.emplace_back(c.name);
    units_.emplace_back(c.unit);
    Cut cut{axis, c};
    cut.made.extent[axis] = rows_.count;
    cut.made.extent[axis + 1] = columns_.count;
    const std::string applied = *c.applied != 0 ? std::string(c.applied) + " crop" : "crop";
    cut.made.applied = applied.c_str();
    setup.provide(cut.made);
    cut.made.name = names_.back().c_str();
    cut.made.unit = units_.back().c_str();
    cut.made.of = cut.made.applied = cut.made.from = "";
    cuts_.push_back(cut);
  }

  void cut_camera(const Setup& setup) const {
    tofgraph_camera camera = setup.camera();
    std::vector<float> rays;
    for (std::size_t row = 0; row < rows_.count; ++row) {
      const float* from = camera.rays + 3 * ((rows_.first + row) * camera.width + columns_.first);
      rays.insert(rays.end(), from, from + 3 * columns_.count);
    }
    camera.width = static_cast<std::uint32_t>(columns_.count);
    camera.height = static_cast<std::uint32_t>(rows_.count);
    camera.principal_point[0] -= static_cast<double>(columns_.first);
    camera.principal_point[1] -= static_cast<double>(rows_.first);
    camera.rays = rays.data();
    setup.set_camera(camera);
  }

  void copy(const tofgraph_view& in, const tofgraph_view& out, std::uint32_t axis) const {
    std::size_t before = 1;
    for (std::uint32_t i = 0; i < axis; ++i) before *= in.extent[i];
    const auto pixel = static_cast<std::size_t>(in.stride[axis + 1]);  // bytes
    const auto* from = static_cast<const char*>(in.data);
    auto* to = static_cast<char*>(out.data);
    for (std::size_t image = 0; image < before; ++image) {
      for (std::size_t row = 0; row < rows_.count; ++row, to += columns_.count * pixel) {
        std::memmove(to, from + ((image * height_ + rows_.first + row) * width_ + columns_.first) * pixel,
                     columns_.count * pixel);
      }
    }
  }

  void mark(Frame& frame) const {
    const tofgraph_view light = minimum_amplitude.given() ? frame.find("amplitude") : tofgraph_view{};
    const tofgraph_view length = length_.empty() ? tofgraph_view{} : frame.find(length_.c_str());
    const tofgraph_view& image = length.data != nullptr ? length : light;  // the size of a cloud varies
    const Array<std::uint16_t> bits = flags(frame, image.extent[0], image.extent[1]);
    if (bits.size() == 0) return;
    const auto* amplitude = static_cast<const float*>(light.data);
    const auto* lengths = static_cast<const float*>(length.data);
    const float low = minimum.given() ? static_cast<float>(*minimum) : -most,
                high = maximum.given() ? static_cast<float>(*maximum) : most;
    thread_local std::vector<float> marked;  // NaN where a pixel is out of range, else 0: keeps the loops branch-free
    marked.resize(bits.size());
    if (lengths != nullptr) {
      for (std::size_t i = 0; i < bits.size(); ++i) marked[i] = (lengths[i] < low) | (lengths[i] > high) ? nan : 0.0F;
    } else {
      std::ranges::fill(marked, 0.0F);
    }
    if (amplitude != nullptr) {
      const auto least = static_cast<float>(*minimum_amplitude);
      for (std::size_t i = 0; i < bits.size(); ++i) {
        const bool dark = !(amplitude[i] >= least);
        marked[i] = dark ? nan : marked[i];
        bits[i] = static_cast<std::uint16_t>(bits[i] | (dark ? flag::low_signal : 0));
      }
    }
    for (std::size_t i = 0; i < bits.size(); ++i) {
      bits[i] = static_cast<std::uint16_t>(bits[i] | (marked[i] != 0 ? flag::invalid : 0));
    }
    lengths_.invalidate(frame, bits);
  }

  static constexpr float nan = std::numeric_limits<float>::quiet_NaN(), most = std::numeric_limits<float>::infinity();
  std::size_t width_ = 0, height_ = 0;
  Bounds columns_{}, rows_{};
  std::string length_;
  OtherLengths lengths_;
  std::deque<std::string> names_, units_;
  std::vector<Cut> cuts_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Crop, "Cuts images to a region; marks lengths and amplitudes outside a range")
