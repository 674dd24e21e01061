// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Stream along an edge of the graph, known before the first frame.
#pragma once

#include "io/camera.hpp"

#include <tofgraph/effect.h>

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::graph {

/// Words separated by blanks.
std::vector<std::string> split_words(std::string_view text);
std::string join_words(const std::vector<std::string>& words);

/// Channel with its history.
struct Channel {
  std::string name;
  std::uint32_t type = 0, rank = 0;
  std::array<std::uint64_t, 4> extent{};
  std::string unit, of;
  std::vector<std::string> applied;  ///< stages, oldest first
  std::vector<std::string> from;     ///< channels it was computed from, directly or indirectly
  std::size_t made_by = 0;           ///< index of the node that wrote it last

  bool has_applied(std::string_view word) const;
  bool is_from(std::string_view channel) const;
  /// C view; valid until the channel changes. The words are kept in the given strings.
  tofgraph_channel view(std::string& applied_words, std::string& from_words) const;
  static Channel from_view(const tofgraph_channel& view);
  /// "float32 4 x 204 x 204, counts"
  std::string described() const;
};

struct Stream {
  std::vector<Channel> channels;
  io::CameraPtr camera;
  std::size_t camera_made_by = 0;
  std::uint64_t frames = 0;
  std::uint64_t known = 0;
  std::vector<std::size_t> history;          ///< nodes passed by the frames, in order
  std::vector<tofgraph_exposure> exposures;  ///< exposures of the raw images; empty: the camera's
  bool exposures_known = true;               ///< false while a source may still announce them
  std::string source = "{}";                 ///< known origin of the frames, JSON

  void set_camera(io::CameraPtr chosen, std::size_t node) {
    camera = std::move(chosen);
    camera_made_by = node;
  }
  /// The stream's own exposures, or the camera's, or four steps of 90 degrees.
  std::vector<tofgraph_exposure> all_exposures() const;
  /// Adds a channel, or replaces the one of the same name.
  void put(Channel channel);

  /// Returns whether no node has written the channel since the source.
  bool is_from_source(const Channel& channel) const;
  Channel* find(std::string_view name);
  const Channel* find(std::string_view name) const;
};

/// Class of corrections that stages name in `adds`, `needs` and `refuses`: a stage that computes a depth from a
/// distance adds non_linearity and thereby takes part in the check for double corrections. Other words are allowed,
/// without any meaning to the program.
struct Correction {
  std::string_view name;
  std::string_view shown;  ///< used in messages; "": the name
  std::string_view text;
};
inline constexpr Correction known_corrections[] = {
    {"non_linearity", "the bent light path corrected", "a depth or range was computed from the half path"},
    {"offset", "", "offsets by integration time and reflectivity were removed"},
    {"effects", "", "effects of a camera model were undone"},
    {"denoised", "", "filtered in space or time"},
    {"rectified", "", "resampled to an ideal lens"},
    {"T_world_camera", "moved into the world's frame", "points are no longer in the optical frame"},
};

/// Corrections applied to a channel, readable: "optimized_bistatic (the bent light path corrected)".
std::string applied_text(const std::vector<std::string>& applied);

/// Compares a port's shape word by word: a number, or H, W, N. @returns false if the channel's shape differs.
bool fits_shape(const Channel& channel, std::string_view shape);

/// Name of a channel at a named port if the frame has another channel of the same name.
inline std::string alias_of(std::string_view channel, std::string_view port) {
  return std::string(channel).append("@").append(port);
}
inline bool is_alias(std::string_view channel) { return channel.find('@') != std::string_view::npos; }

/// Channel of an output port for the given stream: size, history and unit.
Channel output_channel(const tofgraph_descriptor& stage, const tofgraph_port& port, const Stream& stream,
                       std::size_t node);

/// Channels that a port accepts, in order of preference.
std::vector<std::string> alternatives(const tofgraph_port& port);

/// Extents of a shape for an image of this size; N and unknown sizes are 0.
struct Sizes {
  std::uint64_t height, width, exposures;
};
std::array<std::uint64_t, 4> extents_of(std::string_view shape, const Sizes& sizes, std::uint32_t& rank);

}  // namespace tofgraph::graph
