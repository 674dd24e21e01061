// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/quantity.hpp"

#include "config/diagnostics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

namespace tofgraph::config {
namespace {

/// Exponents of metre, second, radian, kelvin, pixel, count, electron, lux.
using Dimension = std::array<int, 8>;

struct Unit {
  std::string_view name;
  double factor;
  Dimension dimension;
  double offset = 0;  ///< added after scaling, for a unit without others
};

constexpr Dimension none{}, length{1}, time{0, 1}, frequency{0, -1}, angle{0, 0, 1}, temperature{0, 0, 0, 1},
    pixel{0, 0, 0, 0, 1}, count{0, 0, 0, 0, 0, 1}, electron{0, 0, 0, 0, 0, 0, 1}, lux{0, 0, 0, 0, 0, 0, 0, 1};

constexpr Unit units[] = {
    {"m", 1, length},        {"mm", 1e-3, length},
    {"cm", 1e-2, length},    {"um", 1e-6, length},
    {"km", 1e3, length},     {"s", 1, time},
    {"ms", 1e-3, time},      {"us", 1e-6, time},
    {"ns", 1e-9, time},      {"min", 60, time},
    {"h", 3600, time},       {"Hz", 1, frequency},
    {"kHz", 1e3, frequency}, {"MHz", 1e6, frequency},
    {"GHz", 1e9, frequency}, {"rad", 1, angle},
    {"mrad", 1e-3, angle},   {"deg", std::numbers::pi / 180, angle},
    {"K", 1, temperature},   {"degC", 1, temperature, 273.15},
    {"px", 1, pixel},        {"counts", 1, count},
    {"e", 1, electron},      {"lx", 1, lux},
    {"klx", 1e3, lux},       {"%", 1e-2, none},
    {"ppm", 1e-6, none},     {"1", 1, none},
};

const Unit* find_unit(std::string_view name) {
  for (const Unit& unit : units) {
    if (unit.name == name) return &unit;
  }
  return nullptr;
}

/// ", did you mean 'x'?" for a unit that differs only in case or is spelled similarly; else empty.
std::string guess(std::string_view name) {
  const auto lower = [](std::string_view text) {
    std::string result(text);
    std::ranges::transform(result, result.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return result;
  };
  std::vector<std::string> names;
  for (const Unit& unit : units) {
    if (lower(unit.name) == lower(name)) return fmt::format(", did you mean '{}'?", unit.name);
    names.emplace_back(unit.name);
  }
  const std::string near = name.size() < 3 ? "" : nearest(name, names);
  return near.empty() ? "" : fmt::format(", did you mean '{}'?", near);
}

struct Parsed {
  double factor = 1;
  double offset = 0;
  Dimension dimension{};
  std::string problem;
};

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

/// Parses a product or quotient of units: "counts m^2/s", "mm/ms". A blank or * multiplies, / divides by the next unit.
Parsed parse_unit(std::string_view text) {
  Parsed result;
  int sign = 1;
  std::size_t factors = 0;
  while (!(text = trimmed(text)).empty()) {
    const auto end = std::min(text.find_first_of(" \t*/"), text.size());
    std::string_view name = text.substr(0, end);
    int power = 1;
    if (const auto caret = name.find('^'); caret != std::string_view::npos) {
      const std::string_view digits = name.substr(caret + 1);
      const auto [rest, error] = std::from_chars(digits.data(), digits.data() + digits.size(), power);
      if (error != std::errc() || rest != digits.data() + digits.size() || power == 0 || std::abs(power) > 9) {
        result.problem = fmt::format("has '{}', which is not a power of a unit", name);
        return result;
      }
      name = name.substr(0, caret);
    }
    const Unit* unit = find_unit(name);
    if (unit == nullptr) {
      result.problem = fmt::format("has the unknown unit '{}'{}", name, guess(name));
      return result;
    }
    result.factor *= std::pow(unit->factor, sign * power);
    for (std::size_t i = 0; i < none.size(); ++i) result.dimension[i] += sign * power * unit->dimension[i];
    result.offset = unit->offset;
    ++factors;
    sign = 1;
    text = trimmed(text.substr(end));
    if (!text.empty() && (text.front() == '/' || text.front() == '*')) {
      sign = text.front() == '/' ? -1 : 1;
      text.remove_prefix(1);
      if (trimmed(text).empty()) result.problem = "has a unit that ends in the middle";
    }
  }
  if (factors != 1) result.offset = 0;  // a temperature difference
  return result;
}

}  // namespace

Quantity parse_quantity(std::string_view text, std::string_view wanted) {
  text = trimmed(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc::result_out_of_range) return {0, "is too large or too small for a number"};
  if (error != std::errc()) return {0, "is not a number"};
  if (!std::isfinite(number)) return {0, "must be finite"};
  const auto begin = static_cast<std::size_t>(end - text.data());
  const Parsed unit = parse_unit(text.substr(begin));
  const Parsed target = parse_unit(wanted);
  if (!unit.problem.empty()) return {0, unit.problem};
  const bool bare = trimmed(text.substr(begin)).empty();
  if (unit.dimension != target.dimension) {
    if (bare) return {0, fmt::format("has no unit: a value in {} is expected", wanted)};
    if (wanted.empty()) return {0, "has a unit: a pure number is expected"};
    return {0, fmt::format("has the wrong dimension: a value in {} is expected", wanted)};
  }
  const double value = number * unit.factor + unit.offset;
  if (!std::isfinite(value)) return {0, "is too large or too small for a number"};
  return {value, {}};
}

std::string format_quantity(double value, std::string_view unit) {
  unit = unit.substr(0, unit.find('|'));
  struct Prefix {
    double factor;
    std::string_view name;
  };
  static constexpr Prefix lengths[] = {{1, "m"}, {1e-3, "mm"}, {1e-6, "um"}};
  static constexpr Prefix times[] = {{1, "s"}, {1e-3, "ms"}, {1e-6, "us"}, {1e-9, "ns"}};
  static constexpr Prefix frequencies[] = {{1e9, "GHz"}, {1e6, "MHz"}, {1e3, "kHz"}, {1, "Hz"}};
  static constexpr Prefix angles[] = {{1, "rad"}, {1e-3, "mrad"}};
  const auto show = [value](const auto& table, std::string_view base) {
    if (value == 0) return fmt::format("0 {}", base);
    const Prefix* chosen = std::end(table) - 1;
    for (const Prefix& prefix : table) {
      if (std::abs(value) < prefix.factor * (1 - 1e-12)) continue;
      chosen = &prefix;
      break;
    }
    return fmt::format("{:.6g} {}", value / chosen->factor, chosen->name);
  };
  if (unit == "m") return show(lengths, unit);
  if (unit == "s") return show(times, unit);
  if (unit == "Hz") return show(frequencies, unit);
  if (unit == "rad") return show(angles, unit);
  if (unit == "K") return fmt::format("{:.6g} degC", value - 273.15);
  return unit.empty() ? fmt::format("{:.6g}", value) : fmt::format("{:.6g} {}", value, unit);
}

Quantity parse_scale(std::string_view text, std::string_view unit) {
  const bool number = !text.empty() && ((text[0] >= '0' && text[0] <= '9') || text[0] == '.');
  return parse_quantity(number ? std::string(text) : "1 " + std::string(text), unit);
}

}  // namespace tofgraph::config
