// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/bad_pixels.hpp"

#include <tofgraph/channels.hpp>

#include <algorithm>
#include <cstring>
#include <limits>

namespace tofgraph::graph {
namespace {

/// Returns whether a channel holds measured lengths. The ground truth of a simulation is kept at bad pixels.
bool is_length_channel(const tofgraph_frame::Channel& channel) {
  return channel.type == TOFGRAPH_TYPE_F32 && channel.unit == "m" && channel.name != "true_depth";
}

/// Returns the data of a channel for writing, copied first if another frame shares the buffer.
void* own_data(tofgraph_frame& frame, tofgraph_frame::Channel& channel) {
  if (!channel.buffer.unique()) {
    const std::size_t bytes = channel_bytes(channel.type, channel.rank, channel.extent);
    BufferRef own = frame.pool->get(bytes);
    std::memcpy(own.data(), channel.buffer.data(), bytes);
    frame.replace(channel, std::move(own));
  }
  return channel.buffer.data();
}

}  // namespace

BadPixels::BadPixels(Stream& stream, std::size_t node) {
  if (!stream.camera || stream.camera->bad_pixels.empty()) return;
  rows_ = stream.camera->view().height;
  columns_ = stream.camera->view().width;
  for (std::size_t i = 0; i < rows_ * columns_; ++i)
    if (stream.camera->is_bad(i)) pixels_.push_back(i);
  if (pixels_.empty() || stream.find("flags") != nullptr) return;
  Channel flags;
  flags.name = "flags";
  flags.type = TOFGRAPH_TYPE_U16;
  flags.rank = 2;
  flags.extent = {rows_, columns_, 0, 0};
  flags.made_by = node;
  stream.channels.push_back(std::move(flags));
}

void BadPixels::mark(tofgraph_frame& frame) const {
  const auto is_image = [&](const tofgraph_frame::Channel& c) {
    return c.rank >= 2 && c.extent[0] == rows_ && c.extent[1] == columns_;
  };
  tofgraph_frame::Channel& flags = frame.slot("flags");
  if (!flags.buffer) {
    flags.unit.clear();
    flags.type = TOFGRAPH_TYPE_U16;
    flags.rank = 2;
    std::ranges::copy(std::array<std::uint64_t, 4>{rows_, columns_, 0, 0}, flags.extent);
    const std::size_t bytes = channel_bytes(flags.type, flags.rank, flags.extent);
    flags.buffer = frame.pool->get(bytes);
    std::memset(flags.buffer.data(), 0, bytes);
  }
  if (flags.type == TOFGRAPH_TYPE_U16 && is_image(flags)) {
    auto* bits = static_cast<std::uint16_t*>(own_data(frame, flags));
    for (const std::size_t i : pixels_) bits[i] |= flag::bad_pixel | flag::invalid;
  }
  for (tofgraph_frame::Channel& channel : frame.channels) {
    if (!channel.buffer || !is_length_channel(channel) || !is_image(channel)) continue;
    const std::size_t each = channel.rank > 2 ? channel.extent[2] : 1;
    auto* values = static_cast<float*>(own_data(frame, channel));
    for (const std::size_t i : pixels_) std::fill_n(values + i * each, each, std::numeric_limits<float>::quiet_NaN());
  }
}

}  // namespace tofgraph::graph
