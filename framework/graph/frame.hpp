// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A frame: a set of channels whose buffers are shared until one is written.
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

  std::deque<Channel> channels;  ///< views point to these strings, so they must not move
  /// Buffers that a stage replaced while it may still hold views of them. Views are valid until `process` returns.
  std::vector<tofgraph::graph::BufferRef> replaced;
  tofgraph_metadata metadata{};
  tofgraph::graph::BufferPool* pool = nullptr;

  Channel* find(std::string_view name);
  const Channel* find(std::string_view name) const;
  /// Returns the channel of that name: the existing one or a free slot.
  Channel& slot(std::string_view name);
  /// Replaces the buffer of a channel, possibly by none; the old one is kept until views_ended().
  void replace(Channel& channel, tofgraph::graph::BufferRef buffer);
  /// Releases replaced buffers after the stage has returned and no views are left.
  void views_ended() { replaced.clear(); }
  /// Returns the buffers; the memory of the slots is kept.
  void clear();
  /// Adds the channels of another frame that this one lacks. @param aliases names and their replacements
  void merge(const tofgraph_frame& other, const std::vector<std::pair<std::string, std::string>>& aliases);
};

namespace tofgraph::graph {

/// Size in bytes of a channel of these extents. @throws std::length_error beyond 64 GiB.
std::size_t channel_bytes(std::uint32_t type, std::uint32_t rank, const std::uint64_t* extent);

/// Returns a view of a channel.
tofgraph_view view_of(const tofgraph_frame::Channel& channel);

/// Frame calls of the host's table.
void fill_frame_calls(tofgraph_host& host);

}  // namespace tofgraph::graph
