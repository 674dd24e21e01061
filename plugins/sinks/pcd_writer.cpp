// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// One PCD file per frame, readable with PCL, and one provenance file beside them.
#include <fmt/ranges.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>

#include "plugins/sinks/cloud_file.hpp"

namespace tofgraph {

/// Header and compression are PCL's; the bytes are written here, because PCL's writer does not detect a full disk
/// (ascii) or takes twice as long (binary).
struct PcdWriter final : CloudFile {
  PcdWriter() : CloudFile("false") {}

  Param<Choice> encoding{
      this,
      "encoding",
      {.default_value = "binary", .choices = "ascii binary binary_compressed", .text = "encoding of the values"}};
  Param<std::vector<double>> viewpoint{
      this,
      "viewpoint",
      {.default_value = "[0, 0, 0, 1, 0, 0, 0]",
       .text = "pose of the camera in the frame of the points: x y z in metres, "
               "quaternion w x y z; default: the optical centre; required after transform"}};

  void prepare(Setup& setup) {
    prepare_files(setup, ".pcd");
    if (!viewpoint.given() && is_moved(setup.find("points")->applied)) {
      throw ConfigError("viewpoint",
                        "the points were moved by transform, so the camera is no longer at their origin: give its pose "
                        "T_world_camera, x y z in metres and quaternion w x y z, e.g. [0.5, 0, 1, 1, 0, 0, 0]");
    }
    if (viewpoint->size() != 7)
      throw ConfigError("viewpoint", "needs seven numbers: x y z in metres, quaternion w x y z");
    const auto v = [this](std::size_t i) { return static_cast<float>((*viewpoint)[i]); };
    origin_ = {v(0), v(1), v(2), 0};
    orientation_ = Eigen::Quaternionf(v(3), v(4), v(5), v(6));
    if (std::abs(orientation_.norm() - 1) > 1e-3F)
      throw ConfigError("viewpoint", "the quaternion w x y z must have length 1");
    pcl::console::setVerbosityLevel(pcl::console::L_ERROR);  // no warning about an empty cloud
  }

  void process(Frame& frame) const {
    store(frame, [this](const pcl::PCLPointCloud2& cloud, io::FileWriter& file) { write(cloud, file); });
  }

 private:
  void write(const pcl::PCLPointCloud2& cloud, io::FileWriter& file) const {
    pcl::PCDWriter pcd;
    if (*encoding == "ascii") {
      file.write(with_viewpoint(pcd.generateHeaderASCII(cloud, origin_, orientation_)) + "DATA ascii\n");
      file.write(ascii(cloud));
    } else if (*encoding == "binary" || cloud.data.empty()) {  // an empty cloud cannot be compressed
      file.write(with_viewpoint(pcd.generateHeaderBinary(cloud, origin_, orientation_)) + "DATA binary\n");
      file.write(std::as_bytes(std::span(cloud.data)));
    } else {
      std::ostringstream compressed;
      if (pcd.writeBinaryCompressed(compressed, cloud, origin_, orientation_) != 0)
        throw std::runtime_error("PCL could not compress the cloud");
      file.write(with_viewpoint(std::move(compressed).str()));
    }
  }

  /// Header, or a whole file, with all digits of the viewpoint: PCL writes only six.
  std::string with_viewpoint(std::string text) const {
    const std::size_t begin = text.find("\nVIEWPOINT ") + 1, end = text.find('\n', begin);
    return text.replace(begin, end - begin, fmt::format("VIEWPOINT {}", fmt::join(*viewpoint, " ")));
  }

  Eigen::Vector4f origin_;
  Eigen::Quaternionf orientation_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::PcdWriter, "Point clouds as PCD files, one per frame")
