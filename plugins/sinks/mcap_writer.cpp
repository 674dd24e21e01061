// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Recordings for ROS 2 viewers: images, clouds and the camera, in MCAP.
#include <tofgraph/stage.hpp>

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>

#include "config/quantity.hpp"
#include "plugins/sinks/mcap_file.hpp"
#include "plugins/sinks/ros_definitions.hpp"

namespace tofgraph {

/// Image channels become sensor_msgs/Image (32FC1: lengths in metres, counts; flags mono16), points become PointCloud2
/// with the amplitude as intensity, the profile CameraInfo, unless its lens is a table of rays. The file appears under
/// its name when it is complete. Frames without a time stamp get consecutive times, 1 ns apart.
struct McapWriter final : Sink {
  In<void> every{this, "*", {.text = "images of one number per pixel, and points"}};
  Param<OutputFile> path{this, "path", {.required = true, .text = "the recording, e.g. out/drive.mcap"}};
  Param<std::string> topics{
      this,
      "topics",
      {.default_value = "/camera", .text = "prefix of the topics: this with /depth, /points, /camera_info, .."}};
  Param<std::string> frame_id{
      this, "frame_id", {.default_value = "camera_optical_frame", .text = "frame_id of the headers"}};
  Param<Choice> compression{
      this,
      "compression",
      {.default_value = "zstd", .choices = "none lz4 zstd", .text = "compression of the chunks, one per frame"}};

  void prepare(Setup& setup) {
    for (const tofgraph_channel& channel : setup.channels()) {
      const std::string name = channel.name;
      const bool image = channel.rank == 2 && (channel.type == TOFGRAPH_TYPE_F32 || channel.type == TOFGRAPH_TYPE_U16);
      if (image || name == "points")
        names_.push_back(name);
      else if (name != "rays")
        left_out_ += (left_out_.empty() ? "" : ", ") + name;
    }
    if (names_.empty())
      throw std::runtime_error("the input has neither an image of one number per pixel nor points: decode it before");
    if (!left_out_.empty()) warn(left_out_ + " cannot be written: a message holds one number per pixel");
    if (topics->empty() || topics->front() != '/' || topics->back() == '/')
      throw ConfigError("topics", "must begin with a / and not end with one, e.g. /camera");
    describe_camera(setup.stream().camera);
  }

  void process(Frame& frame) {
    if (!file_) open();
    const std::int64_t stamp = frame.metadata().timestamp_ns > 0 ? frame.metadata().timestamp_ns
                                                                 : static_cast<std::int64_t>(frame.metadata().number);
    const auto time = static_cast<std::uint64_t>(stamp);
    if (camera_ != nullptr) file_->add(camera_channel_, time, camera_info(stamp));
    for (std::size_t i = 0; i < names_.size(); ++i) {
      const tofgraph_view view = frame.find(names_[i].c_str());
      if (view.data == nullptr) throw std::runtime_error("the frame has no '" + names_[i] + "'");
      file_->add(channels_[i], time, names_[i] == "points" ? cloud(stamp, view, frame) : image(stamp, view));
    }
    file_->end_chunk();
  }

  void finish() {
    if (file_)
      file_->finish();
    else
      warn("the input had no frames: " + *path + " is not written");
  }

 private:
  /// Stores the camera if CameraInfo can hold its lens; warns of what viewers would compute wrongly.
  void describe_camera(const tofgraph_camera* camera) {
    if (camera == nullptr) return;
    if (camera->lens_model == TOFGRAPH_LENS_RAYS)
      return warn("no camera_info is written: it cannot hold a lens that is a table of rays");
    camera_ = camera;
    if (std::ranges::find(names_, "depth") != names_.end() && camera->focal_length > 0)
      warn(
          "depth counts from the sensor plane, in ROS from the lens centre: viewers that compute points from depth and "
          "camera_info place them " +
          config::format_quantity(camera->focal_length, "m") + " too far; the channel points is not affected");
  }

  void open() {
    file_ = std::make_unique<mcap::File>(std::string(*path), *compression == "none" ? "" : std::string(*compression));
    for (const std::string& name : names_) {
      const bool points = name == "points";
      channels_.push_back(file_->add_channel(*topics + "/" + name,
                                             points ? "sensor_msgs/msg/PointCloud2" : "sensor_msgs/msg/Image",
                                             points ? ros::cloud_definition : ros::image_definition));
    }
    if (camera_ != nullptr)
      camera_channel_ =
          file_->add_channel(*topics + "/camera_info", "sensor_msgs/msg/CameraInfo", ros::camera_info_definition);
  }

