// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "live/encoding.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace tofgraph::live {

static_assert(std::endian::native == std::endian::little);

namespace {

constexpr std::size_t lanes = 16;  // values at a time: loops of this length become vector instructions

/// Smallest and largest finite value; the first is greater if there is none.
std::pair<float, float> range_of(std::span<const float> values) {
  constexpr float largest = std::numeric_limits<float>::max();
  std::array<float, lanes> low, high;
  low.fill(largest);
  high.fill(-largest);
  const auto add = [&](std::size_t lane, float v) {  // comparisons are false for NaN
    const float above = v >= -largest ? v : largest, below = v <= largest ? v : -largest;
    low[lane] = above < low[lane] ? above : low[lane];
    high[lane] = below > high[lane] ? below : high[lane];
  };
  std::size_t i = 0;
  for (; i + lanes <= values.size(); i += lanes)
    for (std::size_t lane = 0; lane < lanes; ++lane) add(lane, values[i + lane]);
  for (; i < values.size(); ++i) add(0, values[i]);
  return {*std::ranges::min_element(low), *std::ranges::max_element(high)};
}

using Bytes = boost::container::vector<char>;

/// Appends uninitialised memory, a multiple of 8 bytes. @returns its position
std::size_t extend(Bytes& bytes, std::size_t size) {
  const std::size_t at = bytes.size();
  bytes.resize(at + (size + 7) / 8 * 8, boost::container::default_init);
  std::memset(bytes.data() + at + size, 0, bytes.size() - at - size);
  return at;
}

template <class T> std::size_t append(Bytes& bytes, std::span<const T> values) {
  const std::size_t at = extend(bytes, values.size_bytes());
  std::ranges::copy(std::as_bytes(values), reinterpret_cast<std::byte*>(bytes.data() + at));
  return at;
}

nlohmann::json append_numbers(Bytes& bytes, std::span<const float> values) {
  const Coding coding = coding_of(values);
  const std::size_t at = extend(bytes, 2 * values.size());
  write_codes(bytes.data() + at, values, coding);
  return {{"at", at}, {"type", "codes"}, {"offset", coding.offset}, {"step", coding.step}};
}

/// Appends the values of a channel. @returns their position, type and coding
nlohmann::json append_plane(Bytes& bytes, const PlaneView& plane, const NodeInfo& node) {
  if (!plane.bits.empty()) return {{"at", append(bytes, plane.bits)}, {"type", "bits"}};
  if (plane.depth != 3) return append_numbers(bytes, plane.values);
  const std::vector<float> lengths = along_rays(plane, node);
  if (lengths.empty()) return {{"at", append(bytes, plane.values)}, {"type", "points"}};
  nlohmann::json points = append_numbers(bytes, lengths);
  points["type"] = "along_rays";
  return points;
}

}  // namespace

Coding coding_of(std::span<const float> values) {
  const auto [low, high] = range_of(values);
  if (low > high) return {};
  const double from = std::min(0.0, static_cast<double>(low));
  const double min_step = std::max((static_cast<double>(high) - from) / 65532, 1e-9);
  const double decade = std::pow(10.0, std::floor(std::log10(min_step)));
  double step = 10 * decade;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * decade >= min_step) step = factor * decade;
  }
  return {std::floor(from / step) * step, step};
}

void write_codes(char* bytes, std::span<const float> values, const Coding& coding) {
  const auto offset = static_cast<float>(coding.offset), scale = static_cast<float>(1 / coding.step);
  for (std::size_t i = 0; i < values.size(); ++i) {  // without branches, for vector instructions
    const float code = (values[i] - offset) * scale + 1.5F;
    const float known = code >= 1 && code < 65536 ? code : 0;  // NaN: 0
    const auto whole = static_cast<std::uint16_t>(static_cast<std::int32_t>(known));
    std::memcpy(bytes + 2 * i, &whole, 2);
  }
}

std::vector<float> along_rays(const PlaneView& points, const NodeInfo& node) {
  if (node.rays == nullptr || points.rows != node.rows || points.columns != node.columns) return {};
  std::vector<float> lengths(points.rows * points.columns);
  std::array<float, lanes> max_error{};
  const auto measure = [&](std::size_t lane, std::size_t i) {
    const float* p = points.values.data() + 3 * i;
    const float* ray = node.rays + 3 * i;
    const float length = p[0] * ray[0] + p[1] * ray[1] + p[2] * ray[2];
    lengths[i] = length;
    const float away =
        std::abs(p[0] - length * ray[0]) + std::abs(p[1] - length * ray[1]) + std::abs(p[2] - length * ray[2]);
    max_error[lane] = away > max_error[lane] ? away : max_error[lane];  // NaN: skipped
  };
  std::size_t i = 0;
  for (; i + lanes <= lengths.size(); i += lanes)
    for (std::size_t lane = 0; lane < lanes; ++lane) measure(lane, i + lane);
  for (; i < lengths.size(); ++i) measure(0, i);
  if (*std::ranges::max_element(max_error) > 1e-4F) lengths.clear();
  return lengths;
}

CodedChannels coded_channels(std::span<const PlaneView> planes, const NodeInfo& node) {
  CodedChannels coded{nlohmann::json::array(), {}};
  std::size_t expected = 0;
  for (const PlaneView& plane : planes)
    expected += plane.rows * plane.columns * (plane.depth == 3 ? 3 * sizeof(float) : 2) + 8;
  coded.bytes.reserve(expected);
  for (const PlaneView& plane : planes) {
    nlohmann::json channel = append_plane(coded.bytes, plane, node);
    channel.update({{"name", plane.name}, {"unit", plane.unit}, {"rows", plane.rows}, {"columns", plane.columns}});
    coded.descriptions.push_back(std::move(channel));
  }
  return coded;
}

}  // namespace tofgraph::live
