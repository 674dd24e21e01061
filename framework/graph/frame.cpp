// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/frame.hpp"

#include "graph/instance.hpp"
#include "graph/validation.hpp"
#include "io/border.hpp"

#include <tofgraph/array.hpp>

#include <algorithm>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

using tofgraph::graph::BufferPool;
using tofgraph::graph::channel_bytes;
using tofgraph::graph::view_of;

const tofgraph_frame::Channel* tofgraph_frame::find(std::string_view name) const {
  for (const Channel& channel : channels) {
    if (channel.buffer && channel.name == name) return &channel;
  }
  return nullptr;
}

tofgraph_frame::Channel* tofgraph_frame::find(std::string_view name) {
  return const_cast<Channel*>(std::as_const(*this).find(name));
}

tofgraph_frame::Channel& tofgraph_frame::slot(std::string_view name) {
  Channel* free = nullptr;
  for (Channel& channel : channels) {
    if (channel.name == name) return channel;
    if (!channel.buffer) free = &channel;
  }
  if (free == nullptr) free = &channels.emplace_back();
  free->name = name;
  return *free;
}

void tofgraph_frame::replace(Channel& channel, tofgraph::graph::BufferRef buffer) {
  if (channel.buffer) replaced.push_back(std::move(channel.buffer));
  channel.buffer = std::move(buffer);
}

void tofgraph_frame::clear() {
  views_ended();
  for (Channel& channel : channels) channel.buffer = {};
}

void tofgraph_frame::merge(const tofgraph_frame& other,
                           const std::vector<std::pair<std::string, std::string>>& aliases) {
  for (const Channel& channel : other.channels) {
    if (!channel.buffer || find(channel.name) != nullptr) continue;
    Channel& mine = slot(channel.name);
    mine = channel;
  }
  for (const auto& [name, alias] : aliases) {
    const Channel* channel = other.find(name);
    if (channel == nullptr) continue;
    Channel& mine = slot(alias);
    mine = *channel;
    mine.name = alias;
  }
}