  mcap::Message image(std::int64_t stamp, const tofgraph_view& view) const {
    const auto height = static_cast<std::uint32_t>(view.extent[0]), width = static_cast<std::uint32_t>(view.extent[1]);
    const std::uint32_t bytes = view.type == TOFGRAPH_TYPE_F32 ? 4 : 2;
    mcap::Message message;
    message.header(stamp, *frame_id).number(height).number(width).text(bytes == 4 ? "32FC1" : "mono16");
    message.number(std::uint8_t{0}).number(width * bytes);
    return message.data(view.data, std::size_t{height} * width * bytes);
  }

  /// Fields x, y, z and, if the frame has an amplitude of the same size, intensity.
  mcap::Message cloud(std::int64_t stamp, const tofgraph_view& view, const Frame& frame) const {
    const auto height = static_cast<std::uint32_t>(view.extent[0]), width = static_cast<std::uint32_t>(view.extent[1]);
    tofgraph_view light = empty_view();
    if (std::ranges::find(names_, "amplitude") != names_.end()) light = frame.find("amplitude");
    const bool bright = light.data != nullptr && light.type == TOFGRAPH_TYPE_F32 && light.extent[0] == view.extent[0] &&
                        light.extent[1] == view.extent[1];
    const std::uint32_t fields = bright ? 4 : 3, step = 4 * fields;
    static constexpr const char* names[] = {"x", "y", "z", "intensity"};
    mcap::Message message;
    message.header(stamp, *frame_id).number(height).number(width).number(fields);
    for (std::uint32_t i = 0; i < fields; ++i)
      message.text(names[i]).number(4 * i).number(std::uint8_t{7}).number(std::uint32_t{1});
    message.number(std::uint8_t{0}).number(step).number(width * step);
    std::vector<float> values(std::size_t{height} * width * fields);
    const auto* points = static_cast<const float*>(view.data);
    for (std::size_t i = 0; i < std::size_t{height} * width; ++i) {
      std::copy_n(points + 3 * i, 3, &values[fields * i]);
      if (bright) values[fields * i + 3] = static_cast<const float*>(light.data)[i];
    }
    return message.data(values.data(), values.size() * sizeof(float)).number(std::uint8_t{0});
  }

  mcap::Message camera_info(std::int64_t stamp) const {
    const tofgraph_camera& c = *camera_;
    std::vector<double> d(std::begin(c.distortion), std::end(c.distortion));
    const bool rational = std::ranges::any_of(c.further_distortion, [](double k) { return k != 0; });
    const bool prism = std::any_of(c.further_distortion + 3, c.further_distortion + 7, [](double k) { return k != 0; });
    if (rational) d.insert(d.end(), c.further_distortion, c.further_distortion + (prism ? 7 : 3));
    const bool fisheye = c.lens_model == TOFGRAPH_LENS_FISHEYE;
    if (fisheye) d.resize(4);
    const double fx = c.focal_px[0], fy = c.focal_px[1], cx = c.principal_point[0], cy = c.principal_point[1];
    mcap::Message message;
    message.header(stamp, *frame_id).number(c.height).number(c.width);
    message.text(fisheye    ? "equidistant"
                 : rational ? "rational_polynomial"
                            : "plumb_bob")
        .number(static_cast<std::uint32_t>(d.size()))
        .numbers(d);
    message.numbers(std::array{fx, fx * c.skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0});
    message.numbers(std::array{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});
    message.numbers(std::array{fx, fx * c.skew, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0});
    for (int i = 0; i < 6; ++i) message.number(std::uint32_t{0});  // binning, region of interest: whole sensor
    return message.number(std::uint8_t{0});
  }

  const tofgraph_camera* camera_ = nullptr;
  std::vector<std::string> names_;
  std::string left_out_;
  std::vector<std::uint16_t> channels_;
  std::uint16_t camera_channel_ = 0;
  std::unique_ptr<mcap::File> file_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::McapWriter, "Recordings in MCAP for viewers of ROS 2: images, clouds, the camera")
