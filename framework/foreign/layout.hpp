// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Layouts: meaning of the arrays of a foreign file, stated by the user. See docs/formats/layout.md.
#pragma once

#include "config/document.hpp"
#include "io/unknown.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::foreign {

/// Meaning of an axis of an array.
enum class Axis { frame, exposure, tap, row, column, coordinate, point };
inline constexpr std::string_view axis_names[] = {"frame", "exposure", "tap", "row", "column", "coordinate", "point"};

/// Parses axis names, "frame row column". @returns nothing for an unknown or repeated name
std::optional<std::vector<Axis>> parse_axes(std::string_view names);
std::string axes_text(const std::vector<Axis>& axes);

/// Status bits of a stored integer, and the flags of the pixels in which any of them is set.
struct StatusBits {
  std::uint64_t bits = 0;
  std::uint16_t flags = 0;
};

/// Channel of the capture and the array from which it is read.
struct ChannelLayout {
  std::string channel;                ///< depth, amplitude, phases, ...
  std::string array;                  ///< name in the file; empty: the only array
  std::vector<Axis> axes;             ///< in the order of the array's shape; empty: deduced from the sizes
  std::string unit;                   ///< size of a value of 1, "mm" or "0.1 mm"; empty: as in the file
  std::vector<double> invalid;        ///< "no measurement": values before zero, before or after mask
  std::optional<std::uint64_t> mask;  ///< bits of a value that are used
  std::vector<StatusBits> status;     ///< bits beside the value; not used for it
  std::uint32_t signed_bits = 0;      ///< lowest bits of a value, two's complement; 0: the type's own sign
  std::vector<Axis> reversed;         ///< row or column, if opposite to the camera's
  double zero = 0;                    ///< subtracted from the values
};

/// Metadata of frames: one number for all, or an array with one number per frame.
struct PerFrame {
  double value = io::unknown;  ///< SI; NaN: `array` is used
  std::string array;           ///< empty: none
  std::string unit;            ///< of the array's values
};

/// Array of a file without a header.
struct HeaderlessArray {
  std::string name;
  std::uint32_t kind = 0, bytes = 0;  ///< as in tofgraph_file_array
  bool big_endian = false;
  std::vector<std::uint64_t> shape;  ///< of one frame
  std::uint64_t image_header = 0;    ///< bytes before each element of the first axis
};

struct Layout {
  std::string camera;  ///< profile: name or absolute path; empty: not stated
  std::vector<ChannelLayout> channels;
  PerFrame integration_time, modulation_frequency, timestamp, time_since_power_on;  ///< s, Hz, s, s
  double frame_rate = io::unknown;                                                  ///< Hz
  std::uint64_t file_header = 0, frame_header = 0;  ///< bytes, for files without a header
  std::vector<HeaderlessArray> headerless;          ///< not empty: the file has no header
};

/// Reads a layout; errors are added to the diagnostics.
Layout read_layout(const config::Value& document, config::Diagnostics& diagnostics);
/// Reads a layout file. @throws config::ConfigurationError listing all errors
Layout read_layout(const std::filesystem::path& file);

/// Channels that a layout may name.
inline constexpr std::string_view layout_channels[] = {"depth",     "range",  "distance", "points", "amplitude",
                                                       "intensity", "phases", "taps",     "sigma",  "flags"};

}  // namespace tofgraph::foreign
