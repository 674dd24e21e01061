// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The standard channels, the rules for their values, and the bits of `flags`.
#pragma once

#include <tofgraph/plugin.h>

#include <cmath>
#include <cstdint>
#include <string_view>

namespace tofgraph {

/// Entry of the table of channels. TOFGRAPH_TYPE_ANY: several types are allowed.
struct ChannelInfo {
  const char* name;
  const char* shape;
  std::uint32_t type;
  const char* unit;
  const char* text;
};

inline constexpr ChannelInfo known_channels[] = {
    {"taps", "P 2 H W", TOFGRAPH_TYPE_U16, "counts", "A and B tap of the exposures"},
    {"phases", "P H W", TOFGRAPH_TYPE_ANY, "counts",
     "c_k = A_k - B_k = amplitude cos(Psi + theta_k), one per exposure"},
    {"distance", "H W", TOFGRAPH_TYPE_F32, "m", "half of the travelled path"},
    {"range", "H W", TOFGRAPH_TYPE_F32, "m", "straight distance from the optical centre"},
    {"depth", "H W", TOFGRAPH_TYPE_F32, "m", "along z from the sensor plane"},
    {"amplitude", "H W", TOFGRAPH_TYPE_F32, "counts", "A of c_k = A cos"},
    {"intensity", "H W", TOFGRAPH_TYPE_F32, "counts", "mean of the tap samples"},
    {"sigma", "H W", TOFGRAPH_TYPE_F32, "m", "standard deviation of a length"},
    {"flags", "H W", TOFGRAPH_TYPE_U16, "", "what is wrong with a pixel, as bits"},
    {"points", "H W 3", TOFGRAPH_TYPE_F32, "m", "optical frame: x right, y down, z forward"},
    {"true_depth", "H W", TOFGRAPH_TYPE_F32, "m", "in simulations: the depth without any error"},
    {"reflectivity", "H W", TOFGRAPH_TYPE_F32, "", "in simulations: that of the surface, 0 .. 1"},
    {"rays", "H W 3", TOFGRAPH_TYPE_F32, "", "unit vector of each pixel in the optical frame"},
};

/// Entry of a channel, or null for a non-standard channel.
constexpr const ChannelInfo* known_channel(std::string_view name) {
  for (const auto& channel : known_channels)
    if (name == channel.name) return &channel;
  return nullptr;
}

/// Largest length accepted, m. Larger values are markers or corrupt data.
inline constexpr float max_length = 1e6F;

/// Rule for lengths, shared by readers, stages and sinks: positive, finite and at most max_length. Zero and negative
/// values mark pixels without a measurement.
constexpr bool is_valid_length(float length) {
  return static_cast<int>(length > 0) & static_cast<int>(length <= max_length);
}

/// Measured lengths among the standard channels. `sigma` is a length too, but may be NaN at a valid pixel.
constexpr bool is_length_channel(std::string_view name) {
  return name == "distance" || name == "range" || name == "depth" || name == "points";
}

/// Returns whether vectors (points, normals) are given in another frame than the camera's, e.g. the world's.
/// @param applied their processing history, as in tofgraph_channel::applied
constexpr bool is_moved(std::string_view applied) {
  return applied.find("T_world_camera") != std::string_view::npos ||
         applied.find("transform") != std::string_view::npos;
}

/// Rule for points (x, y, z in m): bounded coordinates. In the optical frame a coordinate is at most max_length and the
/// origin means no measurement; world coordinates may be as large as those of a map of the Earth.
class PointRule {
 public:
  /// @param applied processing history of the points, as in tofgraph_channel::applied
  explicit PointRule(std::string_view applied) : moved_(is_moved(applied)) {}
  bool is_valid(const float* point) const {
    const float most = moved_ ? max_coordinate : max_length;
    const float x = std::abs(point[0]), y = std::abs(point[1]), z = std::abs(point[2]);
    return x <= most && y <= most && z <= most && (moved_ || x > 0 || y > 0 || z > 0);
  }

 private:
  static constexpr float max_coordinate = 1e8F;  // m
  bool moved_;
};

/// Bits of the channel `flags`. An invalid pixel is NaN in every length channel and has `invalid` set.
namespace flag {
inline constexpr std::uint16_t invalid = 1, saturated = 2, inconsistent = 4, low_signal = 8, wrapped = 16, mixed = 32,
                               outside_lens = 64, user = 128, extrapolated = 256, filled = 512, bad_pixel = 1024;
}  // namespace flag

}  // namespace tofgraph
