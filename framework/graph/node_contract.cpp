// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Checks the ports of a node against the channels of its input: meaning, and which it may read, change and create.
#include "graph/known_stages.hpp"
#include "graph/node.hpp"

#include <tofgraph/array.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <span>

namespace tofgraph::graph {
namespace {

std::string joined(const std::vector<std::string>& words, const char* separator) {
  return fmt::format("{}", fmt::join(words, separator));
}

std::string names_of(const Stream& stream) {
  std::vector<std::string> names;
  for (const Channel& channel : stream.channels) {
    if (channel.name != "rays" && !is_alias(channel.name)) names.push_back(channel.name);
  }
  return names.empty() ? "nothing" : joined(names, ", ");
}

/// "4 x 2 x 132 x 176": a port's shape with the known sizes.
std::string shape_text(const tofgraph_port& port, const Stream& stream) {
  std::string text;
  for (const std::string& word : split_words(port.shape)) {
    const tofgraph_camera* camera = stream.camera ? &stream.camera->view() : nullptr;
    const std::string size = word == "H" && camera != nullptr   ? fmt::format("{}", camera->height)
                             : word == "W" && camera != nullptr ? fmt::format("{}", camera->width)
                             : word == "P"                      ? fmt::format("{}", stream.all_exposures().size())
                                                                : word;
    text += (text.empty() ? "" : " x ") + size;
  }
  return text;
}

/// Reason why no stage can compute a missing channel from the input.
std::string why_no_way(const std::vector<std::string>& wanted, const Stream& stream, const std::string& node) {
  if (std::ranges::find(wanted, "distance") == wanted.end()) return {};
  for (const char* name : {"range", "depth", "points"}) {
    if (stream.find(name) == nullptr) continue;
    return fmt::format(
        "'distance' is half of the travelled path, '{}' no longer is: the bent light path has been "
        "corrected already, take '{}' out",
        name, node);
  }
  return {};
}

}  // namespace

bool Node::bind(const Stream& stream, std::vector<const Channel*>& bound, config::Diagnostics& diagnostics) const {
  const std::string wanted = values_.text_of("channel");
  bool right = true;
  for (std::uint64_t i = 0; i < stage().port_count; ++i) {
    const tofgraph_port& port = stage().ports[i];
    bound.push_back(nullptr);
    if (port.direction == TOFGRAPH_DIRECTION_OUT || (port.flags & TOFGRAPH_PORT_EVERY) != 0) continue;
    const std::vector<std::string> names = alternatives(port);
    const bool chosen = names.size() > 1 && std::ranges::find(names, wanted) != names.end();
    for (const std::string& channel : names) {
      if (bound.back() != nullptr || (chosen && channel != wanted)) continue;
      const Channel* own = stream.find(alias_of(channel, port.name));
      bound.back() = own != nullptr ? own : stream.find(channel);
    }
    if (bound.back() != nullptr) {
      right = check_input(stream, port, *bound.back(), diagnostics) && right;
    } else if ((port.flags & TOFGRAPH_PORT_OPTIONAL) == 0) {
      const std::vector<std::string> needed = chosen ? std::vector{wanted} : names;
      diagnostics.error(at,
                        fmt::format("node '{}' ({}) needs {}; what arrives has {}", name, stage().name,
                                    joined(needed, " or "), names_of(stream)),
                        remedy(needed, stream));
      right = false;
    }
  }
  return right;
}

std::string Node::remedy(const std::vector<std::string>& channels, const Stream& stream) const {
  if (channels.front() == "rays")
    return "the rays are those of the camera: --camera NAME, or camera: NAME at the top of the pipeline file";
  if (host_.known_stages == nullptr) return {};
  const std::string way = host_.known_stages->way_to(channels, stream, stage().name);
  return way.empty() ? why_no_way(channels, stream, name) : way;
}

bool Node::check_input(const Stream& stream, const tofgraph_port& port, const Channel& channel,
                       config::Diagnostics& diagnostics) const {
  const auto error = [&](const std::string& text, const std::string& hint = {}) {
    diagnostics.error(at, fmt::format("node '{}' ({}): {}", name, stage().name, text), hint);
    return false;
  };
  if (port.type != TOFGRAPH_TYPE_ANY && channel.type != TOFGRAPH_TYPE_ANY && port.type != channel.type) {
    return error(
        fmt::format("'{}' is {}, expected {}", channel.name, element_name(channel.type), element_name(port.type)));
  }
  if (!fits_shape(channel, port.shape))
    return error(
        fmt::format("'{}' is {}, expected the shape {}", channel.name, channel.described(), shape_text(port, stream)));
  if (*port.unit != 0 && channel.unit != port.unit) {
    return error(fmt::format("'{}' is in {}, expected {}", channel.name,
                             channel.unit.empty() ? "no unit" : channel.unit, port.unit));
  }
  for (const std::string& word : split_words(port.refuses)) {
    if (channel.has_applied(word))
      return error(fmt::format("'{}' already has {} applied", channel.name, word), instead_of(word, channel, stream));
  }
  const std::vector<std::string> needs = split_words(port.needs);
  const bool has_one = std::ranges::any_of(needs, [&](const std::string& word) { return channel.has_applied(word); });
  if (!needs.empty() && !has_one)
    return error(fmt::format("'{}' must go through {} first", channel.name, joined(needs, " or ")));
  if ((port.direction & TOFGRAPH_DIRECTION_OUT) == 0) return true;
  for (const Channel& other : stream.channels) {
    if (!other.is_from(channel.name)) continue;
    return error(fmt::format("changes '{}', but '{}' was already computed from it", channel.name, other.name),
                 stream.is_from_source(other)
                     ? without_recorded(stream, {other.name})
                     : fmt::format("put '{}' before the node that makes '{}'", name, other.name));
  }
  return true;
}

/// Advice on a correction that was applied too early, or twice.
std::string Node::instead_of(const std::string& word, const Channel& channel, const Stream& stream) const {
  const bool same = std::ranges::any_of(std::span(stage().ports, stage().port_count), [&](const tofgraph_port& port) {
    const std::vector<std::string> adds = split_words(port.adds);
    return std::ranges::find(adds, word) != adds.end();
  });
  if (stream.is_from_source(channel)) return fmt::format("the recording has it already: take '{}' out", name);
  if (same || host_.known_stages == nullptr) return "a correction is applied once: remove one of the two";
  for (const std::string& other : channel.applied) {
    const std::vector<std::string> adds = host_.known_stages->added_by(other);
    if (std::ranges::find(adds, word) != adds.end()) return fmt::format("put '{}' before {}", name, other);
  }
  return "remove one of the two";
}

std::vector<std::string> Node::names_made() const {
  std::vector<std::string> names;
  for (const tofgraph_port& port : std::span(stage().ports, stage().port_count)) {
    if (port.direction == TOFGRAPH_DIRECTION_OUT) names.emplace_back(port.channel);
  }
  return names;
}

/// Advice on excluding a conflicting channel of a recording when it is read.
std::string Node::without_recorded(const Stream& stream, const std::vector<std::string>& unwanted) const {
  std::vector<std::string> others;
  for (const Channel& channel : stream.channels) {
    const bool recorded = stream.is_from_source(channel) && channel.name != "rays";
    if (recorded && std::ranges::find(unwanted, channel.name) == unwanted.end()) others.push_back(channel.name);
  }
  return fmt::format("it comes from the source: do not read it there, e.g. capture_reader with {}, or remove '{}'",
                     config::assignment(at, "channels", fmt::format("[{}]", joined(others, ", "))), name);
}

bool Node::check_outputs(const Stream& input, const std::vector<const Channel*>& bound,
                         config::Diagnostics& diagnostics) const {
  bool right = true;
  for (std::uint64_t i = 0; i < stage().port_count; ++i) {
    const tofgraph_port& port = stage().ports[i];
    if (port.direction != TOFGRAPH_DIRECTION_OUT || is_sink()) continue;
    const Channel* existing = input.find(port.channel);
    const bool read_too = std::ranges::any_of(bound, [&](const Channel* c) { return c != nullptr && c == existing; });
    if (existing == nullptr || read_too) continue;
    const std::string how = existing->applied.empty() ? "" : fmt::format(" (by {})", applied_text(existing->applied));
    diagnostics.error(
        at, fmt::format("node '{}' ({}) makes '{}', which already exists{}", name, stage().name, port.channel, how),
        input.is_from_source(*existing)
            ? without_recorded(input, names_made())
            : "a correction is applied only once: remove one, or let each read its own node with " +
                  config::assignment(at, "inputs", "[...]"));
    right = false;
  }
  return right;
}

void Node::announce_outputs(const std::vector<const Channel*>& bound) {
  for (std::uint64_t i = 0; i < stage().port_count; ++i) {
    const tofgraph_port& port = stage().ports[i];
    const bool every = (port.flags & TOFGRAPH_PORT_EVERY) != 0;
    if (is_sink() || port.direction == TOFGRAPH_DIRECTION_IN) continue;
    if (port.direction == TOFGRAPH_DIRECTION_OUT) {
      if (every || (port.flags & TOFGRAPH_PORT_OPTIONAL) != 0) continue;
      output_stream_.stream.put(output_channel(stage(), port, output(), index));
      continue;
    }
    for (Channel& channel : output_stream_.stream.channels) {
      if (!every && (bound[i] == nullptr || channel.name != bound[i]->name)) continue;
      channel.made_by = index;
      if (!channel.has_applied(stage().name)) channel.applied.emplace_back(stage().name);
      std::ranges::copy(split_words(port.adds), std::back_inserter(channel.applied));
      if (*port.of != 0) channel.of = port.of;
    }
  }
}

}  // namespace tofgraph::graph
