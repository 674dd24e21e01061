// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file What flows along an edge of the graph, known before the first frame.
#pragma once

#include "core/camera.hpp"

#include <tofgraph/plugin.h>

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::core {

/// Words separated by blanks.
std::vector<std::string> split_words(std::string_view text);
std::string join_words(const std::vector<std::string>& words);

/// A channel with its history.
struct Channel {
  std::string name;
  std::uint32_t type = 0, rank = 0;
  std::array<std::uint64_t, 4> extent{};
  std::string unit, of;
  std::vector<std::string> applied;  ///< stages, oldest first
  std::vector<std::string> from;     ///< channels it was computed from, directly or not
  std::size_t made_by = 0;           ///< index of the node that wrote it last

  bool has_applied(std::string_view word) const;
  bool is_from(std::string_view channel) const;
  /// The border's view; valid until the channel changes. The words are kept in the given strings.
  tofgraph_channel view(std::string& applied_words, std::string& from_words) const;
  static Channel from_view(const tofgraph_channel& view);
  /// "float32 4 x 204 x 204, counts"
  std::string described() const;
};

struct Stream {
  std::vector<Channel> channels;
  CameraPtr camera;
  std::size_t camera_made_by = 0;
  std::uint64_t frames = 0;
  std::uint64_t known = 0;
  std::vector<std::size_t> history;  ///< nodes that the frames went through, in order

  /// True when no node has written the channel since the source gave it.
  bool is_from_source(const Channel& channel) const;
  Channel* find(std::string_view name);
  const Channel* find(std::string_view name) const;
};

/// What was applied to a channel, for people: "optimized_bistatic (the bent light path corrected)".
std::string applied_text(const std::vector<std::string>& applied);

/// A port's shape word by word: a number, or H, W, N. @returns false when the channel has another one.
bool fits_shape(const Channel& channel, std::string_view shape);

/// The extents of a shape for an image of this size; N and unknown sizes are 0.
std::array<std::uint64_t, 4> extents_of(std::string_view shape, std::uint64_t height, std::uint64_t width,
                                        std::uint32_t& rank);

}  // namespace tofgraph::core
