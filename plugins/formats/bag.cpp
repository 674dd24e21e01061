// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Bags of ROS 1, version 2.0. Format: http://wiki.ros.org/Bags/Format/2.0
#include <map>

#include "plugins/formats/ros_chunks.hpp"
#include "plugins/formats/ros_file.hpp"

namespace tofgraph {

struct Bag final : ros::RosFile {
  static constexpr const char* endings = "bag";
  static constexpr std::string_view magic = "#ROSBAG V2.0\n";
  static bool recognises(std::span<const std::uint8_t> head) {
    return head.size() >= magic.size() && std::equal(magic.begin(), magic.end(), head.begin());
  }

  explicit Bag(const std::string& path) : file_(path) {
    std::uint64_t at = magic.size();
    while (at + 8 <= file_.size()) {
      const Record record = record_at(at);
      if (record.operation == chunk_record) take_chunk(at);
      if (record.operation == connection_record) {  // repeated after the chunks
        std::vector<std::uint8_t> data;
        file_.read(record.data, record.size, data);
        take_connection(record.fields, data);
      }
      at = record.data + record.size;
    }
    add_topics();
  }

 protected:
  ros::Bytes chunk(std::uint64_t key) override {
    if (key == cached_ && !cache_.empty()) return cache_;
    const Record record = record_at(key);
    std::vector<std::uint8_t> data;
    file_.read(record.data, record.size, data);
    cache_ = ros::decompressed(text(record.fields, "compression"), data, number<std::uint32_t>(record.fields, "size"));
    cached_ = key;
    return cache_;
  }

 private:
  static constexpr int message_record = 2, chunk_record = 5, connection_record = 7;
  using Fields = std::map<std::string, std::string>;
  struct Record {
    int operation = 0;
    Fields fields;
    std::uint64_t data = 0, size = 0;  // offset and size in bytes
  };

  static Fields fields_of(ros::Bytes bytes) {
    Fields fields;
    for (std::uint64_t at = 0; at < bytes.size();) {
      ros::MessageReader in(bytes.subspan(at), false);
      const std::string field = in.text();
      const std::size_t equal = field.find('=');
      if (equal == std::string::npos) throw std::runtime_error("has a damaged record header");
      fields[field.substr(0, equal)] = field.substr(equal + 1);
      at += 4 + field.size();
    }
    return fields;
  }
  static std::string text(const Fields& fields, const std::string& name) {
    const auto found = fields.find(name);
    if (found == fields.end()) throw std::runtime_error("has a record without the field '" + name + "'");
    return found->second;
  }
  template <class T> static T number(const Fields& fields, const std::string& name) {
    const std::string bytes = text(fields, name);
    if (bytes.size() != sizeof(T)) throw std::runtime_error("has a record with a damaged field '" + name + "'");
    ros::MessageReader in(ros::Bytes(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()), false);
    return in.number<T>();
  }

  Record record_at(std::uint64_t at) {
    std::vector<std::uint8_t> bytes;
    Record record;
    file_.read(at, 4, bytes);
    const auto header = ros::MessageReader(bytes, false).number<std::uint32_t>();
    file_.read(at + 4, header, bytes);
    record.fields = fields_of(bytes);
    record.operation = number<std::uint8_t>(record.fields, "op");
    file_.read(at + 4 + header, 4, bytes);
    record.size = ros::MessageReader(bytes, false).number<std::uint32_t>();
    record.data = at + 8 + header;
    if (record.size > file_.size() - record.data) throw std::runtime_error("ends within a record: it was cut off");
    return record;
  }

  void take_connection(const Fields& fields, ros::Bytes data) {
    connections_[number<std::uint32_t>(fields, "conn")] = {text(fields, "topic"), text(fields_of(data), "type")};
  }

  void take_chunk(std::uint64_t key) {
    const ros::Bytes content = chunk(key);
    for (std::uint64_t at = 0; at < content.size();) {
      ros::MessageReader in(content.subspan(at), false);
      const ros::Bytes header = in.data(), data = in.data();
      const Fields fields = fields_of(header);
      const int operation = number<std::uint8_t>(fields, "op");
      at += 8 + header.size() + data.size();
      if (operation == connection_record) take_connection(fields, data);
      if (operation != message_record) continue;
      const auto found = connections_.find(number<std::uint32_t>(fields, "conn"));
      if (found == connections_.end()) throw std::runtime_error("has a message of a connection that is not described");
      const auto time = number<std::uint64_t>(fields, "time");  // seconds, then nanoseconds
      note(found->second.first, found->second.second, false, {key, at - data.size(), data.size()}, data,
           static_cast<std::int64_t>((time & 0xffffffffU) * 1'000'000'000U + (time >> 32U)));
    }
  }

  ros::PlacedFile file_;
  std::uint64_t cached_ = 0;
  std::vector<std::uint8_t> cache_;
  std::map<std::uint32_t, std::pair<std::string, std::string>> connections_;
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::Bag, "Bags of ROS 1: Image, PointCloud2, CameraInfo")
