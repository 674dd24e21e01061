// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/valid_frames.hpp"

#include "config/log.hpp"

#include <tofgraph/channels.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <vector>

namespace tofgraph::graph {
namespace {

struct FlagText {
  std::uint16_t flag;
  const char* text;
};

constexpr FlagText flag_texts[] = {
    {flag::saturated, "saturated (a shorter integration time helps)"},
    {flag::inconsistent, "inconsistent in their samples"},
    {flag::low_signal, "of low signal (more light or a longer integration time helps)"},
    {flag::wrapped, "wrapped"},
    {flag::mixed, "mixed at edges"},
    {flag::outside_lens, "outside the lens model"},
    {flag::user, "removed by a filter"},
    {flag::bad_pixel, "bad pixels"},
};

std::size_t pixels_of(const tofgraph_frame::Channel& channel) { return channel.extent[0] * channel.extent[1]; }

template <class T> std::span<const T> values_of(const tofgraph_frame::Channel& channel) {
  std::size_t count = 1;
  for (std::uint32_t i = 0; i < channel.rank; ++i) count *= channel.extent[i];
  return {static_cast<const T*>(channel.buffer.data()), count};
}

}  // namespace

void ValidFrames::add(std::span<tofgraph_frame* const> frames) {
  if (found_.load(std::memory_order_relaxed)) return;
  const std::scoped_lock lock(mutex_);
  for (const tofgraph_frame* frame : frames) {
    if (examine(*frame)) found_ = true;
  }
  ++frames_;
}

bool ValidFrames::examine(const tofgraph_frame& frame) {
  const tofgraph_frame::Channel* length = nullptr;
  for (const auto& channel : frame.channels) {
    if (channel.buffer && channel.type == TOFGRAPH_TYPE_F32 && is_length_channel(channel.name)) length = &channel;
  }
  if (length == nullptr) return true;
  const std::size_t pixels = pixels_of(*length);
  const tofgraph_frame::Channel* flags = frame.find("flags");
  if (flags == nullptr || !flags->buffer || flags->type != TOFGRAPH_TYPE_U16 || pixels_of(*flags) != pixels) {
    if (std::ranges::any_of(values_of<float>(*length), [](float v) { return v == v; })) return true;
    pixels_ += pixels;
    return false;
  }
  const auto all = values_of<std::uint16_t>(*flags);
  const bool points = length->name == "points";  // coordinates may have any sign
  const auto lengths = points ? std::span<const float>() : values_of<float>(*length);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if ((all[i] & flag::invalid) != 0) continue;
    if (points || !(lengths[i] > max_length)) return true;
    ++too_long_;
  }
  for (const std::uint16_t f : all) {
    for (std::size_t bit = 0; bit < bits; ++bit) flagged_[bit] += (f >> bit) & 1U;
  }
  pixels_ += pixels;
  return false;
}

std::string ValidFrames::reasons() const {
  std::vector<std::pair<double, const char*>> shares;
  for (const FlagText& known : flag_texts) {
    const auto bit = static_cast<std::size_t>(std::countr_zero(known.flag));
    const double share = static_cast<double>(flagged_[bit]) / static_cast<double>(std::max<std::uint64_t>(pixels_, 1));
    if (share >= 0.01) shares.emplace_back(share, known.text);
  }
  std::ranges::stable_sort(shares, [](const auto& a, const auto& b) { return a.first > b.first; });
  if (2 * too_long_ > pixels_)
    return "they are longer than 1000 km: is the unit of the lengths, or of the frequency, right?";
  if (shares.empty()) return "they have no valid length, and no other flag says why";
  std::string text;
  for (const auto& [share, reason] : shares)
    text += fmt::format("{}{:.0f} % are {}", text.empty() ? "" : ", ", 100 * share, reason);
  return text;
}

void judge_frames(const Graph& graph, std::span<const ValidFrames> frames, RunResult& result) {
  std::vector<std::string> invalid, empty;
  const ValidFrames* first = nullptr;
  for (const auto& node : graph.nodes()) {
    const ValidFrames& seen = frames[node->index];
    if (!node->is_sink() || !seen.all_invalid()) continue;
    const std::string name = fmt::format("'{}' ({})", node->name, node->stage().name);
    (seen.all_empty() ? empty : invalid).push_back(name);
    if (!seen.all_empty() && first == nullptr) first = &seen;
  }
  if (first != nullptr)
    result.warnings.push_back(fmt::format("no pixel is valid in {} at {}: {}",
                                          config::counted(first->frames(), "frame"), fmt::join(invalid, ", "),
                                          first->reasons()));
  if (!empty.empty() && result.error.empty())
    result.error = fmt::format("every frame is empty at {}: no point is left", fmt::join(empty, ", "));
}

}  // namespace tofgraph::graph
