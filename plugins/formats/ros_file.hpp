// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Topics of a ROS recording as arrays: images, clouds, their time stamps, and a profile from CameraInfo.
#pragma once

#include <tofgraph/format.hpp>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>

#include "plugins/formats/ros_messages.hpp"

namespace tofgraph::ros {

/// Base class of formats, which call note() for each message, then add_topics(), and provide chunks for read().
class RosFile : public FileFormat {
 public:
  void read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) override {
    const Array& about = described_[array];
    const FileArray& shape = arrays()[array];
    const std::uint64_t slice = shape.elements() / shape.extent[0] * shape.bytes;
    auto* to = static_cast<std::uint8_t*>(out);
    for (std::uint64_t i = first; i < first + count; ++i, to += slice) {
      const Topic& topic = topics_.at(about.topic);
      if (about.part == Part::stamp) {
        std::memcpy(to, &topic.stamps[i], sizeof topic.stamps[i]);
        continue;
      }
      const Place& place = topic.places[i];
      const Bytes bytes = chunk(place.chunk).subspan(place.offset, place.size);
      if (about.part == Part::image)
        copy_image(read_image(bytes, topic.cdr), shape, about.topic, i, to);
      else
        copy_fields(read_cloud(bytes, topic.cdr), shape, about, i, to);
    }
  }

 protected:
  /// Position of a message in a chunk, which chunk() finds by its key.
  struct Place {
    std::uint64_t chunk = 0, offset = 0, size = 0;
  };

  /// Bytes of a chunk, valid until the next call.
  virtual Bytes chunk(std::uint64_t key) = 0;

  /// @param time recording time, ns, for messages without a time stamp
  void note(const std::string& name, const std::string& type, bool cdr, const Place& place, Bytes bytes,
            std::int64_t time) {
    Topic& topic = topics_[name];
    if (topic.type.empty()) {
      topic.type = short_type(type);
      topic.cdr = cdr;
    }
    Header header;
    try {
      if (topic.type == "Image") {
        const Image image = read_image(bytes, cdr);
        header = image.header;
        if (topic.places.empty()) topic.image = image;
      } else if (topic.type == "PointCloud2") {
        const Cloud cloud = read_cloud(bytes, cdr);
        header = cloud.header;
        if (topic.places.empty()) topic.cloud = cloud;
        topic.organised = topic.organised && cloud.height == topic.cloud.height && cloud.width == topic.cloud.width;
        topic.points = std::max(topic.points, std::uint64_t{cloud.height} * cloud.width);
      } else if (topic.type == "CameraInfo" && topic.places.empty()) {
        topic.info = read_camera_info(bytes, cdr);
      }
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("has a topic '" + name + "' that " + error.what());
    }
    topic.stamps.push_back(header.stamp != 0 ? header.stamp : time);
    topic.places.push_back(place);
  }

  /// Lists the arrays and creates the profile. @throws std::runtime_error if there are none, naming the topics present
  void add_topics() {
    std::string others;
    for (auto& [name, topic] : topics_) {
      others += "\n           " + name + "  " + topic.type + ", " + std::to_string(topic.places.size()) + " messages";
      if (topic.type == "Image") add_image(name, topic);
      if (topic.type == "PointCloud2") add_cloud(name, topic);
    }
    if (arrays().empty())
      throw std::runtime_error("has no topic with grey images or clouds" +
                               (others.empty() ? std::string("; it has no messages") : "; its topics:" + others));
    make_profile();
  }

 private:
  enum class Part { image, points, field, stamp };
  struct Topic {
    std::string type;
    bool cdr = false, organised = true;
    std::uint64_t points = 0;  // maximum number in a message
    std::vector<Place> places;
    std::vector<std::int64_t> stamps;
    Image image;  // first message, without its data
    Cloud cloud;
    CameraInfo info;
  };
  struct Array {
    std::string topic;
    Part part;
    std::vector<Field> fields = {};
  };

  /// Shortens "sensor_msgs/msg/Image" and "sensor_msgs/Image" to "Image"; other packages keep their names.
  static std::string short_type(const std::string& type) {
    for (const std::string_view package : {"sensor_msgs/msg/", "sensor_msgs/"})
      if (type.starts_with(package)) return type.substr(package.size());
    return type;
  }

  /// Kind and size of the elements; nothing for colours.
  static std::optional<std::pair<std::uint32_t, std::uint32_t>> element_of(const std::string& encoding) {
    static const std::map<std::string, std::pair<std::uint32_t, std::uint32_t>> known = {
        {"mono8", {TOFGRAPH_ELEMENT_UNSIGNED, 1}},  {"8UC1", {TOFGRAPH_ELEMENT_UNSIGNED, 1}},
        {"mono16", {TOFGRAPH_ELEMENT_UNSIGNED, 2}}, {"16UC1", {TOFGRAPH_ELEMENT_UNSIGNED, 2}},
        {"16SC1", {TOFGRAPH_ELEMENT_SIGNED, 2}},    {"32SC1", {TOFGRAPH_ELEMENT_SIGNED, 4}},
        {"32FC1", {TOFGRAPH_ELEMENT_FLOAT, 4}},     {"64FC1", {TOFGRAPH_ELEMENT_FLOAT, 8}}};
    const auto found = known.find(encoding);
    return found == known.end() ? std::nullopt : std::optional(found->second);
  }

