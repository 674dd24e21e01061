// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Point clouds of PCL: text, binary, compressed.
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "plugins/formats/cloud_arrays.hpp"

namespace tofgraph {

struct Pcd final : CloudFormat {
  static constexpr const char* endings = "pcd";
  static bool recognises(std::span<const std::uint8_t> head) {
    const std::string text(head.begin(), head.end());
    return text.starts_with("# .PCD") || (text.starts_with("VERSION") && text.find("\nFIELDS ") != std::string::npos);
  }

  explicit Pcd(const std::string& path) {
    check_header(path);
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
    pcl::PCLPointCloud2 cloud;
    if (pcl::PCDReader().read(path, cloud) < 0) throw std::runtime_error("is damaged: PCL cannot read it");
    set_cloud(std::move(cloud), "PCL");
  }

 private:
  /// Sizes that the file cannot hold are refused before PCL makes room for them.
  static void check_header(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    const double file = static_cast<double>(std::filesystem::file_size(path));
    double step = 0, points = 0, width = 0, height = 1;
    std::vector<double> sizes, counts;
    std::string line, data;
    for (int lines = 0; lines < 64 && data.empty() && std::getline(in, line); ++lines) {
      std::istringstream words(line);
      std::string key;
      words >> key;
      const auto numbers = [&words] {
        std::vector<double> values;
        for (double value = 0; words >> value;) values.push_back(value);
        return values;
      };
      if (key == "SIZE") sizes = numbers();
      if (key == "COUNT") counts = numbers();
      if (key == "WIDTH") words >> width;
      if (key == "HEIGHT") words >> height;
      if (key == "POINTS") words >> points;
      if (key == "DATA") words >> data;
    }
    for (std::size_t i = 0; i < sizes.size(); ++i) step += sizes[i] * (i < counts.size() ? counts[i] : 1);
    if (data.empty() || sizes.empty() || (!counts.empty() && counts.size() != sizes.size()))
      throw std::runtime_error("has no whole PCD header: FIELDS, SIZE, TYPE, WIDTH, HEIGHT, POINTS, DATA");
    const double number = std::max(points, width * height);
    if (!(step > 0 && step < 65536 && number >= 0 && width >= 0 && height >= 0) ||
        (points > 0 && points != width * height))
      throw std::runtime_error("has a damaged header: WIDTH x HEIGHT, POINTS or SIZE do not fit each other");
    constexpr double best_compression = 300;  // of LZF
    const double most = data == "binary" ? file : data == "ascii" ? file * step : file * best_compression;
    if (number * step > most)
      throw std::runtime_error("announces " + std::to_string(static_cast<std::uint64_t>(number)) +
                               " points, more than its " + std::to_string(static_cast<std::uint64_t>(file)) +
                               " bytes can hold: it was cut off");
  }
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::Pcd, "Point clouds of PCL")
