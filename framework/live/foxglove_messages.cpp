// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "live/foxglove_messages.hpp"

#include "config/base64.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

namespace tofgraph::live {
namespace {

using nlohmann::json;

json object_schema(const char* title, json properties) {
  return {{"title", title}, {"type", "object"}, {"properties", std::move(properties)}};
}
json time_schema() {
  return {{"type", "object"},
          {"title", "time"},
          {"properties", {{"sec", {{"type", "integer"}}}, {"nsec", {{"type", "integer"}}}}}};
}
json numbers_schema() { return {{"type", "array"}, {"items", {{"type", "number"}}}}; }
json data_schema() { return {{"type", "string"}, {"contentEncoding", "base64"}}; }
json xyz_schema(const char* title, bool w) {
  json properties = {{"x", {{"type", "number"}}}, {"y", {{"type", "number"}}}, {"z", {{"type", "number"}}}};
  if (w) properties["w"] = {{"type", "number"}};
  return object_schema(title, properties);
}

json time_json(std::uint64_t ns) { return {{"sec", ns / 1'000'000'000}, {"nsec", ns % 1'000'000'000}}; }

const Plane* plane_of(const NodePicture& picture, const std::string& name) {
  const auto found = std::ranges::find(picture.planes.value(), name, &Plane::name);
  return found != picture.planes->end() ? &*found : nullptr;
}

json cloud_message(const NodeInfo& node, const NodePicture& picture, std::uint64_t time) {
  const Plane* points = plane_of(picture, "points");
  if (points == nullptr) return nullptr;
  const Plane* amplitude = plane_of(picture, "amplitude");
  const std::size_t count = points->values.size() / 3;
  if (amplitude != nullptr && amplitude->values.size() != count) amplitude = nullptr;
  std::vector<float> packed;
  packed.reserve(count * 4);
  for (std::size_t i = 0; i < count; ++i) {
    const float* p = points->values.data() + 3 * i;
    if (!std::isfinite(p[0])) continue;
    packed.insert(packed.end(), {p[0], p[1], p[2], amplitude != nullptr ? amplitude->values[i] : 0});
  }
  json fields = json::array();
  for (const char* name : {"x", "y", "z", "intensity"})
    fields.push_back({{"name", name}, {"offset", 4 * fields.size()}, {"type", 7}});  // 7: float32
  return {{"timestamp", time_json(time)},
          {"frame_id", node.camera.empty() ? "camera" : node.camera},
          {"pose",
           {{"position", {{"x", 0}, {"y", 0}, {"z", 0}}}, {"orientation", {{"x", 0}, {"y", 0}, {"z", 0}, {"w", 1}}}}},
          {"point_stride", 16},
          {"fields", std::move(fields)},
          {"data", config::base64(packed.data(), packed.size() * sizeof(float))}};
}

json image_message(const NodeInfo& node, const Plane& plane, std::uint64_t time) {
  const bool flags = !plane.bits.empty();
  return {{"timestamp", time_json(time)},
          {"frame_id", node.camera.empty() ? "camera" : node.camera},
          {"width", plane.columns},
          {"height", plane.rows},
          {"encoding", flags ? "mono16" : "32FC1"},
          {"step", plane.columns * (flags ? 2 : 4)},
          {"data", flags ? config::base64(plane.bits.data(), plane.bits.size() * 2)
                         : config::base64(plane.values.data(), plane.values.size() * 4)}};
}

json calibration_message(const NodeInfo& node, std::uint64_t time) {
  const double fx = node.focal_px[0], fy = node.focal_px[1];
  const double cx = node.principal_point[0], cy = node.principal_point[1];
  return {{"timestamp", time_json(time)},
          {"frame_id", node.camera.empty() ? "camera" : node.camera},
          {"width", node.columns},
          {"height", node.rows},
          {"distortion_model", node.distortion_model},
          {"D", node.distortion},
          {"K", {fx, 0, cx, 0, fy, cy, 0, 0, 1}},
          {"R", {1, 0, 0, 0, 1, 0, 0, 0, 1}},
          {"P", {fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0}}};
}

}  // namespace

void set_lens(const tofgraph_camera& camera, NodeInfo& node) {
  const std::span<const double> further(camera.further_distortion);  // k4 k5 k6, then those of a thin prism
  const auto is_term = [](double k) { return k != 0; };
  const bool prism = std::ranges::any_of(further.subspan(3), is_term);
  if (camera.lens_model == TOFGRAPH_LENS_RAYS || camera.skew != 0 || prism) return;
  const bool fisheye = camera.lens_model == TOFGRAPH_LENS_FISHEYE;
  const bool rational = std::ranges::any_of(further.first(3), is_term);
  node.distortion_model = fisheye ? "kannala_brandt" : rational ? "rational_polynomial" : "plumb_bob";
  node.distortion.assign(camera.distortion, camera.distortion + (fisheye ? 4 : 5));
  if (rational) node.distortion.insert(node.distortion.end(), further.begin(), further.begin() + 3);
}

std::vector<FoxgloveTopic> foxglove_topics(const std::vector<NodeInfo>& nodes) {
  std::vector<FoxgloveTopic> topics;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::string prefix = "/" + nodes[i].name + "/";
    for (const ChannelInfo& channel : nodes[i].channels) {
      const FoxgloveKind kind = channel.name == "points" ? FoxgloveKind::point_cloud : FoxgloveKind::raw_image;
      topics.push_back({prefix + channel.name, kind, i, channel.name});
    }
    if (nodes[i].rays != nullptr && !nodes[i].distortion_model.empty())
      topics.push_back({prefix + "camera", FoxgloveKind::camera_calibration, i, ""});
  }
  return topics;
}

