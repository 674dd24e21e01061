// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Conversion of a frame's points to a PCL cloud. The only public header that includes PCL.
#pragma once

#include <tofgraph/frame.hpp>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>

namespace tofgraph {

/// Returns the channel `points` with the amplitude as intensity (0 if missing): organised like the image, NaN at
/// invalid pixels, is_dense according to the content. @throws std::runtime_error if the frame has no points
inline pcl::PointCloud<pcl::PointXYZI>::Ptr to_pcl(const Frame& frame) {
  const tofgraph_view found = frame.find("points");
  if (found.data == nullptr) throw std::runtime_error("the frame has no points: add a point_cloud node");
  const Array<const float> points(found);
  const tofgraph_view light = frame.find("amplitude");
  const Array<const float> amplitude = light.data != nullptr ? Array<const float>(light) : Array<const float>();
  const auto rows = static_cast<std::uint32_t>(points.rows()), columns = static_cast<std::uint32_t>(points.columns());
  pcl::PointCloud<pcl::PointXYZI>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZI>(columns, rows));
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    pcl::PointXYZI& point = (*cloud)[i];
    point.x = points[3 * i];
    point.y = points[3 * i + 1];
    point.z = points[3 * i + 2];
    point.intensity = amplitude ? amplitude[i] : 0.0F;
    if (!std::isfinite(point.x) || !std::isfinite(point.y) || !std::isfinite(point.z)) cloud->is_dense = false;
  }
  cloud->header.stamp = static_cast<std::uint64_t>(frame.metadata().timestamp_ns / 1000);  // PCL uses microseconds
  cloud->header.seq = static_cast<std::uint32_t>(frame.metadata().number);
  return cloud;
}

}  // namespace tofgraph
