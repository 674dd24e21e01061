// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/validation.hpp"

#include <tofgraph/array.hpp>
#include <tofgraph/channels.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <span>
#include <stdexcept>

namespace tofgraph::graph {
namespace {

constexpr std::size_t guard = 4096;  // also detects a row written beyond the end of an image
constexpr std::byte pattern{0xA5};

thread_local Validation* watching = nullptr;
std::atomic<bool> closely{false};

std::size_t hash_of(const void* data, std::size_t bytes) {
  return std::hash<std::string_view>()({static_cast<const char*>(data), bytes});
}

bool untouched(const std::byte* first) {
  return std::all_of(first, first + guard, [](std::byte b) { return b == pattern; });
}

/// Lengths that must be NaN where a pixel is invalid. Channels that are known rather than measured are exempt.
bool is_length(const tofgraph_frame::Channel& channel) {
  const ChannelInfo* known = known_channel(channel.name);
  return known != nullptr && std::string_view(known->unit) == "m" && channel.type == TOFGRAPH_TYPE_F32 &&
         channel.name != "true_depth";
}

/// Pixels of an image that satisfy a condition.
struct Found {
  std::size_t count = 0, first = 0;
  void add(std::size_t pixel) {
    if (count++ == 0) first = pixel;
  }
  std::string at(std::size_t columns) const {
    return fmt::format("at {} pixel{}, the first in row {}, column {}", count, count == 1 ? "" : "s", first / columns,
                       first % columns);
  }
};

/// @param lengths number of values per pixel
void compare(const std::string& name, std::span<const float> lengths, std::span<const std::uint16_t> flags,
             std::size_t columns) {
  const std::size_t each = lengths.size() / flags.size();
  Found unflagged, valued;
  for (std::size_t i = 0; i < flags.size(); ++i) {
    const auto values = lengths.subspan(i * each, each);
    const bool nan = std::ranges::any_of(values, [](float x) { return std::isnan(x); });
    const bool invalid = (flags[i] & flag::invalid) != 0;
    const bool filled = (flags[i] & flag::filled) != 0;  // in one of the lengths; the others may not be affected
    if (nan && !invalid && !filled) unflagged.add(i);
    if (!nan && invalid) valued.add(i);
  }
  if (unflagged.count != 0)
    throw BrokenPromise(fmt::format("'{}' is NaN without the flag 'invalid' {}", name, unflagged.at(columns)));
  if (valued.count != 0)
    throw BrokenPromise(fmt::format("'{}' is a number despite the flag 'invalid' {}", name, valued.at(columns)));
}

}  // namespace

bool validating() { return closely; }
void set_validating() { closely = true; }

Validation::Validation() : before_(watching) { watching = this; }
Validation::~Validation() { watching = before_; }
Validation* Validation::current() { return watching; }

BufferRef Validation::guarded(BufferPool& pool, std::size_t bytes, const std::string& channel) {
  auto whole = std::make_unique<BufferRef>(pool.get(bytes + 2 * guard));
  auto* first = static_cast<std::byte*>(whole->data());
  std::fill_n(first, guard, pattern);
  std::fill_n(first + guard + bytes, guard, pattern);
  given_.push_back({channel, *whole, bytes});
  return BufferPool::lent(first + guard, bytes, whole.release(),
                          [](void* owner) { delete static_cast<BufferRef*>(owner); });
}

bool Validation::gave(const BufferRef& buffer) const {
  const auto* data = static_cast<const std::byte*>(buffer.data());
  return std::ranges::any_of(
      given_, [data](const Given& g) { return static_cast<const std::byte*>(g.whole.data()) + guard == data; });
}

void Validation::shown(const tofgraph_frame::Channel& channel) {
  if (gave(channel.buffer)) return;
  const std::size_t bytes = channel_bytes(channel.type, channel.rank, channel.extent);
  shown_.push_back({channel.name, channel.buffer, bytes, hash_of(channel.buffer.data(), bytes)});
}

void Validation::check_memory() const {
  for (const Given& g : given_) {
    const auto* first = static_cast<const std::byte*>(g.whole.data());
    const bool before = untouched(first), behind = untouched(first + guard + g.bytes);
    if (before && behind) continue;
    throw BrokenPromise(
        fmt::format("the stage wrote {} the memory of '{}'", before ? "beyond the end of" : "before", g.channel));
  }
  for (const Shown& s : shown_) {
    if (hash_of(s.buffer.data(), s.bytes) != s.hash)
      throw BrokenPromise(fmt::format("the stage changed '{}', which it only reads", s.channel));
  }
}

void Validation::check_flags(const tofgraph_frame& frame) {
  const tofgraph_frame::Channel* flags = frame.find("flags");
  if (flags == nullptr || flags->type != TOFGRAPH_TYPE_U16 || flags->rank != 2) return;
  const Array<const std::uint16_t> bits(view_of(*flags));
  for (const tofgraph_frame::Channel& channel : frame.channels) {
    if (!channel.buffer || !is_length(channel) || channel.rank < 2) continue;
    const Array<const float> lengths(view_of(channel));
    const bool same = lengths.rows() == bits.rows() && lengths.columns() == bits.columns();
    if (same && bits.size() != 0) compare(channel.name, lengths.span(), bits.span(), bits.columns());
  }
}

void Validation::check_metadata(const tofgraph_metadata& metadata, std::uint64_t known) {
  const auto need = [&](std::uint64_t bit, const char* name, bool there) {
    if ((known & bit) != 0 && !there)
      throw BrokenPromise(fmt::format("the source announced the frames' {}, but did not set it in this one", name));
  };
  need(TOFGRAPH_KNOWS_INTEGRATION_TIME, "integration time", !std::isnan(metadata.integration_time));
  need(TOFGRAPH_KNOWS_MODULATION_FREQUENCY, "modulation frequency", !std::isnan(metadata.modulation_frequency));
  need(TOFGRAPH_KNOWS_TEMPERATURE, "temperature", !std::isnan(metadata.temperature));
  need(TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON, "time since power on", !std::isnan(metadata.time_since_power_on));
}

BufferRef buffer_to_write(const tofgraph_frame& frame, std::size_t bytes, const std::string& channel) {
  Validation* validation = Validation::current();
  return validation != nullptr ? validation->guarded(*frame.pool, bytes, channel) : frame.pool->get(bytes);
}

bool may_write(const BufferRef& buffer) {
  const Validation* validation = Validation::current();
  return validation != nullptr ? validation->gave(buffer) : buffer.unique();
}

}  // namespace tofgraph::graph
