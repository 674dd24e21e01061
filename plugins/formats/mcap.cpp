// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Recordings of ROS 2 (and ROS 1) in MCAP: images, clouds and cameras. Format: https://mcap.dev/spec
#include <zlib.h>

#include <map>

#include "plugins/formats/ros_chunks.hpp"
#include "plugins/formats/ros_file.hpp"

namespace tofgraph {

struct Mcap final : ros::RosFile {
  static constexpr const char* endings = "mcap";
  static constexpr std::uint8_t magic[8] = {0x89, 'M', 'C', 'A', 'P', 0x30, '\r', '\n'};
  static bool recognises(std::span<const std::uint8_t> head) {
    return head.size() >= 8 && std::equal(std::begin(magic), std::end(magic), head.begin());
  }

  /// Opens a recording. If its end is missing, e.g. because the recorder was killed, complete records are read.
  explicit Mcap(const std::string& path) : file_(path) {
    std::uint64_t at = sizeof magic;
    std::vector<std::uint8_t> head;
    while (at + 9 <= file_.size()) {
      file_.read(at, 9, head);
      ros::MessageReader in(head, false);
      const auto operation = in.number<std::uint8_t>();
      const auto length = in.number<std::uint64_t>();
      if (length > file_.size() - at - 9) throw std::runtime_error("ends within a record: it was cut off");
      if (operation == data_end || operation == footer) break;
      if (operation == chunk_record || operation == message_record || operation == schema_record ||
          operation == channel_record)
        take(operation, at);
      at += 9 + length;
    }
    add_topics();
  }

 protected:
  /// @param key offset of the record in the file: of a chunk, or of a message outside chunks
  ros::Bytes chunk(std::uint64_t key) override {
    if (key == cached_ && !cache_.empty()) return cache_;
    std::vector<std::uint8_t> record;
    file_.read(key, 9, record);
    ros::MessageReader head(record, false);
    const auto operation = head.number<std::uint8_t>();
    const auto length = head.number<std::uint64_t>();
    file_.read(key + 9, length, record);
    cached_ = key;
    cache_.clear();
    if (operation != chunk_record) return cache_ = std::move(record);
    ros::MessageReader in(record, false);
    in.number<std::uint64_t>();  // times of the first and last message
    in.number<std::uint64_t>();
    const auto size = in.number<std::uint64_t>();
    const auto checksum = in.number<std::uint32_t>();  // 0: none
    const std::string compression = in.text();
    const auto stored = in.number<std::uint64_t>();
    const std::uint64_t begin = 8 + 8 + 8 + 4 + 4 + compression.size() + 8;
    if (stored > record.size() - begin) throw std::runtime_error("has a chunk that is longer than its record");
    cache_ = ros::decompressed(compression, ros::Bytes(record).subspan(begin, stored), size);
    if (checksum != 0 && crc32(0, cache_.data(), static_cast<uInt>(cache_.size())) != checksum)
      throw std::runtime_error("has a damaged chunk: its checksum does not fit");
    return cache_;
  }

 private:
  static constexpr std::uint8_t footer = 2, schema_record = 3, channel_record = 4, message_record = 5, chunk_record = 6,
                                data_end = 15;
  struct Channel {
    std::string topic, encoding;
    std::uint16_t schema = 0;
  };

  void take(std::uint8_t operation, std::uint64_t at) {
    const ros::Bytes content = chunk(at);
    if (operation != chunk_record) return take_record(operation, content, at, 0);
    for (std::uint64_t place = 0; place + 9 <= content.size();) {
      ros::MessageReader head(content.subspan(place, 9), false);
      const auto inner = head.number<std::uint8_t>();
      const auto length = head.number<std::uint64_t>();
      place += 9;
      if (length > content.size() - place) throw std::runtime_error("has a chunk that ends within a record");
      take_record(inner, content.subspan(place, length), at, place);
      place += length;
    }
  }

  void take_record(std::uint8_t operation, ros::Bytes content, std::uint64_t at, std::uint64_t place) {
    ros::MessageReader in(content, false);
    if (operation == schema_record) {
      const auto id = in.number<std::uint16_t>();
      schemas_[id] = in.text();
    } else if (operation == channel_record) {
      const auto id = in.number<std::uint16_t>();
      Channel channel;
      channel.schema = in.number<std::uint16_t>();
      channel.topic = in.text();
      channel.encoding = in.text();
      channels_[id] = channel;
    } else if (operation == message_record) {
      constexpr std::uint64_t head = 2 + 4 + 8 + 8;
      const auto found = channels_.find(in.number<std::uint16_t>());
      in.number<std::uint32_t>();
      const auto time = static_cast<std::int64_t>(in.number<std::uint64_t>());
      in.number<std::uint64_t>();
      if (found == channels_.end()) throw std::runtime_error("has a message of a channel that is not described");
      const Channel& channel = found->second;
      const bool cdr = channel.encoding == "cdr";
      const std::string type = cdr || channel.encoding == "ros1" ? schemas_[channel.schema] : channel.encoding;
      note(channel.topic, type, cdr, {at, place + head, content.size() - head}, content.subspan(head), time);
    }
  }

  ros::PlacedFile file_;
  std::uint64_t cached_ = 0;
  std::vector<std::uint8_t> cache_;
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, Channel> channels_;
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::Mcap, "Recordings of ROS 2 in MCAP: Image, PointCloud2, CameraInfo")
