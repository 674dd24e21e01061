// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A frame: a set of channels whose buffers are shared until somebody writes.
#pragma once

#include "graph/buffer.hpp"

#include <tofgraph/plugin.h>

#include <deque>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Frame of the plugin interface.
struct tofgraph_frame {
  struct Channel {
    std::string name, unit;
    std::uint32_t type = 0, rank = 0;
    std::uint64_t extent[4] = {};
    tofgraph::graph::BufferRef buffer;  ///< empty: the slot is free, its strings are kept for the next frame
  };

  std::deque<Channel> channels;  ///< views point to the strings in here, so that none may move
  /// Buffers that a stage replaced while it may still hold views of them. A view lives until `process` returns.
  std::vector<tofgraph::graph::BufferRef> replaced;
  tofgraph_metadata metadata{};
  tofgraph::graph::BufferPool* pool = nullptr;

  Channel* find(std::string_view name);
  const Channel* find(std::string_view name) const;
  /// A channel of that name: the existing one or a free slot.
  Channel& slot(std::string_view name);
  /// Another buffer, or none, under a channel's name; the old one stays until views_ended().
  void replace(Channel& channel, tofgraph::graph::BufferRef buffer);
  /// The stage returned: no view of it is left.
  void views_ended() { replaced.clear(); }
  /// Gives the buffers back; memory of the slots is kept.
  void clear();
  /// Adds the channels of another frame that this one does not have. @param aliases names, and those that they get
  void merge(const tofgraph_frame& other, const std::vector<std::pair<std::string, std::string>>& aliases);
};

namespace tofgraph::graph {

/// Bytes that a channel of these extents takes. @throws std::length_error beyond 64 GiB.
std::size_t channel_bytes(std::uint32_t type, std::uint32_t rank, const std::uint64_t* extent);

/// A view of a channel.
tofgraph_view view_of(const tofgraph_frame::Channel& channel);

/// The frame calls of the host's table.
void fill_frame_calls(tofgraph_host& host);

}  // namespace tofgraph::graph
