// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "core/stream.hpp"

#include <tofgraph/array.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <utility>

namespace tofgraph::core {
namespace {

/// A number, or nothing for H, W, N.
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

Channel Channel::from_view(const tofgraph_channel& view) {
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
  static constexpr std::pair<std::string_view, std::string_view> meanings[] = {
      {"non_linearity", "the bent light path corrected"}, {"T_world_camera", "moved into the world's frame"}};
  std::string text;
  for (const std::string& word : applied) {
    const auto* meaning = std::ranges::find(meanings, word, &std::pair<std::string_view, std::string_view>::first);
    if (meaning == std::end(meanings))
      text += (text.empty() ? "" : ", ") + word;
    else
      text += text.empty() ? std::string(meaning->second) : fmt::format(" ({})", meaning->second);
  }
  return text;
}

bool Stream::is_from_source(const Channel& channel) const {
  return !history.empty() && channel.made_by == history.front();
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

std::array<std::uint64_t, 4> extents_of(std::string_view shape, std::uint64_t height, std::uint64_t width,
                                        std::uint32_t& rank) {
  std::array<std::uint64_t, 4> extent{};
  const std::vector<std::string> words = split_words(shape);
  rank = static_cast<std::uint32_t>(std::min<std::size_t>(words.size(), 4));
  for (std::uint32_t i = 0; i < rank; ++i)
    extent[i] = words[i] == "H" ? height : words[i] == "W" ? width : fixed_extent(words[i]);
  return extent;
}

}  // namespace tofgraph::core
