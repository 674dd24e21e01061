// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Images of a capture as numbers, independent of the stored type. For code that reads many frames.
#pragma once

#include "io/captures/capture.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace tofgraph::io {

class Recording {
 public:
  /// Content of the frames; the first available one. decoded: distance and amplitude; images: amplitude or intensity
  /// alone.
  enum class Kind { taps, phases, decoded, distances, images };

  /// @throws std::runtime_error if the capture cannot be read, or has no taps, phases, distance, amplitude or
  /// intensity
  explicit Recording(const std::filesystem::path& file);

  const CaptureReader& reader() const { return reader_; }
  Kind kind() const { return kind_; }
  /// Taps of a frame, P x 2 x pixels. @throws std::runtime_error
  std::vector<std::uint16_t> taps(std::size_t frame) const { return read<std::uint16_t>("taps", frame); }
  /// Channel of float32, int16 or int32; invalid lengths are NaN in length channels. @throws
  /// std::runtime_error
  std::vector<float> floats(const char* name, std::size_t frame) const;

 private:
  struct Channel {
    std::size_t index;
    std::uint32_t type;
    std::uint64_t elements;
  };
  template <class T> std::vector<T> read(const char* name, std::size_t frame) const {
    const Channel& channel = channels_.at(name);
    std::vector<T> data(channel.elements);
    reader_.read(channel.index, frame, data.data());
    return data;
  }

  CaptureReader reader_;
  std::map<std::string, Channel> channels_;
  Kind kind_ = Kind::phases;
};

}  // namespace tofgraph::io
