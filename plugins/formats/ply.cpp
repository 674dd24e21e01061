// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Point clouds in the Stanford format: text and binary, either byte order.
#include <pcl/console/print.h>
#include <pcl/io/ply_io.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "plugins/formats/cloud_arrays.hpp"

namespace tofgraph {

struct Ply final : CloudFormat {
  static constexpr const char* endings = "ply";
  static bool recognises(std::span<const std::uint8_t> head) {
    const std::string text(head.begin(), head.end());
    return text.starts_with("ply\n") || text.starts_with("ply\r\n");
  }

  explicit Ply(const std::string& path) {
    check_header(path);
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
    pcl::PCLPointCloud2 cloud;
    Eigen::Vector4f origin;
    Eigen::Quaternionf orientation;
    int version = 0;
    if (pcl::PLYReader().read(path, cloud, origin, orientation, version) < 0)
      throw std::runtime_error("is damaged: PCL cannot read it");
    set_cloud(std::move(cloud), "PLY");
  }

 private:
  /// Every element takes a byte at least.
  static void check_header(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    const auto file = static_cast<double>(std::filesystem::file_size(path));
    std::string line;
    bool vertices = false, ended = false;
    for (int lines = 0; lines < 1000 && !ended && std::getline(in, line); ++lines) {
      std::istringstream words(line);
      std::string key, name;
      double count = 0;
      words >> key;
      ended = key == "end_header";
      if (key == "format" && words >> name && name != "ascii" && name != "binary_little_endian" &&
          name != "binary_big_endian")
        throw std::runtime_error("has the format '" + name +
                                 "', expected ascii, binary_little_endian or binary_big_endian");
      if (key != "element") continue;
      if (!(words >> name >> count) || !(count >= 0 && count <= file))
        throw std::runtime_error("announces more elements '" + name + "' than its bytes can hold: it was cut off");
      vertices = vertices || name == "vertex";
    }
    if (!ended || !vertices) throw std::runtime_error("has no whole PLY header with an element 'vertex'");
  }
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::Ply, "Point clouds in the Stanford format (PLY)")
