// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/lengths.hpp>

#include <pcl/features/normal_3d.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace tofgraph {

/// Unit normal and curvature of the surface at each point: least-squares plane through its neighbours
/// (pcl::computePointNormal), which FLANN's k-d tree finds. The normal points to the viewpoint. The curvature is the
/// smallest eigenvalue of the neighbours' covariance divided by the sum of all three; 0 on a plane. NaN at invalid
/// points and if there are fewer than three neighbours within the radius.
struct Normals final : Filter {
  In<float> points{this, "points"};
  Out<float> normals{
      this, "normals", {.shape = "H W 3", .unit = "", .text = "unit vectors in the frame of the points"}};
  Out<float> curvature{this, "curvature", {.shape = "H W", .unit = "", .text = "0 on a plane, at most 1/3"}};
  Param<std::int64_t> neighbours{
      this,
      "neighbours",
      {.default_value = "20", .min = 3, .max = 10000, .text = "number of nearest points, the point itself included"}};
  Param<double> radius{
      this, "radius", {.unit = "m", .min = 1e-6, .max = 1e3, .text = "all points within it, in place of neighbours"}};
  Param<std::vector<double>> viewpoint{
      this,
      "viewpoint",
      {.unit = "m", .default_value = "[0 m, 0 m, 0 m]", .text = "of the camera in the frame of the points"}};

  void prepare(const Setup& setup) {
    if (radius.given() && neighbours.given()) throw ConfigError("radius", "give either neighbours or radius");
    if (viewpoint->size() != 3)
      throw ConfigError("viewpoint", "has " + std::to_string(viewpoint->size()) + " numbers, expected three");
    rule_.emplace(setup.find("points")->applied);
  }

  void process(Frame& frame) const {
    const Array<const float> all = points(frame);
    const Array<float> directions = normals(frame, all.rows(), all.columns(), 3),
                       curved = curvature(frame, all.rows(), all.columns());
    std::fill(directions.begin(), directions.end(), std::numeric_limits<float>::quiet_NaN());
    std::fill(curved.begin(), curved.end(), std::numeric_limits<float>::quiet_NaN());
    pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
    std::vector<std::size_t> pixels;
    for (std::size_t i = 0; i < curved.size(); ++i) {
      const float* at = &all[3 * i];
      if (!rule_->is_valid(at)) continue;
      cloud->emplace_back(at[0], at[1], at[2]);
      pixels.push_back(i);
    }
    if (cloud->empty()) return;
    pcl::KdTreeFLANN<pcl::PointXYZ> tree(false);  // neighbours unsorted
    tree.setInputCloud(cloud);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pixels.size(), 256),
                      [&](const tbb::blocked_range<std::size_t>& some) {
                        for (std::size_t k = some.begin(); k < some.end(); ++k)
                          at_point(*cloud, tree, k, &directions[3 * pixels[k]], curved[pixels[k]]);
                      });
  }

 private:
  void at_point(const pcl::PointCloud<pcl::PointXYZ>& cloud, const pcl::KdTreeFLANN<pcl::PointXYZ>& tree, std::size_t k,
                float* normal, float& curved) const {
    thread_local pcl::Indices near;
    thread_local std::vector<float> squares;
    const pcl::PointXYZ& point = cloud[k];
    if (radius.given())
      tree.radiusSearch(point, *radius, near, squares);
    else
      tree.nearestKSearch(point, static_cast<unsigned>(*neighbours), near, squares);
    Eigen::Vector4f plane;
    if (near.size() < 3 || !pcl::computePointNormal(cloud, near, plane, curved)) return;
    const auto v = [this](std::size_t i) { return static_cast<float>((*viewpoint)[i]); };
    pcl::flipNormalTowardsViewpoint(point, v(0), v(1), v(2), plane);
    for (Eigen::Index i = 0; i < 3; ++i) normal[i] = plane[i];
  }

  std::optional<PointRule> rule_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Normals, "Normal and curvature of the surface at each point")
