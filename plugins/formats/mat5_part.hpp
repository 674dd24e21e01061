// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Bytes of a MATLAB file, stored as they are or deflated.
#pragma once

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <istream>
#include <memory>
#include <stdexcept>
#include <vector>

namespace tofgraph {

/// Part of a file, read in order, and inflated if asked for.
class Mat5Part {
 public:
  using Bytes = std::vector<std::uint8_t>;

  Mat5Part(std::istream& in, std::uint64_t length) : in_(&in), left_(length) {}
  void inflate() {
    stream_ = std::unique_ptr<z_stream, End>(new z_stream{});
    if (inflateInit(stream_.get()) != Z_OK) throw std::runtime_error("cannot be inflated: no memory");
  }
  /// Returns the next bytes, fewer at the end.
  Bytes bytes(std::uint64_t count) {
    Bytes result = stream_ ? inflated(count) : stored(count);
    position_ += result.size();
    return result;
  }
  void skip(std::uint64_t count) {
    if (!stream_) {
      count = std::min(count, left_);
      in_->seekg(static_cast<std::streamoff>(count), std::ios::cur);
      left_ -= count;
      position_ += count;
      return;
    }
    while (count > 0) {
      const std::uint64_t read = bytes(std::min(count, buffer_size)).size();
      if (read == 0) return;
      count -= read;
    }
  }
  std::uint64_t position() const { return position_; }
  /// Returns whether inflated data end here, up to a padding, and agree with their checksum.
  bool ends() {
    constexpr std::uint64_t padding = 8;
    return bytes(padding).size() < padding && result_ == Z_STREAM_END;
  }

 private:
  static constexpr std::uint64_t buffer_size = 65536;
  struct End {
    void operator()(z_stream* stream) const {
      inflateEnd(stream);
      delete stream;
    }
  };
  Bytes stored(std::uint64_t count) {
    Bytes result(std::min(count, left_));
    in_->read(reinterpret_cast<char*>(result.data()), static_cast<std::streamsize>(result.size()));
    result.resize(static_cast<std::size_t>(in_->gcount()));
    left_ -= result.size();
    return result;
  }
  Bytes inflated(std::uint64_t count) {
    Bytes result(count);
    stream_->next_out = result.data();
    stream_->avail_out = static_cast<uInt>(count);
    while (stream_->avail_out > 0 && result_ == Z_OK) {
      if (stream_->avail_in == 0) {
        buffer_ = stored(buffer_size);
        stream_->next_in = buffer_.data();
        stream_->avail_in = static_cast<uInt>(buffer_.size());
      }
      result_ = ::inflate(stream_.get(), Z_SYNC_FLUSH);
    }
    result.resize(count - stream_->avail_out);
    return result;
  }

  std::istream* in_;
  std::uint64_t left_, position_ = 0;
  std::unique_ptr<z_stream, End> stream_;
  int result_ = Z_OK;  // of the last call of inflate
  Bytes buffer_;
};

}  // namespace tofgraph
