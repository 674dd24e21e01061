// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Names and contents of a capture's HDF5 objects. Internal to this folder.
#pragma once

#include <tofgraph/plugin.h>

#include <hdf5.h>

#include <cstdint>
#include <iterator>

namespace tofgraph::io::layout {

inline constexpr const char* format = "tofgraph-capture";
inline constexpr int version = 1;
inline constexpr const char* group = "frames";
/// Root attribute, or a dataset of bytes beside the group if it was known only at the end of a recording.
inline constexpr const char* provenance = "provenance";
/// Root attributes of the exposures, in their order, rad and Hz.
inline constexpr const char *phase = "exposure_phase_rad", *frequency = "exposure_frequency_hz";

/// Message for a capture that was cut off before the end of its first frame.
inline constexpr const char* no_complete_frame = "holds no complete frame yet";

/// 0 degC in kelvin.
inline constexpr double zero_celsius = 273.15;

/// Value in a metadata array.
union Element {
  std::int64_t integer;
  std::uint64_t count;
  double number;
};

/// Array of length N under /frames, one value per frame.
struct Metadata {
  const char* name;
  bool required;
  std::uint64_t known;  ///< TOFGRAPH_KNOWS_.. bit, or 0
  hid_t (*file_type)();
  hid_t (*memory_type)();
  Element (*stored)(const tofgraph_metadata&);
  void (*load)(tofgraph_metadata&, Element);
};

inline hid_t float64() { return H5T_IEEE_F64LE; }
inline hid_t float32() { return H5T_IEEE_F32LE; }
inline hid_t int64() { return H5T_STD_I64LE; }
inline hid_t uint64() { return H5T_STD_U64LE; }
inline hid_t native_double() { return H5T_NATIVE_DOUBLE; }
inline hid_t native_int64() { return H5T_NATIVE_INT64; }
inline hid_t native_uint64() { return H5T_NATIVE_UINT64; }

inline constexpr Metadata metadata[] = {
    {"timestamp_ns", true, TOFGRAPH_KNOWS_TIMESTAMP, int64, native_int64,
     [](const tofgraph_metadata& m) { return Element{.integer = m.timestamp_ns}; },
     [](tofgraph_metadata& m, Element e) { m.timestamp_ns = e.integer; }},
    {"integration_time_s", true, TOFGRAPH_KNOWS_INTEGRATION_TIME, float64, native_double,
     [](const tofgraph_metadata& m) { return Element{.number = m.integration_time}; },
     [](tofgraph_metadata& m, Element e) { m.integration_time = e.number; }},
    {"modulation_frequency_hz", true, TOFGRAPH_KNOWS_MODULATION_FREQUENCY, float64, native_double,
     [](const tofgraph_metadata& m) { return Element{.number = m.modulation_frequency}; },
     [](tofgraph_metadata& m, Element e) { m.modulation_frequency = e.number; }},
    {"temperature_c", true, TOFGRAPH_KNOWS_TEMPERATURE, float32, native_double,
     [](const tofgraph_metadata& m) { return Element{.number = m.temperature - zero_celsius}; },
     [](tofgraph_metadata& m, Element e) { m.temperature = e.number + zero_celsius; }},
    {"time_since_power_on_s", true, TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON, float64, native_double,
     [](const tofgraph_metadata& m) { return Element{.number = m.time_since_power_on}; },
     [](tofgraph_metadata& m, Element e) { m.time_since_power_on = e.number; }},
    {"frame_number", false, 0, uint64, native_uint64,
     [](const tofgraph_metadata& m) { return Element{.count = m.device_number}; },
     [](tofgraph_metadata& m, Element e) { m.device_number = e.count; }},
};

}  // namespace tofgraph::io::layout
