// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file What the writers of clouds have in common: fields, layout, one file a frame, provenance beside them.
#pragma once

#include <tofgraph/stage.hpp>

#include <fmt/format.h>
#include <pcl/PCLPointCloud2.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "io/output_file.hpp"

namespace tofgraph {

/// A sink that turns points into pcl::PCLPointCloud2 and has it written under a name that appears only when whole.
struct CloudFile : Sink {
  In<float> points{this, "points"};
  In<void> every{this, "*", {.text = "amplitude, sigma and flags become fields"}};
  Param<OutputFile> path{this,
                         "path",
                         {.required = true,
                          .text = "one file a frame, e.g. out/cloud_{frame:06}; without {frame}, "
                                  "_{frame:06} is added before the extension"}};
  Param<std::string> intensity{
      this,
      "intensity",
      {.fallback = "auto",
       .text = "channel that becomes the field intensity; auto: amplitude where it is there; none"}};
  Param<bool> with_sigma{this, "sigma", {.fallback = "false", .text = "a field sigma, m"}};
  Param<bool> with_flags{
      this, "flags", {.fallback = "false", .text = "a field flags: why a point is not good, as bits"}};
  Param<bool> dense{
      this,
      "dense",
      {.fallback = "false", .text = "valid points only, as one row; otherwise organised as the image, with NaN"}};
  Param<bool> overwrite{this, "overwrite", {.fallback = "false", .text = "replace existing files"}};

  void prepare(Setup& setup) {
    pattern_ = io::OutputPattern(*path);
    if (!pattern_.numbered()) pattern_ = pattern_.with_number();
    const std::string problem = io::output_problem(pattern_, *overwrite || setup.overwrite());
    if (!problem.empty()) throw ConfigError("path", problem);
    add_field(setup, "x", 4, pcl::PCLPointField::FLOAT32, "");
    add_field(setup, "y", 4, pcl::PCLPointField::FLOAT32, "");
    add_field(setup, "z", 4, pcl::PCLPointField::FLOAT32, "");
    const bool none = *intensity == "none" || (*intensity == "auto" && setup.find("amplitude") == nullptr);
    if (!none)
      add_field(setup, "intensity", 4, pcl::PCLPointField::FLOAT32, *intensity == "auto" ? "amplitude" : *intensity);
    if (*with_sigma) add_field(setup, "sigma", 4, pcl::PCLPointField::FLOAT32, "sigma");
    if (*with_flags) add_field(setup, "flags", 2, pcl::PCLPointField::UINT16, "flags");
  }

  void finish() {
    if (wrote_) io::write_file(pattern_.companion(".provenance.json"), provenance() + "\n");
  }

 protected:
  /// Builds the cloud of a frame and gives it to write(cloud, file); the file is renamed when that returned.
  template <class Write> void store(const Frame& frame, Write&& write) const {
    const std::unique_ptr<pcl::PCLPointCloud2> cloud = take();
    fill(frame, *cloud);
    if (cloud->width == 0) {
      warn(fmt::format("frame {} has no valid point: no file is written for it", frame.metadata().number));
    } else {
      io::OutputFile file(pattern_.path(frame.metadata().number));
      write(*cloud, file.temporary_path().string());
      file.commit();
      const std::scoped_lock lock(mutex_);
      wrote_ = true;
    }
    const std::scoped_lock lock(mutex_);
    free_.push_back(std::make_unique<pcl::PCLPointCloud2>(std::move(*cloud)));
  }

 private:
  void add_field(const Setup& setup, const char* name, std::uint32_t bytes, std::uint8_t type,
                 const std::string& channel) {
    const tofgraph_channel& cloud = *setup.find("points");
    const tofgraph_channel* from = channel.empty() ? &cloud : setup.find(channel);
    const std::uint32_t wanted = type == pcl::PCLPointField::UINT16 ? TOFGRAPH_U16 : TOFGRAPH_F32;
    if (from == nullptr)
      throw ConfigError(name, fmt::format("what arrives has no '{}' for the field {}", channel, name));
    if (from->type != wanted || (!channel.empty() && (from->rank != 2 || from->extent[0] != cloud.extent[0] ||
                                                      from->extent[1] != cloud.extent[1]))) {
      throw ConfigError(name, fmt::format("'{}' is no {} image of the points' size", channel, element_name(wanted)));
    }
    pcl::PCLPointField field;
    field.name = name;
    field.offset = step_;
    field.datatype = type;
    field.count = 1;
    fields_.push_back(field);
    channels_.push_back(channel);
    step_ += bytes;
  }

  /// A cloud whose memory has been used before, so that the steady state allocates none.
  std::unique_ptr<pcl::PCLPointCloud2> take() const {
    const std::scoped_lock lock(mutex_);
    if (free_.empty()) return std::make_unique<pcl::PCLPointCloud2>();
    auto cloud = std::move(free_.back());
    free_.pop_back();
    return cloud;
  }

  void fill(const Frame& frame, pcl::PCLPointCloud2& cloud) const {
    const Array<const float> all = points(frame);
    const std::size_t count = all.size() / 3;
    cloud.fields = fields_;
    cloud.point_step = step_;
    cloud.is_bigendian = 0;
    cloud.data.resize(count * step_);
    std::vector<const std::byte*> sources;
    for (std::size_t k = 3; k < fields_.size(); ++k)
      sources.push_back(static_cast<const std::byte*>(frame.find(channels_[k].c_str()).data));
    std::size_t kept = 0, invalid = 0;
    std::uint8_t* out = cloud.data.data();
    for (std::size_t i = 0; i < count; ++i) {
      const bool valid = std::isfinite(all[3 * i]) && std::isfinite(all[3 * i + 1]) && std::isfinite(all[3 * i + 2]);
      invalid += valid ? 0 : 1;
      if (*dense && !valid) continue;
      std::memcpy(out, &all[3 * i], 12);
      for (std::size_t k = 3; k < fields_.size(); ++k) {
        const std::size_t bytes = fields_[k].datatype == pcl::PCLPointField::UINT16 ? 2 : 4;
        std::memcpy(out + fields_[k].offset, sources[k - 3] + i * bytes, bytes);
      }
      out += step_;
      ++kept;
    }
    cloud.data.resize(kept * step_);
    cloud.width = static_cast<std::uint32_t>(*dense ? kept : all.columns());
    cloud.height = *dense ? 1 : static_cast<std::uint32_t>(all.rows());
    cloud.row_step = cloud.width * step_;
    cloud.is_dense = *dense || invalid == 0 ? 1 : 0;
  }

  io::OutputPattern pattern_;
  std::vector<pcl::PCLPointField> fields_;
  std::vector<std::string> channels_;  // of each field; empty: a coordinate
  std::uint32_t step_ = 0;
  mutable std::mutex mutex_;  // the two below
  mutable std::vector<std::unique_ptr<pcl::PCLPointCloud2>> free_;
  mutable bool wrote_ = false;
};

}  // namespace tofgraph