const char* foxglove_schema_name(FoxgloveKind kind) {
  return kind == FoxgloveKind::point_cloud ? "foxglove.PointCloud"
         : kind == FoxgloveKind::raw_image ? "foxglove.RawImage"
                                           : "foxglove.CameraCalibration";
}

std::string foxglove_schema(FoxgloveKind kind) {
  json properties = {{"timestamp", time_schema()}, {"frame_id", {{"type", "string"}}}};
  if (kind == FoxgloveKind::point_cloud) {
    properties["pose"] = object_schema("foxglove.Pose", {{"position", xyz_schema("foxglove.Vector3", false)},
                                                         {"orientation", xyz_schema("foxglove.Quaternion", true)}});
    properties["point_stride"] = {{"type", "integer"}, {"minimum", 0}};
    properties["fields"] = {
        {"type", "array"},
        {"items", object_schema("foxglove.PackedElementField", {{"name", {{"type", "string"}}},
                                                                {"offset", {{"type", "integer"}, {"minimum", 0}}},
                                                                {"type", {{"type", "integer"}}}})}};
    properties["data"] = data_schema();
  } else {
    properties["width"] = properties["height"] = {{"type", "integer"}, {"minimum", 0}};
  }
  if (kind == FoxgloveKind::raw_image) {
    properties["encoding"] = {{"type", "string"}};
    properties["step"] = {{"type", "integer"}, {"minimum", 0}};
    properties["data"] = data_schema();
  }
  if (kind == FoxgloveKind::camera_calibration) {
    properties["distortion_model"] = {{"type", "string"}};
    for (const char* matrix : {"D", "K", "R", "P"}) properties[matrix] = numbers_schema();
  }
  return object_schema(foxglove_schema_name(kind), properties).dump();
}

json foxglove_message(const FoxgloveTopic& topic, const NodeInfo& node, const NodePicture& picture,
                      std::uint64_t time_ns) {
  if (topic.kind == FoxgloveKind::camera_calibration) return calibration_message(node, time_ns);
  if (topic.kind == FoxgloveKind::point_cloud) return cloud_message(node, picture, time_ns);
  const Plane* plane = plane_of(picture, topic.channel);
  return plane != nullptr ? image_message(node, *plane, time_ns) : json();
}

}  // namespace tofgraph::live