  void add_array(FileArray array, Array about) {
    add(std::move(array));
    described_.push_back(std::move(about));
  }
  void add_stamps(const std::string& name, const Topic& topic) {
    add_array({.kind = TOFGRAPH_ELEMENT_SIGNED,
               .bytes = 8,
               .extent = {topic.stamps.size()},
               .name = name + ".stamp",
               .unit = "ns",
               .text = "time of the header"},
              {name, Part::stamp});
  }

  void add_image(const std::string& name, const Topic& topic) {
    const auto element = element_of(topic.image.encoding);
    if (!element || topic.image.height == 0 || topic.image.width == 0) return;
    FileArray array{.kind = element->first, .bytes = element->second};
    array.extent = {topic.places.size(), topic.image.height, topic.image.width};
    array.name = name;
    // REP 118: depth images are float32 in metres or uint16 in millimetres.
    array.unit = topic.image.encoding == "32FC1" ? "m" : topic.image.encoding == "16UC1" ? "mm" : "";
    array.text = "sensor_msgs/Image, " + topic.image.encoding;
    array.axes = "frame row column";
    add_array(std::move(array), {name, Part::image});
    add_stamps(name, topic);
  }

  void add_cloud(const std::string& name, const Topic& topic) {
    const std::vector<Field>& fields = topic.cloud.fields;
    const bool organised = topic.organised && topic.cloud.height > 1;
    if (topic.points == 0 || topic.points > std::uint64_t{1} << 28U) return;
    const auto shape_of = [&](const Field& field, bool xyz) {
      FileArray array{.bytes = field.bytes(), .text = "sensor_msgs/PointCloud2"};
      array.kind = field.type >= 7       ? TOFGRAPH_ELEMENT_FLOAT + 0U
                   : field.type % 2 == 0 ? TOFGRAPH_ELEMENT_UNSIGNED + 0U
                                         : TOFGRAPH_ELEMENT_SIGNED + 0U;
      array.extent = {topic.places.size()};
      if (organised)
        array.extent.insert(array.extent.end(), {topic.cloud.height, topic.cloud.width});
      else
        array.extent.push_back(topic.points);
      array.axes = organised ? "frame row column" : "frame point";
      if (xyz) {
        array.extent.push_back(3);
        array.axes += " coordinate";
        array.unit = "m";  // REP 103
      }
      return array;
    };
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (fields[i].count > 1 || fields[i].bytes() == 0) continue;
      const bool xyz = i + 2 < fields.size() && fields[i].name == "x" && fields[i + 1].name == "y" &&
                       fields[i + 2].name == "z" && fields[i + 1].type == fields[i].type &&
                       fields[i + 2].type == fields[i].type;
      FileArray array = shape_of(fields[i], xyz);
      array.name = xyz ? name : name + "." + fields[i].name;
      std::vector<Field> parts(fields.begin() + static_cast<std::ptrdiff_t>(i),
                               fields.begin() + static_cast<std::ptrdiff_t>(i + (xyz ? 3 : 1)));
      add_array(std::move(array), {name, xyz ? Part::points : Part::field, std::move(parts)});
      if (xyz) i += 2;
    }
    add_stamps(name, topic);
  }

  /// Creates the profile of the camera of the length images and clouds, if there is only one.
  void make_profile() {
    const CameraInfo* only = nullptr;
    std::string topic_of;
    for (const bool beside_lengths : {true, false}) {
      std::size_t different = 0;
      for (const auto& [name, topic] : topics_) {
        if (topic.type != "CameraInfo" || (beside_lengths && !has_lengths(name.substr(0, name.rfind('/') + 1))))
          continue;
        if (different == 0 || !(*only == topic.info)) ++different;
        only = &topic.info;
        topic_of = name;
      }
      if (different == 1) break;
      only = nullptr;
    }
    if (only == nullptr || only->k[0] <= 0 || only->binning_x > 1 || only->binning_y > 1 || only->roi) return;
    const bool fisheye = only->model == "equidistant" || only->model == "fisheye";
    if (!fisheye && only->model != "plumb_bob" && only->model != "rational_polynomial" && !only->d.empty()) return;
    std::string d;
    const auto exact = [](double value) {
      char text[40];
      std::snprintf(text, sizeof text, "%.17g", value);
      return std::string(text);
    };
    for (std::size_t i = 0; i < std::min<std::size_t>(only->d.size(), fisheye ? 4 : 12); ++i)
      d += (i == 0 ? "" : ", ") + exact(only->d[i]);
    std::string name;
    for (const char c : only->header.frame) name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
    set_profile("profile: 1\nname: " + (name.empty() ? std::string("ros_camera") : name) +
                "\nwidth: " + std::to_string(only->width) + "\nheight: " + std::to_string(only->height) +
                "\nfocal_length: [" + exact(only->k[0]) + " px, " + exact(only->k[4]) + " px]\nprincipal_point: [" +
                exact(only->k[2]) + ", " + exact(only->k[5]) + "]\n" +
                (only->k[1] != 0 ? "skew: " + exact(only->k[1] / only->k[0]) + "\n" : "") +
                (fisheye ? "lens: fisheye\n" : "") + (d.empty() ? "" : "distortion: [" + d + "]\n") +
                "source: \"CameraInfo of " + topic_of + "\"\n");
  }
  bool has_lengths(const std::string& folder) const {
    return std::ranges::any_of(topics_, [&](const auto& entry) {
      const Topic& topic = entry.second;
      return entry.first.starts_with(folder) &&
             (topic.type == "PointCloud2" ||
              (topic.type == "Image" && (topic.image.encoding == "16UC1" || topic.image.encoding == "32FC1")));
    });
  }

  [[noreturn]] static void refuse(const std::string& topic, std::uint64_t message, const std::string& what) {
    throw std::runtime_error("has the topic '" + topic + "', whose message " + std::to_string(message) + " " + what);
  }

  /// Elements in the byte order of this machine.
  static void put(std::uint8_t* to, const std::uint8_t* from, std::uint32_t bytes, bool big_endian) {
    if (big_endian == (std::endian::native == std::endian::big))
      std::memcpy(to, from, bytes);
    else
      std::reverse_copy(from, from + bytes, to);
  }

  static void copy_image(const Image& image, const FileArray& shape, const std::string& topic, std::uint64_t message,
                         std::uint8_t* to) {
    const std::uint64_t row_bytes = shape.extent[2] * shape.bytes;
    const auto element = element_of(image.encoding);
    if (image.height != shape.extent[1] || image.width != shape.extent[2] || !element ||
        element->second != shape.bytes || element->first != shape.kind)
      refuse(topic, message, "differs from the first one in size or encoding");
    if (image.step < row_bytes || image.data.size() < std::uint64_t{image.step} * (image.height - 1) + row_bytes)
      refuse(topic, message, "has fewer bytes than its size needs");
    const bool plain = image.big_endian == (std::endian::native == std::endian::big) || shape.bytes == 1;
    for (std::uint64_t row = 0; row < image.height; ++row) {
      const std::uint8_t* from = &image.data[row * image.step];
      if (plain) std::memcpy(to, from, row_bytes);
      for (std::uint64_t at = 0; at < row_bytes && !plain; at += shape.bytes)
        std::reverse_copy(from + at, from + at + shape.bytes, to + at);
      to += row_bytes;
    }
  }

  static void copy_fields(const Cloud& cloud, const FileArray& shape, const Array& about, std::uint64_t message,
                          std::uint8_t* to) {
    const std::uint64_t points = std::uint64_t{cloud.height} * cloud.width;
    std::uint64_t room = 1;
    for (std::size_t axis = 1; axis < shape.extent.size(); ++axis) room *= shape.extent[axis];
    room /= about.fields.size();
    for (const Field& field : about.fields) {
      if (std::ranges::find(cloud.fields, field) == cloud.fields.end())
        refuse(about.topic, message, "has no field '" + field.name + "' as the first one has it");
      if (std::uint64_t{field.offset} + field.bytes() > cloud.point_step)
        refuse(about.topic, message, "has the field '" + field.name + "' beyond its points");
    }
    if (points > room || std::uint64_t{cloud.row_step} < std::uint64_t{cloud.width} * cloud.point_step ||
        (points > 0 && cloud.data.size() < std::uint64_t{cloud.row_step} * (cloud.height - 1) +
                                               std::uint64_t{cloud.width} * cloud.point_step))
      refuse(about.topic, message, "has fewer bytes than its points need");
    for (std::uint64_t p = 0; p < room; ++p) {
      for (const Field& field : about.fields) {
        if (p < points) {
          const std::uint64_t at = p / cloud.width * cloud.row_step + p % cloud.width * cloud.point_step + field.offset;
          put(to, &cloud.data[at], field.bytes(), cloud.big_endian);
        } else if (field.type == 7) {
          constexpr float none = std::numeric_limits<float>::quiet_NaN();
          std::memcpy(to, &none, sizeof none);
        } else {
          std::memset(to, 0, field.bytes());
        }
        to += field.bytes();
      }
    }
  }

  std::map<std::string, Topic> topics_;
  std::vector<Array> described_;
};

}  // namespace tofgraph::ros
