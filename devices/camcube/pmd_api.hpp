// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The C interface of the vendor's library libpmdaccess2, as far as it is used: own declarations based on public
/// information. Not verified on hardware. Every function returns a code of Result.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tofgraph::camcube::pmd {

using Handle = unsigned;

enum Result : int {
  ok = 0,
  runtime_error = 1024,
  generic_error = 1025,
  disconnected = 1026,
  invalid_value = 1027,
  timed_out = 1028,
  logic_error = 2048,
  unknown_handle = 2049,
  not_implemented = 2050,
  out_of_bounds = 2051,
  resource_error = 4096,
  file_not_found = 4097,
  could_not_open = 4098,
  data_not_found = 4099,
  end_of_data = 4100,
  device_is_busy = 4101
};

enum Proximity : int { at_least = 0, at_most = 1, close_to = 2 };

/// Bits of a pixel's flags; only these four have the same meaning as in this project.
inline constexpr unsigned common_flags = 0x0f, flag_invalid = 0x01;

/// Types of source data, DataDescription::type: taps A and B of 16 bits, big-endian or little-endian.
enum DataType : std::uint32_t {
  raw_b16_ab = 0x9006,
  raw_l16_ab = 0x1006,
  camcube_data_1_0 = 0x60001,
  camcube_data_2_0 = 0x60002
};

struct GenericDescription {
  std::uint32_t sub_type, count, element_bytes;
};
struct ImageDescription {
  std::uint32_t sub_type, columns, rows, images;
  std::int32_t integration_time[4];      ///< us
  std::int32_t modulation_frequency[4];  ///< Hz
  std::int32_t offset[4];                ///< mm
  std::int32_t pixel_aspect_ratio;       ///< 1/1000
  std::int32_t pixel_origin;
  std::uint32_t time_s, time_us;
  char reserved[24];
  std::uint32_t user_data;
};
struct DataDescription {
  std::uint32_t process_id, device_id, type, bytes, header_type;  ///< header_type: 1 generic, 2 image
  union {
    GenericDescription generic;
    ImageDescription image;
  };
};
static_assert(sizeof(ImageDescription) == 108 && sizeof(DataDescription) == 128 &&
              offsetof(DataDescription, image) == 20);

using Open = int(Handle*, const char* source, const char* source_parameter, const char* processing,
                 const char* processing_parameter);
using Close = int(Handle);
using GetLastError = int(Handle, char* text, std::size_t bytes);  ///< handle 0: failure of opening
using Update = int(Handle);                                       ///< blocks until a frame is available
/// Microseconds; Hz.
using SetNumber = int(Handle, unsigned index, unsigned value);
/// The index comes last in this function.
using GetNumber = int(Handle, unsigned* value, unsigned index);
using GetValidNumber = int(Handle, unsigned* nearest, unsigned index, Proximity, unsigned value);
using GetSourceDataSize = int(Handle, std::size_t* bytes);
using GetSourceData = int(Handle, void* data, std::size_t bytes);
using GetSourceDataDescription = int(Handle, DataDescription*);
using GetImage = int(Handle, float* image, std::size_t bytes);  ///< distances, amplitudes, intensities; row by row
using GetFlags = int(Handle, unsigned* image, std::size_t bytes);
using Command = int(Handle, char* answer, std::size_t bytes, const char* command);  ///< the answer buffer may be (0, 0)

}  // namespace tofgraph::camcube::pmd
