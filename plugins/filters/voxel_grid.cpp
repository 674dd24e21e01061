// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/lengths.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph {

/// Reduces a cloud to one point per voxel: the centroid of its points, 1 x N, without invalid points, sorted by z, then
/// y, then x of the voxels, which begin at multiples of their size. The channels of the points are reduced too: lengths
/// and counts as means, sigma as that of a mean of independent values, flags combined. Channels that do not belong to
/// the points are removed.
struct VoxelGrid final : Filter {
  InOut<float> points{this, "points"};
  InOut<void> every{this, "*", {.text = "what belongs to the points"}};
  Param<double> size{
      this,
      "size",
      {.unit = "m", .default_value = "20 mm", .min = 1e-6, .max = 1000, .text = "edge of a voxel", .live = true}};
  Param<std::int64_t> least{
      this,
      "least",
      {.default_value = "1", .min = 1, .max = 1e6, .text = "voxels with fewer points are omitted", .live = true}};

  void prepare(Setup& setup) {
    const tofgraph_channel& cloud = *setup.find("points");
    rule_.emplace(cloud.applied);
    for (const tofgraph_channel& c : setup.channels()) {
      const bool of_points = std::string_view(c.name) != "rays" && c.rank >= 2 && c.extent[0] == cloud.extent[0] &&
                             c.extent[1] == cloud.extent[1];
      const bool image = of_points && c.rank == 2 && (c.type == TOFGRAPH_TYPE_F32 || c.type == TOFGRAPH_TYPE_U16);
      if (image || &c == &cloud) {
        tofgraph_channel made = c;
        const std::string applied = *c.applied != 0 ? std::string(c.applied) + " voxel_grid" : "voxel_grid";
        made.applied = applied.c_str();
        made.extent[0] = 1;
        made.extent[1] = 0;
        setup.provide(made);
        if (image) images_.push_back({c.name, c.unit, c.type});
      } else {
        setup.withdraw(c.name);
        withdrawn_.emplace_back(c.name);
      }
    }
  }

  void process(Frame& frame) const {
    const Array<const float> before = points.read(frame);
    const std::vector<std::vector<std::size_t>> groups = groups_of(before);
    const std::vector<std::array<float, 3>> centroids = centroids_of(before, groups);
    for (const std::string& name : withdrawn_) frame.drop(name.c_str());
    for (const Image& image : images_) gather(frame, image, groups);
    const Array<float> after(frame.write(channel("points", "m", TOFGRAPH_TYPE_F32, 3, groups.size())));
    for (std::size_t i = 0; i < groups.size(); ++i) std::ranges::copy(centroids[i], &after[3 * i]);
  }

 private:
  struct Image {
    std::string name, unit;
    std::uint32_t type;
  };

  static tofgraph_channel channel(const char* name, const char* unit, std::uint32_t type, std::uint32_t rank,
                                  std::size_t count) {
    return {.type = type, .rank = rank, .name = name, .extent = {1, count, rank == 3 ? 3U : 0U}, .unit = unit};
  }

  /// Voxel index, slowest axis first, and a pixel in the voxel. Only voxels with points are stored, so that the extent
  /// of the cloud does not matter.
  struct Member {
    std::array<std::int64_t, 3> voxel;  // z, y, x
    std::size_t pixel;
    auto operator<=>(const Member&) const = default;  // NOLINT(*-use-nullptr): a zero that the compiler writes
  };

  /// Pixels of each voxel with enough points.
  std::vector<std::vector<std::size_t>> groups_of(const Array<const float>& all) const {
    std::vector<Member> members;
    const auto place = [this](float at) { return static_cast<std::int64_t>(std::floor(double{at} / *size)); };
    for (std::size_t i = 0; i < all.size() / 3; ++i) {
      const float* at = &all[3 * i];
      if (rule_->is_valid(at)) members.push_back({{place(at[2]), place(at[1]), place(at[0])}, i});
    }
    std::ranges::sort(members);
    std::vector<std::vector<std::size_t>> groups;
    for (std::size_t begin = 0, end = 0; begin < members.size(); begin = end) {
      while (end < members.size() && members[end].voxel == members[begin].voxel) ++end;
      if (end - begin < static_cast<std::size_t>(*least)) continue;
      auto& group = groups.emplace_back();
      for (std::size_t i = begin; i < end; ++i) group.push_back(members[i].pixel);
    }
    return groups;
  }

  static std::vector<std::array<float, 3>> centroids_of(const Array<const float>& all,
                                                        const std::vector<std::vector<std::size_t>>& groups) {
    std::vector<std::array<float, 3>> centroids;
    for (const auto& group : groups) {
      std::array<double, 3> sum{};
      for (const std::size_t pixel : group)
        for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += all[3 * pixel + axis];
      std::array<float, 3>& centroid = centroids.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis)
        centroid[axis] = static_cast<float>(sum[axis] / static_cast<double>(group.size()));
    }
    return centroids;
  }

  static void gather(Frame& frame, const Image& image, const std::vector<std::vector<std::size_t>>& groups) {
    const tofgraph_view view = frame.find(image.name.c_str());
    if (image.type == TOFGRAPH_TYPE_U16) {
      const Array<const std::uint16_t> bits(view);
      std::vector<std::uint16_t> joined;
      for (const auto& group : groups) {
        std::uint16_t all = 0;
        for (const std::size_t i : group) all |= bits[i];
        joined.push_back(all);
      }
      store(frame, image, joined);
      return;
    }
    const Array<const float> values(view);
    const bool deviation = image.name == "sigma";
    std::vector<float> means;
    for (const auto& group : groups) {
      double sum = 0;
      for (const std::size_t i : group) sum += deviation ? static_cast<double>(values[i]) * values[i] : values[i];
      means.push_back(static_cast<float>((deviation ? std::sqrt(sum) : sum) / static_cast<double>(group.size())));
    }
    store(frame, image, means);
  }

  template <class T> static void store(Frame& frame, const Image& image, const std::vector<T>& values) {
    const Array<T> out(frame.write(channel(image.name.c_str(), image.unit.c_str(), image.type, 2, values.size())));
    std::ranges::copy(values, out.begin());
  }

  std::optional<PointRule> rule_;
  std::vector<Image> images_;
  std::vector<std::string> withdrawn_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::VoxelGrid, "One point per voxel: the centroid, with the means of its channels")
