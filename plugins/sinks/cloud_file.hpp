// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Common part of the cloud writers: fields, layout, one file per frame, provenance beside them.
#pragma once

#include <tofgraph/lengths.hpp>

#include <fmt/format.h>
#include <pcl/PCLPointCloud2.h>
#include <pcl/common/io.h>

#include <atomic>
#include <cstring>
#include <iterator>
#include <optional>
#include <sstream>

#include "io/output_file.hpp"

namespace tofgraph {

/// Fields: x y z (m, in the frame of the points), intensity, and on request sigma (m), flags, normals and curvature.
/// Organised clouds have the image's width and height, with NaN for invalid points; dense ones hold the valid points
/// only, row by row.
struct CloudFile : Sink {
  static constexpr const char* provenance_ending = ".provenance.json";
  In<float> points{this, "points"};
  In<float> sigma_image{this, "sigma", {.optional = true, .text = "for sigma: true"}};
  In<std::uint16_t> flags_image{this, "flags", {.optional = true, .text = "for flags: true"}};
  In<float> normals_image{
      this, "normals", {.shape = "H W 3", .unit = "", .optional = true, .text = "for normals: true"}};
  In<float> curvature_image{
      this, "curvature", {.shape = "H W", .unit = "", .optional = true, .text = "for normals: true"}};
  Param<FrameFiles> path{this,
                         "path",
                         {.required = true,
                          .choices = provenance_ending,
                          .text = "the files, e.g. out/cloud_{frame:06}.pcd; {frame} is the number. Next to "
                                  "them: out/cloud.provenance.json"}};
  Param<bool> dense;
  Param<std::string> intensity{
      this,
      "intensity",
      {.default_value = "amplitude",
       .text = "the channel for the field intensity, or none; default: amplitude if it exists"}};
  Param<bool> sigma{this, "sigma", {.default_value = "false", .text = "with the field sigma"}};
  Param<bool> flags{this, "flags", {.default_value = "false", .text = "with the field flags"}};
  Param<bool> normals{this,
                      "normals",
                      {.default_value = "false",
                       .text = "with the fields normal_x, normal_y, normal_z and curvature, see the filter normals"}};

  /// @param dense_default default of the parameter dense
  explicit CloudFile(const char* dense_default)
      : dense(this, "dense", {.default_value = dense_default, .text = "valid points only, without the image's rows"}) {}

  /// @param ending of the file names, e.g. ".pcd"
  void prepare_files(const Setup& setup, std::string_view ending) {
    static_cast<void>(provenance());  // starts the hashing in the background
    rule_.emplace(setup.find("points")->applied);
    check_ending(ending);
    choose_intensity(setup);
    if (*sigma && !sigma_image.present()) throw ConfigError("sigma", "what arrives has no sigma");
    if (*flags && !flags_image.present()) throw ConfigError("flags", "what arrives has no flags");
    if (*normals && !(normals_image.present() && curvature_image.present()))
      throw ConfigError("normals", "what arrives has no normals: add the stage normals before");
  }

  /// Writes the provenance at the end, when the hash of a long input is ready.
  void finish() const {
    if (written_ && *dense && !any_point_) throw std::runtime_error("every cloud is empty: no point is valid");
    if (written_) io::FileWriter(path.create(provenance_ending)).write(provenance() + "\n");
  }

 protected:
  /// Calls write(cloud, file) for the file of a frame, which appears under its name after the call.
  template <class Write> void store(const Frame& frame, Write&& write) const {
    thread_local pcl::PCLPointCloud2 cloud;
    fill(frame, cloud);
    if (!cloud.data.empty()) any_point_ = true;
    io::FileWriter file(path.create(frame));
    write(cloud, file);
    written_ = true;
  }

  /// Text with one line per point; nine digits reproduce each float exactly.
  static std::string ascii(const pcl::PCLPointCloud2& cloud) {
    std::string text;
    const auto end = std::back_inserter(text);
    for (std::size_t at = 0; at < cloud.data.size(); at += cloud.point_step) {
      for (const pcl::PCLPointField& field : cloud.fields) {
        const std::uint8_t* value = cloud.data.data() + at + field.offset;
        const char separator = &field == &cloud.fields.back() ? '\n' : ' ';
        if (field.datatype == pcl::PCLPointField::FLOAT32)
          fmt::format_to(end, "{:.9g}{}", read<float>(value), separator);
        else
          fmt::format_to(end, "{}{}", read<std::uint16_t>(value), separator);
      }
    }
    return text;
  }

  template <class T> static T read(const std::uint8_t* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
  }

 private:
  /// Values of each point, adjacent in memory, that become consecutive fields.
  struct Column {
    const char* names;  ///< blank-separated
    const void* data;
    std::size_t value_size, pixels;
    std::uint8_t type;
  };

