// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Dataset and attributes of a capture, validated while reading. Internal to this folder; the caller holds the
/// lock.
#pragma once

#include "io/captures/capture.hpp"
#include "io/captures/capture_hdf5.hpp"
#include "io/captures/capture_layout.hpp"

#include <optional>
#include <string>
#include <vector>

namespace tofgraph::io::h5 {

/// Text of the attribute; empty if there is none. @throws std::runtime_error if it is not a single text
std::string text_attribute(hid_t object, const char* name);
/// Numbers of the attribute; empty if there is none. @throws std::runtime_error
std::vector<double> numbers_attribute(hid_t object, const char* name, std::size_t most);
void write_numbers(hid_t object, const char* name, const std::vector<double>& values);
void write_text(hid_t object, const char* name, const std::string& value);
/// Integer, also if stored as a float, as MATLAB does. @throws std::runtime_error
std::int64_t integer_attribute(hid_t object, const char* name);

class Dataset {
 public:
  /// @param end number of bytes of a truncated file
  /// @param folder for messages
  /// @throws std::runtime_error also for content that would make the reader follow other files or exhaust memory
  Dataset(hid_t group, std::string name, std::uint64_t end = CaptureReader::not_cut,
          const std::string& folder = "/frames/");

  const std::string& name() const { return name_; }
  /// Number of frames that the file announces.
  std::size_t frames() const { return static_cast<std::size_t>(size_.front()); }
  /// Number of frames that the file contains. If `all`, fewer than announced are an error.
  std::size_t stored_frames(bool all) const;

  /// Description as a channel; nullopt for an unknown name without the shape of a channel.
  /// @throws std::runtime_error for a known channel with a wrong type or shape
  std::optional<CaptureChannel> as_channel(const CaptureHeader& header) const;
  /// @throws std::runtime_error if it is not an array of one value per frame
  void check_metadata(const layout::Metadata& kind) const;

  /// Text of a dataset of bytes. @throws std::runtime_error
  std::string text() const;
  void read_first(std::size_t frames, hid_t memory, void* data) const;
  void read_frame(std::size_t frame, hid_t memory, void* data) const;
  /// Reads elements first .. first + count - 1 along the slowest axis. @throws std::runtime_error
  void read_range(std::uint64_t first, std::uint64_t count, hid_t memory, void* data) const;
  hid_t type() const { return type_; }
  hid_t id() const { return dataset_; }
  const std::vector<hsize_t>& size() const { return size_; }

 private:
  void read(hsize_t first, hsize_t frames, hid_t frames_space, hid_t memory, void* data) const;
  void check_storage();
  std::size_t whole_frames() const;
  bool is_whole(const std::vector<hsize_t>& chunk) const;
  bool check_chunk(hsize_t frame) const;
  /// "3 x 132 x 176 float32"
  std::string described() const;
  [[noreturn]] void fail(const std::string& why) const;

  std::string name_, where_;
  std::uint64_t end_;
  Handle dataset_, space_, type_, frame_space_;
  std::vector<hsize_t> size_;   // frames first
  std::vector<hsize_t> chunk_;  // empty: not chunked
  bool filtered_ = false;       // chunks are compressed or otherwise coded
  bool is_frame_ = false;       // a chunk is one frame
};

}  // namespace tofgraph::io::h5
