// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// One PLY file per frame, and one provenance file beside them.
#include "plugins/sinks/cloud_file.hpp"

namespace tofgraph {

/// Writes vertices with x y z, intensity, and on request sigma and flags. PLY has no organised clouds and no convention
/// for invalid points: only valid ones are written unless dense is false, which writes the invalid ones as NaN.
struct PlyWriter final : CloudFile {
  PlyWriter() : CloudFile("true") {}

  Param<Choice> encoding{
      this, "encoding", {.default_value = "binary", .choices = "ascii binary", .text = "of the values"}};

  void prepare(Setup& setup) { prepare_files(setup, ".ply"); }

  void process(Frame& frame) const {
    store(frame, [this](const pcl::PCLPointCloud2& cloud, io::FileWriter& file) {
      file.write(header(cloud));
      if (*encoding == "ascii")
        file.write(ascii(cloud));
      else
        file.write(std::as_bytes(std::span(cloud.data)));
    });
  }

 private:
  std::string header(const pcl::PCLPointCloud2& cloud) const {
    std::string text = fmt::format("ply\nformat {} 1.0\nelement vertex {}\n",
                                   *encoding == "ascii" ? "ascii" : "binary_little_endian", cloud.width * cloud.height);
    for (const pcl::PCLPointField& field : cloud.fields) {
      text += fmt::format("property {} {}\n", field.datatype == pcl::PCLPointField::FLOAT32 ? "float" : "ushort",
                          field.name);
    }
    return text + "end_header\n";
  }
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::PlyWriter, "Point clouds as PLY files, one per frame")
