// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "live/encoding.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace tofgraph::live {

static_assert(std::endian::native == std::endian::little);

Coding coding_of(std::span<const float> values) {
  constexpr float largest = std::numeric_limits<float>::max();
  float low = largest, high = -largest;
  for (const float v : values) {  // also false for NaN
    low = v < low && v >= -largest ? v : low;
    high = v > high && v <= largest ? v : high;
  }
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

void append_codes(std::string& bytes, std::span<const float> values, const Coding& coding) {
  const std::size_t begin = bytes.size();
  bytes.resize(begin + values.size() * 2);
  char* const out = bytes.data() + begin;
  const auto offset = static_cast<float>(coding.offset), scale = static_cast<float>(1 / coding.step);
  for (std::size_t i = 0; i < values.size(); ++i) {  // without branches, for vector instructions
    const float code = (values[i] - offset) * scale + 1.5F;
    const float known = code >= 1 && code < 65536 ? code : 0;  // NaN: 0
    const auto whole = static_cast<std::uint16_t>(static_cast<std::int32_t>(known));
    std::memcpy(out + 2 * i, &whole, 2);
  }
}

std::vector<float> along_rays(const Plane& points, const NodeInfo& node) {
  if (node.rays == nullptr || points.rows != node.rows || points.columns != node.columns) return {};
  std::vector<float> lengths(points.rows * points.columns);
  float max_error = 0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const float* p = points.values.data() + 3 * i;
    const float* ray = node.rays + 3 * i;
    const float length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    lengths[i] = length;
    const float away =
        std::abs(p[0] - length * ray[0]) + std::abs(p[1] - length * ray[1]) + std::abs(p[2] - length * ray[2]);
    max_error = away > max_error ? away : max_error;  // NaN: skipped
  }
  if (max_error > 1e-4F) lengths.clear();
  return lengths;
}

}  // namespace tofgraph::live
