// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/stream.hpp"

#include "io/border.hpp"

#include <tofgraph/channels.hpp>
#include <tofgraph/physics/exposures.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <utility>

namespace tofgraph::graph {
namespace {

/// Parses a number; nothing for H, W, N.
std::uint64_t fixed_extent(std::string_view word) {
  std::uint64_t number = 0;
  std::from_chars(word.data(), word.data() + word.size(), number);
  return number;
}

}  // namespace

std::vector<std::string> split_words(std::string_view text) {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t end = std::min(text.find(' ', i), text.size());
    if (end > i) words.emplace_back(text.substr(i, end - i));
    i = end + 1;
  }
  return words;
}

std::string join_words(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

bool Channel::has_applied(std::string_view word) const { return std::ranges::find(applied, word) != applied.end(); }
bool Channel::is_from(std::string_view channel) const { return std::ranges::find(from, channel) != from.end(); }

tofgraph_channel Channel::view(std::string& applied_words, std::string& from_words) const {
  applied_words = join_words(applied);
  from_words = join_words(from);
  tofgraph_channel view{};
  view.size = sizeof view;
  view.name = name.c_str();
  view.type = type;
  view.rank = rank;
  std::ranges::copy(extent, view.extent);
  view.unit = unit.c_str();
  view.of = of.c_str();
  view.applied = applied_words.c_str();
  view.from = from_words.c_str();
  return view;
}

Channel Channel::from_view(const tofgraph_channel& given) {
  const tofgraph_channel view = io::host_sized(given);
  if (view.name == nullptr) throw io::PluginDefect("the plugin announced a channel without a name");
  if (view.rank > 4)
    throw io::PluginDefect(fmt::format("the plugin announced '{}' with more than four dimensions", view.name));
  if (view.type > TOFGRAPH_TYPE_I32)
    throw io::PluginDefect(
        fmt::format("the plugin announced '{}' with the invalid element type {}", view.name, view.type));
  const auto text = [](const char* value) { return std::string(value != nullptr ? value : ""); };
  Channel channel;
  channel.name = text(view.name);
  channel.type = view.type;
  channel.rank = view.rank;
  std::ranges::copy(view.extent, channel.extent.begin());
  channel.unit = text(view.unit);
  channel.of = text(view.of);
  channel.applied = split_words(text(view.applied));
  channel.from = split_words(text(view.from));
  return channel;
}

std::string Channel::described() const {
  std::string text = element_name(type);
  for (std::uint32_t i = 0; i < rank; ++i) {
    text += i == 0 ? " " : " x ";
    text += extent[i] != 0 ? fmt::format("{}", extent[i]) : "?";
  }
  return unit.empty() ? text : text + ", " + unit;
}

std::string applied_text(const std::vector<std::string>& applied) {
  std::string text;
  for (const std::string& word : applied) {
    const auto* meaning = std::ranges::find(known_corrections, word, &Correction::name);
    if (meaning == std::end(known_corrections) || meaning->shown.empty())
      text += (text.empty() ? "" : ", ") + word;
    else
      text += text.empty() ? std::string(meaning->shown) : fmt::format(" ({})", meaning->shown);
  }
  return text;
}

std::vector<tofgraph_exposure> Stream::all_exposures() const {
  if (!exposures.empty()) return exposures;
  return camera ? physics::exposures_of(camera->view()) : physics::exposures_of(tofgraph_camera{});
}

bool Stream::is_from_source(const Channel& channel) const {
  return !history.empty() && channel.made_by == history.front();
}

void Stream::put(Channel channel) {
  if (Channel* existing = find(channel.name))
    *existing = std::move(channel);
  else
    channels.push_back(std::move(channel));
}

const Channel* Stream::find(std::string_view name) const {
  const auto found = std::ranges::find(channels, name, &Channel::name);
  return found == channels.end() ? nullptr : &*found;
}

Channel* Stream::find(std::string_view name) { return const_cast<Channel*>(std::as_const(*this).find(name)); }

bool fits_shape(const Channel& channel, std::string_view shape) {
  const std::vector<std::string> words = split_words(shape);
  if (words.empty() || channel.rank == 0) return true;
  if (words.size() != channel.rank) return false;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::uint64_t wanted = fixed_extent(words[i]);
    if (wanted != 0 && channel.extent[i] != 0 && channel.extent[i] != wanted) return false;
  }
  return true;
}

std::array<std::uint64_t, 4> extents_of(std::string_view shape, const Sizes& sizes, std::uint32_t& rank) {
  std::array<std::uint64_t, 4> extent{};
  const std::vector<std::string> words = split_words(shape);
  rank = static_cast<std::uint32_t>(std::min<std::size_t>(words.size(), 4));
  for (std::uint32_t i = 0; i < rank; ++i)
    extent[i] = words[i] == "H"   ? sizes.height
                : words[i] == "W" ? sizes.width
                : words[i] == "P" ? sizes.exposures
                                  : fixed_extent(words[i]);
  return extent;
}

std::vector<std::string> alternatives(const tofgraph_port& port) {
  std::string text = port.channel;
  std::ranges::replace(text, '|', ' ');
  return split_words(text);
}

Channel output_channel(const tofgraph_descriptor& stage, const tofgraph_port& port, const Stream& stream,
                       std::size_t node) {
  Channel channel;
  channel.name = port.channel;
  channel.type = port.type;
  channel.unit = port.unit;
  channel.of = port.of;
  channel.made_by = node;
  Sizes sizes{stream.camera ? stream.camera->view().height : 0, stream.camera ? stream.camera->view().width : 0,
              stream.exposures_known ? stream.all_exposures().size() : 0};
  for (std::uint64_t i = 0; i < stage.port_count; ++i) {  // the size of the input
    const tofgraph_port& input = stage.ports[i];
    const Channel* read =
        input.direction == TOFGRAPH_DIRECTION_OUT ? nullptr : stream.find(alternatives(input).front());
    const std::vector<std::string> shape = split_words(input.shape);
    if (read == nullptr || read->rank != shape.size()) continue;
    for (std::size_t k = 0; k < shape.size(); ++k) {
      if (shape[k] == "H") sizes.height = read->extent[k];
      if (shape[k] == "W") sizes.width = read->extent[k];
      if (shape[k] == "P") sizes.exposures = read->extent[k];
    }
    break;
  }
  channel.extent = extents_of(port.shape, sizes, channel.rank);
  channel.from = split_words(port.from);
  const std::vector<std::string> direct = channel.from;
  for (const std::string& source : direct) {
    const Channel* parent = stream.find(source);
    if (parent == nullptr) continue;
    if (channel.applied.empty()) channel.applied = parent->applied;
    for (const std::string& word : parent->from) {
      if (!channel.is_from(word)) channel.from.push_back(word);
    }
  }
  channel.applied.emplace_back(stage.name);
  std::ranges::copy(split_words(port.adds), std::back_inserter(channel.applied));
  return channel;
}

}  // namespace tofgraph::graph
