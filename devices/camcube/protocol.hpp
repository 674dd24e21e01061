// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Protocol of a USB camera, described by a file: IDs, endpoints, commands, fields of headers. Keys:
/// docs/formats/protocol.md.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::camcube {

/// Type of an integer in a header or a command.
struct NumberType {
  std::size_t bytes = 4;
  bool big_endian = false;
  double greatest() const { return bytes < 8 ? static_cast<double>((std::uint64_t{1} << (8 * bytes)) - 1) : 1.8e19; }
};
std::uint64_t read_number(NumberType type, std::span<const std::uint8_t> at);

/// Number in the header before each image.
struct Field {
  std::size_t offset = 0;
  NumberType type;
  std::uint64_t read(std::span<const std::uint8_t> header) const {
    return read_number(type, header.subspan(offset, type.bytes));
  }
};

/// Bytes common to all headers.
struct Magic {
  std::size_t offset = 0;
  std::vector<std::uint8_t> bytes;
};

/// Values sent in commands in addition to fixed bytes.
struct CommandValues {
  std::uint64_t integration_time_us = 0, modulation_frequency_hz = 0;
};

/// Transfer of a command: to the control endpoint, or to a bulk endpoint.
struct Step {
  /// Fixed bytes, or a number in place of them.
  struct Part {
    std::vector<std::uint8_t> bytes;
    std::uint64_t CommandValues::*value = nullptr;
    NumberType type;
  };
  std::optional<std::array<std::uint16_t, 4>> control;  ///< request type, request, value, index
  std::uint8_t bulk = 0;                                ///< endpoint, if it is not a control transfer
  std::vector<Part> data;
  std::vector<std::uint8_t> answer;  ///< required beginning of the answer to a control transfer to the host

  /// @throws std::out_of_range if a number does not fit
  std::vector<std::uint8_t> bytes(const CommandValues& values) const;
};

struct Protocol {
  std::filesystem::path file;
  std::string name;
  std::uint16_t vendor = 0, product = 0;
  int interface = 0;
  std::uint8_t endpoint = 0;  ///< bulk IN
  std::size_t transfers = 8;  ///< number in flight
  bool whole_frames = false;  ///< true: one frame per transfer; false: one image
  std::optional<Magic> magic;
  std::optional<Field> image, number, integration_time, modulation_frequency;
  std::map<std::string, std::vector<Step>> commands;  ///< by name; missing: not needed by the camera

  bool has(const std::string& command) const { return commands.contains(command); }
};

/// @throws config::ConfigurationError listing all errors with their positions
Protocol read_protocol(const std::filesystem::path& file);

}  // namespace tofgraph::camcube
