// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/io/ply_io.h>

#include "plugins/sinks/cloud_file.hpp"

namespace tofgraph {

/// Writes a PLY file a frame through PCL, and what was done to the frames beside them.
struct PlyWriter final : CloudFile {
  Param<Choice> encoding{this, "encoding", {.fallback = "binary", .choices = "ascii binary", .text = "of the points"}};

  void process(Frame& frame) const {
    store(frame, [this](const pcl::PCLPointCloud2& cloud, const std::string& file) {
      constexpr int digits = 9;
      pcl::PLYWriter writer;
      const Eigen::Vector4f origin = Eigen::Vector4f::Zero();
      const Eigen::Quaternionf orientation = Eigen::Quaternionf::Identity();
      const int status = *encoding == "ascii" ? writer.writeASCII(file, cloud, origin, orientation, digits, true)
                                              : writer.writeBinary(file, cloud, origin, orientation, true);
      if (status != 0) throw std::runtime_error("PCL could not write " + file);
    });
  }
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::PlyWriter, "Point clouds as PLY files: x y z intensity, optional sigma and flags")
