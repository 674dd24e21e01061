// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Writer of MCAP files: messages in CDR, one chunk per frame, an index at the end. https://mcap.dev/spec
#pragma once

#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "io/output_file.hpp"

namespace tofgraph::mcap {

static_assert(std::endian::native == std::endian::little, "numbers are stored as they are");

/// Serializes numbers and strings in sequence, without padding.
class Record {
 public:
  template <class T> Record& number(T value) {
    const auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
    bytes_.append(bytes.data(), bytes.size());
    return *this;
  }
  Record& text(std::string_view value) { return number(static_cast<std::uint32_t>(value.size())).raw(value); }
  Record& raw(std::string_view value) {
    bytes_.append(value);
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Message in CDR, little-endian: numbers are aligned to their size.
class Message {
 public:
  template <class T> Message& number(T value) {
    while ((bytes_.size() - 4) % sizeof(T) != 0) bytes_ += '\0';
    const auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    bytes_.append(raw.data(), raw.size());
    return *this;
  }
  Message& text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    bytes_.append(value.c_str(), value.size() + 1);
    return *this;
  }
  Message& data(const void* from, std::size_t count) {
    number(static_cast<std::uint32_t>(count));
    bytes_.append(static_cast<const char*>(from), count);
    return *this;
  }
  Message& numbers(std::span<const double> values) {
    for (const double value : values) number(value);
    return *this;
  }
  /// std_msgs/Header
  Message& header(std::int64_t stamp_ns, const std::string& frame_id) {
    number(static_cast<std::int32_t>(stamp_ns / 1'000'000'000));
    return number(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000)).text(frame_id);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_ = std::string("\0\1\0\0", 4);
};

class File {
 public:
  /// @param compression of chunks: empty, lz4 or zstd @throws std::runtime_error
  File(const std::string& path, std::string compression) : out_(path), compression_(std::move(compression)) {
    put("\x89MCAP0\r\n");
    put_record(header, Record().text("ros2").text("tofgraph").bytes());
  }

  /// @returns the ID of the channel
  std::uint16_t add_channel(const std::string& topic, const std::string& type, std::string_view definition) {
    auto& schema = schemas_[type];
    if (schema == 0) {
      schema = static_cast<std::uint16_t>(schemas_.size());
      descriptions_ +=
          record_of(schema_record, Record().number(schema).text(type).text("ros2msg").text(definition).bytes());
    }
    const auto channel = static_cast<std::uint16_t>(counts_.size());
    counts_[channel] = 0;
    descriptions_ +=
        record_of(channel_record,
                  Record().number(channel).number(schema).text(topic).text("cdr").number(std::uint32_t{0}).bytes());
    return channel;
  }

  void add(std::uint16_t channel, std::uint64_t time_ns, const Message& message) {
    if (chunk_.empty()) {
      chunk_ = messages_ == 0 ? descriptions_ : "";
      chunk_begin_ = chunk_end_ = time_ns;
    }
    index_[channel].number(time_ns).number(static_cast<std::uint64_t>(chunk_.size()));
    chunk_ += record_of(message_record, Record()
                                            .number(channel)
                                            .number(static_cast<std::uint32_t>(counts_[channel]++))
                                            .number(time_ns)
                                            .number(time_ns)
                                            .raw(message.bytes())
                                            .bytes());
    chunk_begin_ = std::min(chunk_begin_, time_ns);
    chunk_end_ = std::max(chunk_end_, time_ns);
    ++messages_;
  }

  /// Writes the messages since the last call as a chunk. @throws std::runtime_error, e.g. if the disk is full
  void end_chunk() {
    if (chunk_.empty()) return;
    const std::string stored = compressed();
    const auto crc = static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(chunk_.data()), static_cast<uInt>(chunk_.size())));
    const std::uint64_t begin = at_;
    put_record(chunk_record, Record()
                                 .number(chunk_begin_)
                                 .number(chunk_end_)
                                 .number(static_cast<std::uint64_t>(chunk_.size()))
                                 .number(crc)
                                 .text(compression_)
                                 .number(static_cast<std::uint64_t>(stored.size()))
                                 .raw(stored)
                                 .bytes());
    const std::uint64_t length = at_ - begin;
    Record places;
    for (const auto& [channel, entries] : index_) {
      places.number(channel).number(at_);
      put_record(message_index, Record().number(channel).text(entries.bytes()).bytes());
    }
    chunk_indices_ += record_of(chunk_index, Record()
                                                 .number(chunk_begin_)
                                                 .number(chunk_end_)
                                                 .number(begin)
                                                 .number(length)
                                                 .text(places.bytes())
                                                 .number(at_ - begin - length)
                                                 .text(compression_)
                                                 .number(static_cast<std::uint64_t>(stored.size()))
                                                 .number(static_cast<std::uint64_t>(chunk_.size()))
                                                 .bytes());
    begin_ = chunks_ == 0 ? chunk_begin_ : std::min(begin_, chunk_begin_);
    end_ = std::max(end_, chunk_end_);
    ++chunks_;
    chunk_.clear();
    index_.clear();
  }

  /// Writes the index and renames the file to its final name. @throws std::runtime_error
  void finish() {
    end_chunk();
    put_record(data_end, Record().number(std::uint32_t{0}).bytes());
    const std::uint64_t summary = at_;
    put(descriptions_);
    Record counts;
    for (const auto& [channel, count] : counts_) counts.number(channel).number(count);
    put_record(statistics, Record()
                               .number(messages_)
                               .number(static_cast<std::uint16_t>(schemas_.size()))
                               .number(static_cast<std::uint32_t>(counts_.size()))
                               .number(std::uint32_t{0})
                               .number(std::uint32_t{0})
                               .number(chunks_)
                               .number(begin_)
                               .number(end_)
                               .text(counts.bytes())
                               .bytes());
    put(chunk_indices_);
    put_record(footer, Record().number(summary).number(std::uint64_t{0}).number(std::uint32_t{0}).bytes());
    put("\x89MCAP0\r\n");
    out_.sync();
    out_.commit();
  }

 private:
  static constexpr std::uint8_t header = 1, footer = 2, schema_record = 3, channel_record = 4, message_record = 5,
                                chunk_record = 6, message_index = 7, chunk_index = 8, statistics = 11, data_end = 15;

  static std::string record_of(std::uint8_t operation, const std::string& content) {
    return Record().number(operation).number(static_cast<std::uint64_t>(content.size())).raw(content).bytes();
  }
  void put(std::string_view bytes) {
    out_.write(bytes);
    at_ += bytes.size();
  }
  void put_record(std::uint8_t operation, const std::string& content) { put(record_of(operation, content)); }

  std::string compressed() const {
    if (compression_.empty()) return chunk_;
    const bool lz4 = compression_ == "lz4";
    std::string stored(lz4 ? LZ4F_compressFrameBound(chunk_.size(), nullptr) : ZSTD_compressBound(chunk_.size()), '\0');
    const std::size_t size =
        lz4 ? LZ4F_compressFrame(stored.data(), stored.size(), chunk_.data(), chunk_.size(), nullptr)
            : ZSTD_compress(stored.data(), stored.size(), chunk_.data(), chunk_.size(), 1);
    if (lz4 ? LZ4F_isError(size) != 0 : ZSTD_isError(size) != 0)
      throw std::runtime_error("a chunk cannot be compressed");
    stored.resize(size);
    return stored;
  }

  io::OutputFile out_;
  std::string compression_, descriptions_, chunk_, chunk_indices_;
  std::map<std::string, std::uint16_t> schemas_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::map<std::uint16_t, Record> index_;
  std::uint64_t at_ = 0, messages_ = 0, chunk_begin_ = 0, chunk_end_ = 0, begin_ = 0, end_ = 0;
  std::uint32_t chunks_ = 0;
};

}  // namespace tofgraph::mcap