namespace tofgraph::graph {
namespace {

/// Runs a host call; no exception may cross the C interface.
template <class Call> int guarded(Call&& call) noexcept {
  try {
    return call() ? TOFGRAPH_STATUS_OK : TOFGRAPH_STATUS_ERROR;
  } catch (...) {
    keep_failure();
  }
  return TOFGRAPH_STATUS_ERROR;
}

/// Reports a call that a plugin must not make.
bool refuse(const std::string& why) { throw io::PluginDefect(why); }

template <class... Pointers> void not_null(const char* call, const Pointers*... given) {
  if (((given == nullptr) || ...)) throw io::PluginDefect(std::string("the plugin gave null to ") + call);
}

/// Copies as much of a view as the struct of the other side holds.
bool fill(tofgraph_view* view, const tofgraph_frame::Channel& channel) {
  const std::uint32_t size = view->size;
  if (size < tofgraph::io::first_size<tofgraph_view>)
    return refuse("the view for channel '" + channel.name + "' has no size: set it before the call");
  const tofgraph_view full = view_of(channel);
  std::memcpy(view, &full, std::min<std::size_t>(size, sizeof full));
  view->size = size;
  return true;
}

int read(tofgraph_frame* frame, const char* name, tofgraph_view* view) {
  return guarded([&] {
    not_null("read()", frame, name, view);
    const auto* channel = frame->find(name);
    if (channel == nullptr || !fill(view, *channel)) return false;
    if (Validation* validation = Validation::current()) validation->shown(*channel);
    return true;
  });
}

int write(tofgraph_frame* frame, const tofgraph_channel* given, tofgraph_view* view) {
  return guarded([&] {
    not_null("write()", frame, given, view);
    const tofgraph_channel channel_made = tofgraph::io::host_sized(*given);
    const tofgraph_channel* made = &channel_made;
    if (made->name == nullptr) return refuse("a channel without a name cannot be written");
    if (made->rank < 1 || made->rank > 4 || element_size(made->type) == 0)
      return refuse("channel '" + std::string(made->name) + "' was to be written with " + std::to_string(made->rank) +
                    " dimensions of type " + element_name(made->type) + ", expected one to four of a type");
    const std::size_t bytes = channel_bytes(made->type, made->rank, made->extent);
    auto& channel = frame->slot(made->name);
    if (!channel.buffer || !may_write(channel.buffer) || channel.buffer.capacity() < bytes)
      frame->replace(channel, buffer_to_write(*frame, bytes, channel.name));
    channel.unit = made->unit != nullptr ? made->unit : "";
    channel.type = made->type;
    channel.rank = made->rank;
    std::copy_n(made->extent, 4, channel.extent);
    return fill(view, channel);
  });
}

int modify(tofgraph_frame* frame, const char* name, tofgraph_view* view) {
  return guarded([&] {
    not_null("modify()", frame, name, view);
    auto* channel = frame->find(name);
    if (channel == nullptr) return false;
    if (!may_write(channel->buffer)) {
      const std::size_t bytes = channel_bytes(channel->type, channel->rank, channel->extent);
      BufferRef own = buffer_to_write(*frame, bytes, channel->name);
      std::memcpy(own.data(), channel->buffer.data(), bytes);
      frame->replace(*channel, std::move(own));
    }
    return fill(view, *channel);
  });
}

int share(tofgraph_frame* frame, const tofgraph_view* given, void* owner, void (*release)(void*)) {
  return guarded([&] {
    not_null("share()", frame, given);
    const tofgraph_view shared = tofgraph::io::host_sized(*given);
    const tofgraph_view* view = &shared;
    if (view->rank < 1 || view->rank > 4 || element_size(view->type) == 0 || view->data == nullptr ||
        view->channel == nullptr)
      return refuse("what is shared needs data, a channel, a type and one to four dimensions");
    auto stride = static_cast<std::int64_t>(element_size(view->type));
    for (std::uint32_t i = view->rank; i-- > 0;) {
      if (view->stride[i] != stride) return refuse("what is shared has gaps");
      stride *= static_cast<std::int64_t>(view->extent[i]);
    }
    const std::size_t bytes = channel_bytes(view->type, view->rank, view->extent);
    auto& channel = frame->slot(view->channel);
    frame->replace(channel, BufferPool::lent(view->data, bytes, owner, release));
    channel.unit = view->unit != nullptr ? view->unit : "";
    channel.type = view->type;
    channel.rank = view->rank;
    std::copy_n(view->extent, 4, channel.extent);
    return true;
  });
}

int drop(tofgraph_frame* frame, const char* name) {
  return guarded([&] {
    not_null("drop()", frame, name);
    auto* channel = frame->find(name);
    if (channel != nullptr) frame->replace(*channel, {});
    return channel != nullptr;
  });
}

int rename(tofgraph_frame* frame, const char* name, const char* other) {
  return guarded([&] {
    not_null("rename()", frame, name, other);
    auto* channel = frame->find(name);
    if (channel == nullptr || frame->find(other) != nullptr) return false;
    auto& renamed = frame->slot(other);
    const std::string kept = renamed.name;
    renamed = *channel;
    renamed.name = kept;
    channel->buffer = {};
    return true;
  });
}

tofgraph_metadata* metadata(tofgraph_frame* frame) { return &frame->metadata; }

}  // namespace

std::size_t channel_bytes(std::uint32_t type, std::uint32_t rank, const std::uint64_t* extent) {
  constexpr std::size_t most = std::size_t{64} << 30U;
  std::size_t bytes = element_size(type);
  for (std::uint32_t i = 0; i < rank; ++i) {
    if (extent[i] != 0 && bytes > most / extent[i]) throw std::length_error("a channel of more than 64 GiB");
    bytes *= extent[i];
  }
  return bytes;
}

tofgraph_view view_of(const tofgraph_frame::Channel& channel) {
  tofgraph_view view{};
  view.size = sizeof view;
  view.data = channel.buffer.data();
  view.type = channel.type;
  view.rank = channel.rank;
  view.channel = channel.name.c_str();
  view.unit = channel.unit.c_str();
  auto stride = static_cast<std::int64_t>(element_size(channel.type));
  for (std::uint32_t i = channel.rank; i-- > 0;) {
    view.extent[i] = channel.extent[i];
    view.stride[i] = stride;
    stride *= static_cast<std::int64_t>(channel.extent[i]);
  }
  return view;
}

void fill_frame_calls(tofgraph_host& host) {
  host.read = read;
  host.write = write;
  host.modify = modify;
  host.share = share;
  host.drop = drop;
  host.rename = rename;
  host.metadata = metadata;
}

}  // namespace tofgraph::graph
