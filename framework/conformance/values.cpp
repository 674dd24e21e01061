// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "conformance/values.hpp"

#include <tofgraph/array.hpp>
#include <tofgraph/channels.hpp>

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

namespace tofgraph::conformance {
namespace {

using Channel = tofgraph_frame::Channel;

/// Every 17th pixel, or all of them.
bool is_invalid(std::size_t pixel, std::uint64_t seed, Content content) {
  return content == Content::invalid || (pixel + seed) % 17 == 0;
}

/// Tilted board with noise, m.
double length_at(std::size_t pixel, Content content, double noise) {
  if (content == Content::denormal) return 1e-40;
  if (content == Content::huge) return pixel % 2 == 0 ? 9.9e5 : 1e-3;
  return 1 + 0.001 * static_cast<double>(pixel % 600) + 0.01 * noise;
}

double counts_at(std::size_t pixel, Content content, double noise) {
  if (content == Content::denormal) return 1e-40;
  if (content == Content::huge) return pixel % 2 == 0 ? 1e30 : 0;
  return 2000 + 10 * noise + static_cast<double>(pixel % 100);
}

/// Exposure k of four for light reflected at 1 m.
double phase_at(std::size_t exposure, std::size_t pixel, Content content, double noise) {
  const double turn = 0.838 + 0.0005 * static_cast<double>(pixel % 600);
  return counts_at(pixel, content, noise) * std::cos(turn + static_cast<double>(exposure) * std::numbers::pi / 2);
}

void put(const Channel& channel, std::size_t i, double value) {
  void* data = channel.buffer.data();
  const auto as = [&]<class T>(T) {
    using Limits = std::numeric_limits<T>;
    if constexpr (!Limits::is_integer)
      static_cast<T*>(data)[i] = static_cast<T>(value);
    else
      static_cast<T*>(data)[i] =
          static_cast<T>(std::clamp(value, static_cast<double>(Limits::min()), static_cast<double>(Limits::max())));
  };
  switch (channel.type) {
    case TOFGRAPH_TYPE_F32:
      return as(float{});
    case TOFGRAPH_TYPE_F64:
      return as(double{});
    case TOFGRAPH_TYPE_U8:
      return as(std::uint8_t{});
    case TOFGRAPH_TYPE_U16:
      return as(std::uint16_t{});
    case TOFGRAPH_TYPE_I16:
      return as(std::int16_t{});
    default:
      return as(std::int32_t{});
  }
}

std::string written(double value, std::string_view units) {
  const std::string_view unit = units.substr(0, units.find('|'));
  return unit.empty() || unit == "1" ? fmt::format("{:.17g}", value) : fmt::format("{:.17g} {}", value, unit);
}

bool is_number(const tofgraph_parameter& p) {
  return p.kind == TOFGRAPH_KIND_NUMBER || p.kind == TOFGRAPH_KIND_INTEGER;
}

}  // namespace

void fill(Channel& channel, const io::CameraPtr& camera, std::uint64_t seed, Content content) {
  std::mt19937_64 random(seed * 1000003 + std::hash<std::string>()(channel.name));
  std::normal_distribution<double> normal;
  const std::size_t size = graph::channel_bytes(channel.type, channel.rank, channel.extent) /
                           std::max<std::size_t>(element_size(channel.type), 1);
  if (channel.name == "rays" && camera) {
    std::memcpy(channel.buffer.data(), camera->view().rays, size * sizeof(float));
    return;
  }
  const bool stack = channel.name == "phases" || channel.name == "taps";
  const bool is_length = channel.unit == "m" && channel.type == TOFGRAPH_TYPE_F32;
  const std::size_t last = channel.rank > 2 && !stack ? channel.extent[2] : 1;
  std::size_t pixels = 1;  // per image of a stack, which is stored image by image
  for (std::uint32_t i = channel.rank > 2 ? channel.rank - 2 : 0; stack && i < channel.rank; ++i)
    pixels *= channel.extent[i];
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t pixel = stack ? i % std::max<std::size_t>(pixels, 1) : i / std::max<std::size_t>(last, 1);
    const double noise = normal(random);
    double value = counts_at(pixel, content, noise);
    if (channel.name == "flags")
      value = is_invalid(pixel, seed, content) ? flag::invalid : 0;
    else if (channel.name == "sigma")
      value = 0.01 * length_at(pixel, content, 0);
    else if (is_length)
      value = length_at(pixel, content, noise);
    else if (channel.name == "phases")
      value = phase_at(i / pixels, pixel, content, noise);
    else if (channel.name == "taps")
      value = 5000 + (i / pixels % 2 == 0 ? 0.5 : -0.5) * phase_at(i / pixels / 2, pixel, content, noise);
    else if (channel.unit.empty())
      value = 0.5;
    put(channel, i, is_length && is_invalid(pixel, seed, content) ? std::nan("") : value);
  }
}

std::string random_value(const tofgraph_parameter& p, std::mt19937_64& random) {
  std::uniform_real_distribution<double> part(0, 1);
  const std::vector<std::string> words = graph::split_words(p.choices);
  if (p.kind == TOFGRAPH_KIND_BOOL) return part(random) < 0.5 ? "true" : "false";
  if (p.kind == TOFGRAPH_KIND_CHOICE) return words.at(random() % words.size());
  if (!is_number(p)) return {};
  const double low = std::isnan(p.minimum) ? (std::isnan(p.maximum) ? 0 : p.maximum - 1) : p.minimum;
  // Bounds far from zero only catch unit errors, so most values are chosen near the lower one.
  const double high = std::isnan(p.maximum) ? low + 1 : p.maximum;
  const double value = low + (high - low) * std::pow(part(random), 3);
  if (p.kind == TOFGRAPH_KIND_INTEGER)
    return fmt::format("{}", std::llround(std::min(value, low + 64)));  // memory may grow quadratically
  return written(value, p.unit);
}

std::vector<std::string> bounds_of(const tofgraph_parameter& p) {
  std::vector<std::string> bounds;
  for (const double bound : {p.minimum, p.maximum}) {
    if (!is_number(p) || std::isnan(bound) || std::isinf(bound)) continue;
    if (p.kind == TOFGRAPH_KIND_INTEGER && bound > p.minimum + 64) continue;  // memory would be exhausted
    bounds.push_back(p.kind == TOFGRAPH_KIND_INTEGER ? fmt::format("{}", std::llround(bound)) : written(bound, p.unit));
  }
  return bounds;
}

std::vector<std::string> wrong_values(const tofgraph_parameter& p) {
  std::vector<std::string> wrong;
  if (p.kind == TOFGRAPH_KIND_CHOICE) wrong.emplace_back("no_such_word");
  if (p.kind == TOFGRAPH_KIND_BOOL) wrong.emplace_back("perhaps");
  if (!is_number(p)) return wrong;
  wrong.insert(wrong.end(), {"much", ".nan", ".inf", "3 furlong", "[1, {a: 2}]"});
  const bool whole = p.kind == TOFGRAPH_KIND_INTEGER;
  const auto beyond = [&](double bound, double step) {
    if (std::isnan(bound) || std::isinf(bound)) return;
    const double value = bound + step * std::max(1.0, std::abs(bound));
    wrong.push_back(whole ? fmt::format("{}", std::llround(value)) : written(value, p.unit));
  };
  beyond(p.minimum, -1);
  beyond(p.maximum, 1);
  return wrong;
}

}  // namespace tofgraph::conformance