  void check_ending(std::string_view ending) const {
    if (const std::filesystem::path file{std::string(*path)}; file.extension() != ending) {
      throw ConfigError("path", fmt::format("ends in '{}', expected {}, e.g. out/cloud_{{frame:06}}{}",
                                            file.extension().string(), ending, ending));
    }
  }

  void choose_intensity(const Setup& setup) {
    if (*intensity == "none") return;
    const tofgraph_channel* channel = setup.find(*intensity);
    if (channel == nullptr && intensity.given())
      throw ConfigError("intensity", fmt::format("what arrives has no '{}'", *intensity));
    if (channel == nullptr) return;
    if (channel->type != TOFGRAPH_TYPE_F32 || channel->rank != 2) {
      throw ConfigError("intensity", fmt::format("'{}' is {} with {} dimensions, expected float32 with 2", *intensity,
                                                 element_name(channel->type), channel->rank));
    }
    intensity_channel_ = *intensity;
  }

  template <class T> static Column column(const char* names, const Array<const T>& image) {
    constexpr std::uint8_t type = sizeof(T) == 4 ? pcl::PCLPointField::FLOAT32 : pcl::PCLPointField::UINT16;
    const std::size_t pixels = image.rows() * image.columns();
    return {names, image.data(), pixels != 0 ? image.size() / pixels * sizeof(T) : 0, pixels, type};
  }

  std::vector<Column> columns_of(const Frame& frame) const {
    std::vector<Column> columns{column("x y z", points(frame))};
    if (!intensity_channel_.empty())
      columns.push_back(column("intensity", Array<const float>(frame.find(intensity_channel_.c_str()))));
    if (*sigma) columns.push_back(column("sigma", sigma_image(frame)));
    if (*flags) columns.push_back(column("flags", flags_image(frame)));
    if (*normals) {
      columns.push_back(column("normal_x normal_y normal_z", normals_image(frame)));
      columns.push_back(column("curvature", curvature_image(frame)));
    }
    for (const Column& c : columns) {
      if (c.pixels != columns.front().pixels)
        throw std::runtime_error(
            fmt::format("{} has {} pixels, points has {}", c.names, c.pixels, columns.front().pixels));
    }
    return columns;
  }

  static void describe(const std::vector<Column>& columns, pcl::PCLPointCloud2& cloud) {
    cloud.fields.clear();
    cloud.point_step = 0;
    for (const Column& column : columns) {
      std::istringstream names(column.names);
      for (std::string name; names >> name;) {
        pcl::PCLPointField& field = cloud.fields.emplace_back();
        field.name = name;
        field.offset = cloud.point_step;
        field.datatype = column.type;
        field.count = 1;
        cloud.point_step += static_cast<std::uint32_t>(pcl::getFieldSize(column.type));
      }
    }
  }

  void fill(const Frame& frame, pcl::PCLPointCloud2& cloud) const {
    const Array<const float> xyz = points(frame);
    const std::vector<Column> columns = columns_of(frame);
    describe(columns, cloud);
    std::vector<std::uint32_t> valid;
    for (std::uint32_t i = 0; *dense && i < columns.front().pixels; ++i) {
      if (rule_->is_valid(&xyz[3 * i])) valid.push_back(i);
    }
    cloud.width = static_cast<std::uint32_t>(*dense ? valid.size() : xyz.columns());
    cloud.height = static_cast<std::uint32_t>(*dense ? 1 : xyz.rows());
    cloud.row_step = cloud.width * cloud.point_step;
    cloud.is_dense = *dense;
    cloud.data.resize(std::size_t{cloud.row_step} * cloud.height);
    std::uint8_t* to = cloud.data.data();
    for (const Column& column : columns) {
      if (column.value_size == 12)
        copy<12>(column, valid, to, cloud);
      else if (column.value_size == 4)
        copy<4>(column, valid, to, cloud);
      else
        copy<2>(column, valid, to, cloud);
      to += column.value_size;
    }
  }

  /// The size is a template argument, so that each copy takes one or two instructions.
  template <std::size_t size> void copy(const Column& column, const std::vector<std::uint32_t>& valid, std::uint8_t* to,
                                        const pcl::PCLPointCloud2& cloud) const {
    const auto* from = static_cast<const std::uint8_t*>(column.data);
    const std::size_t count = std::size_t{cloud.width} * cloud.height, step = cloud.point_step;
    for (std::size_t i = 0; i < count; ++i) std::memcpy(to + i * step, from + size * (*dense ? valid[i] : i), size);
  }

  std::optional<PointRule> rule_;
  std::string intensity_channel_;
  mutable std::atomic<bool> written_{false}, any_point_{false};
};

}  // namespace tofgraph
