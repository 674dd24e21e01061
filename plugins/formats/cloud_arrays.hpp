// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Clouds of PCL as arrays of a file format: the points, and each further field.
#pragma once

#include <tofgraph/format.hpp>

#include <pcl/PCLPointCloud2.h>

#include <cstring>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph {

/// One cloud. Organised clouds are images (row column), others lists of points (point).
class CloudFormat : public FileFormat {
 public:
  void read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) override {
    const std::uint64_t slice = arrays()[array].elements() / arrays()[array].extent[0];
    const std::size_t columns = cloud_.height > 1 ? cloud_.width : 1, begin = first * columns;
    const std::size_t points = count * columns, each = slice / columns;
    auto* to = static_cast<std::uint8_t*>(out);
    for (std::size_t p = begin; p < begin + points; ++p) {
      for (std::size_t k = 0; k < each; ++k) {
        const pcl::PCLPointField& field = cloud_.fields[of_array_[array] + k];
        const std::uint32_t bytes = arrays()[array].bytes;
        std::memcpy(to, &cloud_.data[p * cloud_.point_step + field.offset], bytes);
        to += bytes;
      }
    }
  }

 protected:
  /// Takes over a cloud and lists its fields. @throws std::runtime_error without points
  void set_cloud(pcl::PCLPointCloud2 cloud, const std::string& text) {
    cloud_ = std::move(cloud);
    if (cloud_.data.size() < std::size_t{cloud_.width} * cloud_.height * cloud_.point_step || cloud_.point_step == 0)
      throw std::runtime_error("ends before its points do: it was cut off");
    if (std::size_t{cloud_.width} * cloud_.height == 0) throw std::runtime_error("has no points");
    for (std::size_t i = 0; i < cloud_.fields.size(); ++i) {
      const pcl::PCLPointField& field = cloud_.fields[i];
      if (field.count != 1 || field.name == "_" || field.offset + bytes_of(field) > cloud_.point_step) continue;
      const bool xyz = field.name == "x" && i + 2 < cloud_.fields.size() && cloud_.fields[i + 1].name == "y" &&
                       cloud_.fields[i + 2].name == "z" && cloud_.fields[i + 1].datatype == field.datatype &&
                       cloud_.fields[i + 2].datatype == field.datatype &&
                       cloud_.fields[i + 2].offset + bytes_of(field) <= cloud_.point_step;
      add_field(field, xyz, text);
      of_array_.push_back(i);
      if (xyz) i += 2;
    }
    if (arrays().empty()) throw std::runtime_error("has no fields that can be read");
  }

 private:
  static std::uint32_t bytes_of(const pcl::PCLPointField& field) {
    switch (field.datatype) {
      case pcl::PCLPointField::INT8:
      case pcl::PCLPointField::UINT8:
        return 1;
      case pcl::PCLPointField::INT16:
      case pcl::PCLPointField::UINT16:
        return 2;
      case pcl::PCLPointField::FLOAT64:
        return 8;
      default:
        return 4;
    }
  }

  void add_field(const pcl::PCLPointField& field, bool xyz, const std::string& text) {
    FileArray array{.bytes = bytes_of(field), .name = xyz ? "points" : field.name, .text = text};
    if (field.datatype == pcl::PCLPointField::UINT8 || field.datatype == pcl::PCLPointField::UINT16 ||
        field.datatype == pcl::PCLPointField::UINT32)
      array.kind = TOFGRAPH_ELEMENT_UNSIGNED;
    else if (field.datatype < pcl::PCLPointField::FLOAT32)
      array.kind = TOFGRAPH_ELEMENT_SIGNED;
    const bool organised = cloud_.height > 1;
    if (organised)
      array.extent = {cloud_.height, cloud_.width};
    else
      array.extent = {cloud_.width};
    array.axes = organised ? "row column" : "point";
    if (xyz) {
      array.extent.push_back(3);
      array.axes += " coordinate";
    }
    add(std::move(array));
  }

  pcl::PCLPointCloud2 cloud_;
  std::vector<std::size_t> of_array_;  // first field of each array
};

}  // namespace tofgraph
