// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/stage.hpp>

#include <pcl/filters/voxel_grid.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace tofgraph {

/// One point a voxel: the centroid of those in it (pcl::VoxelGrid), 1 x N, without invalid points. The channels of the
/// points go with them: lengths and counts as means, sigma as that of a mean of independent values, flags joined.
/// Channels that do not belong to the points are taken off.
struct VoxelGrid final : Filter {
  InOut<float> points{this, "points"};
  InOut<void> every{this, "*", {.text = "what belongs to the points"}};
  Param<double> size{
      this, "size", {.unit = "m", .default_value = "20 mm", .min = 1e-6, .max = 1000, .text = "edge of a voxel"}};
  Param<std::int64_t> least{
      this, "least", {.default_value = "1", .min = 1, .max = 1e6, .text = "voxels with fewer points are omitted"}};

  void prepare(Setup& setup) {
    const tofgraph_channel& cloud = *setup.find("points");
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
    pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
    std::vector<std::size_t> pixels;
    for (std::size_t i = 0; i < before.size() / 3; ++i) {
      const float* at = &before[3 * i];
      if (!std::isfinite(at[0]) || !std::isfinite(at[1]) || !std::isfinite(at[2])) continue;
      cloud->emplace_back(at[0], at[1], at[2]);
      pixels.push_back(i);
    }
    pcl::PointCloud<pcl::PointXYZ> centroids;
    const std::vector<std::vector<std::size_t>> groups =
        cloud->empty() ? std::vector<std::vector<std::size_t>>() : filter(cloud, pixels, centroids);
    for (const std::string& name : withdrawn_) frame.drop(name.c_str());
    for (const Image& image : images_) gather(frame, image, groups);
    const Array<float> after(frame.write(channel("points", "m", TOFGRAPH_TYPE_F32, 3, groups.size())));
    for (std::size_t i = 0; i < groups.size(); ++i) {
      after[3 * i] = centroids[i].x;
      after[3 * i + 1] = centroids[i].y;
      after[3 * i + 2] = centroids[i].z;
    }
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

  /// Fills the centroids. @returns for each of them the pixels that it stands for
  std::vector<std::vector<std::size_t>> filter(const pcl::PointCloud<pcl::PointXYZ>::Ptr& cloud,
                                               const std::vector<std::size_t>& pixels,
                                               pcl::PointCloud<pcl::PointXYZ>& centroids) const {
    pcl::VoxelGrid<pcl::PointXYZ> grid;
    const auto edge = static_cast<float>(*size);
    check_extent(*cloud);
    grid.setLeafSize(edge, edge, edge);
    grid.setMinimumPointsNumberPerVoxel(static_cast<unsigned>(*least));
    grid.setInputCloud(cloud);
    grid.filter(centroids);
    // PCL gives the centroids in the order of their voxels' indices: the same order gives the points of each.
    std::vector<std::pair<int, std::size_t>> order;
    for (std::size_t i = 0; i < cloud->size(); ++i) {
      const auto& point = (*cloud)[i];
      const Eigen::Vector3i cell = grid.getGridCoordinates(point.x, point.y, point.z) - grid.getMinBoxCoordinates();
      order.emplace_back(cell.dot(grid.getDivisionMultiplier()), pixels[i]);
    }
    std::ranges::sort(order);
    std::vector<std::vector<std::size_t>> groups;
    for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
      while (end < order.size() && order[end].first == order[begin].first) ++end;
      if (end - begin < static_cast<std::size_t>(*least)) continue;
      auto& group = groups.emplace_back();
      for (std::size_t i = begin; i < end; ++i) group.push_back(order[i].second);
    }
    if (groups.size() != centroids.size()) throw std::runtime_error("PCL's voxels and their points do not agree");
    return groups;
  }

  /// PCL counts voxels in an int and would hand the cloud back as it is.
  void check_extent(const pcl::PointCloud<pcl::PointXYZ>& cloud) const {
    Eigen::Array3f low = cloud.front().getArray3fMap(), high = low;
    for (const auto& point : cloud) {
      low = low.min(point.getArray3fMap());
      high = high.max(point.getArray3fMap());
    }
    const Eigen::Array3d cells = ((high - low).cast<double>() / *size).floor() + 1;
    const double limit = std::numeric_limits<int>::max();
    if (cells.prod() < limit) return;
    const double volume = ((high - low).cast<double>() + *size).prod();
    throw std::runtime_error("a voxel of " + std::to_string(*size * 1e3) + " mm is too small for a cloud of " +
                             std::to_string(high[0] - low[0]) + " x " + std::to_string(high[1] - low[1]) + " x " +
                             std::to_string(high[2] - low[2]) + " m: write size: at least " +
                             std::to_string(std::cbrt(volume / limit) * 1.01e3) + " mm");
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

  std::vector<Image> images_;
  std::vector<std::string> withdrawn_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::VoxelGrid, "One point per voxel: the centroid, with the means of its channels")
