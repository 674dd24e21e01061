// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Doubts about the values read from a foreign file: lengths that are not lengths, codes, dropped bits.
#include "config/log.hpp"
#include "foreign/foreign_frames.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <bit>

namespace tofgraph::foreign {
namespace {

std::string invalid_setting(const std::vector<double>& codes) {
  return fmt::format("--invalid {} (in a layout or a pipeline: invalid: [{}])", fmt::join(codes, ","),
                     fmt::join(codes, ", "));
}

std::string dropped_sentence(const std::string& channel, const DroppedBits& dropped, std::uint64_t mask) {
  std::vector<int> bits;
  for (std::uint64_t rest = dropped.bits; rest != 0; rest &= rest - 1) bits.push_back(std::countr_zero(rest));
  return fmt::format(
      "{} {} of {} words of {} and dropped by mask: {:#06x}; if a bit marks saturated pixels, the "
      "layout states it, e.g. saturated: {:#06x}",
      bits.size() == 1 ? fmt::format("bit {} is set in", bits[0])
                       : fmt::format("bits {} are set in", fmt::join(bits, ", ")),
      dropped.count, dropped.words, channel, mask, std::uint64_t{1} << static_cast<unsigned>(bits.back()));
}

}  // namespace

std::vector<std::string> ForeignFrames::doubts(std::size_t channel) const {
  std::vector<std::string> doubts;
  if (channel >= sources_.size()) return doubts;
  const ChannelValues& seen = values_[channel];
  const ChannelLayout& layout = sources_[channel].layout;
  const std::string& name = channels_[channel].name;
  const std::uint64_t pixels = std::uint64_t{camera().width} * camera().height;
  std::vector<double> codes = layout.invalid;
  if (seen.refused.count > 0) {
    const std::optional<double>& example = seen.refused.example;
    if (example) codes.insert(codes.begin(), *example);  // beside the stated ones, which the option replaces
    doubts.push_back(seen.refused.sentence(name, seen.frames * pixels, config::counted(seen.frames, "frame")) +
                     (example ? "; if they mean invalid pixels, state it, e.g. " + invalid_setting(codes) : ""));
    if (example && seen.refused.zero != seen.refused.count) codes.erase(codes.begin());  // one of several
  }
  for (const auto& [value, count] : seen.codes) codes.push_back(value);
  for (const auto& [value, count] : seen.codes)
    doubts.push_back(
        fmt::format("{} of {} values of {} in {} are {}, probably a code for saturated or invalid pixels "
                    "and not a measurement; {} excludes them",
                    count, seen.examined * sources_[channel].elements, name, config::counted(seen.examined, "frame"),
                    value, invalid_setting(codes)));
  if (seen.dropped.count > 0) doubts.push_back(dropped_sentence(name, seen.dropped, *layout.mask));
  return doubts;
}

}  // namespace tofgraph::foreign
