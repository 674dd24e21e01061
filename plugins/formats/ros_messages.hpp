// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// ROS messages: sensor_msgs Image, CameraInfo and PointCloud2, in ROS 1 serialization or as CDR of ROS 2.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::ros {

using Bytes = std::span<const std::uint8_t>;

/// Reads numbers and strings of a message in sequence. @throws std::runtime_error if it ends too early
class MessageReader {
 public:
  MessageReader(Bytes bytes, bool cdr) : bytes_(bytes), cdr_(cdr) {
    if (!cdr) return;
    if (bytes.size() < 4 || bytes[0] != 0 || bytes[1] > 1)
      throw std::runtime_error("has a message that is no plain CDR");
    swap_ = (bytes[1] == 0) == (std::endian::native == std::endian::little);
    bytes_ = bytes.subspan(4);
  }
  template <class T> T number() {
    if (cdr_) at_ = (at_ + sizeof(T) - 1) / sizeof(T) * sizeof(T);
    const Bytes raw = take(sizeof(T));
    std::array<std::uint8_t, sizeof(T)> copy;
    for (std::size_t i = 0; i < sizeof(T); ++i) copy[i] = raw[swap_ ? sizeof(T) - 1 - i : i];
    return std::bit_cast<T>(copy);
  }
  std::string text() {
    const Bytes raw = take(number<std::uint32_t>());
    std::string text(raw.begin(), raw.end());
    if (cdr_ && !text.empty() && text.back() == '\0') text.pop_back();
    return text;
  }
  Bytes data() { return take(number<std::uint32_t>()); }
  std::vector<double> doubles(std::size_t count) {
    if (count > bytes_.size() / 8) fail();
    std::vector<double> values(count);
    for (double& value : values) value = number<double>();
    return values;
  }

 private:
  [[noreturn]] static void fail() { throw std::runtime_error("has a message that ends before its content does"); }
  Bytes take(std::uint64_t count) {
    if (at_ > bytes_.size() || count > bytes_.size() - at_) fail();
    at_ += count;
    return bytes_.subspan(at_ - count, count);
  }

  Bytes bytes_;
  bool cdr_, swap_ = std::endian::native == std::endian::big;
  std::uint64_t at_ = 0;
};

struct Header {
  std::int64_t stamp = 0;  ///< ns
  std::string frame;
};

inline Header read_header(MessageReader& in, bool cdr) {
  Header header;
  if (!cdr) in.number<std::uint32_t>();  // seq
  const auto seconds = cdr ? static_cast<std::int64_t>(in.number<std::int32_t>())
                           : static_cast<std::int64_t>(in.number<std::uint32_t>());
  header.stamp = seconds * 1'000'000'000 + static_cast<std::int64_t>(in.number<std::uint32_t>());
  header.frame = in.text();
  return header;
}

struct Image {
  Header header;
  std::uint32_t height = 0, width = 0, step = 0;
  std::string encoding;
  bool big_endian = false;
  Bytes data;
};

inline Image read_image(Bytes bytes, bool cdr) {
  MessageReader in(bytes, cdr);
  Image image{.header = read_header(in, cdr)};
  image.height = in.number<std::uint32_t>();
  image.width = in.number<std::uint32_t>();
  image.encoding = in.text();
  image.big_endian = in.number<std::uint8_t>() != 0;
  image.step = in.number<std::uint32_t>();
  image.data = in.data();
  return image;
}

struct CameraInfo {
  Header header;
  std::uint32_t height = 0, width = 0, binning_x = 0, binning_y = 0;
  std::string model;
  std::vector<double> d, k;
  bool roi = false;  ///< only part of the sensor

  bool operator==(const CameraInfo& other) const {
    return height == other.height && width == other.width && model == other.model && d == other.d && k == other.k;
  }
};

inline CameraInfo read_camera_info(Bytes bytes, bool cdr) {
  MessageReader in(bytes, cdr);
  CameraInfo info{.header = read_header(in, cdr)};
  info.height = in.number<std::uint32_t>();
  info.width = in.number<std::uint32_t>();
  info.model = in.text();
  info.d = in.doubles(in.number<std::uint32_t>());
  info.k = in.doubles(9);
  in.doubles(9 + 12);  // R, P
  info.binning_x = in.number<std::uint32_t>();
  info.binning_y = in.number<std::uint32_t>();
  std::array<std::uint32_t, 4> roi{};  // x, y, height, width
  for (std::uint32_t& value : roi) value = in.number<std::uint32_t>();
  info.roi =
      roi[0] != 0 || roi[1] != 0 || (roi[2] != 0 && roi[2] != info.height) || (roi[3] != 0 && roi[3] != info.width);
  return info;
}

struct Field {
  std::string name;
  std::uint32_t offset = 0, count = 0;
  std::uint8_t type = 0;  ///< 1 to 8: int8 uint8 int16 uint16 int32 uint32 float32 float64

  static constexpr std::array<std::uint32_t, 9> sizes = {0, 1, 1, 2, 2, 4, 4, 4, 8};
  std::uint32_t bytes() const { return type < sizes.size() ? sizes[type] : 0; }
  bool operator==(const Field&) const = default;
};

struct Cloud {
  Header header;
  std::uint32_t height = 0, width = 0, point_step = 0, row_step = 0;
  std::vector<Field> fields;
  bool big_endian = false;
  Bytes data;
};

inline Cloud read_cloud(Bytes bytes, bool cdr) {
  MessageReader in(bytes, cdr);
  Cloud cloud{.header = read_header(in, cdr)};
  cloud.height = in.number<std::uint32_t>();
  cloud.width = in.number<std::uint32_t>();
  const auto count = in.number<std::uint32_t>();
  if (count > 256) throw std::runtime_error("has a cloud of more than 256 fields");
  for (std::uint32_t i = 0; i < count; ++i) {
    Field& field = cloud.fields.emplace_back();
    field.name = in.text();
    field.offset = in.number<std::uint32_t>();
    field.type = in.number<std::uint8_t>();
    field.count = in.number<std::uint32_t>();
  }
  cloud.big_endian = in.number<std::uint8_t>() != 0;
  cloud.point_step = in.number<std::uint32_t>();
  cloud.row_step = in.number<std::uint32_t>();
  cloud.data = in.data();
  return cloud;
}

}  // namespace tofgraph::ros
