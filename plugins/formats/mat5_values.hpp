// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Values of a MATLAB file: their types, and their conversion to the type of their array.
#pragma once

#include <tofgraph/file_format.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace tofgraph {

/// Type of values in the file; 0 bytes: no type of numbers.
inline ElementType mat5_type_of(std::uint32_t type) {
  constexpr std::uint32_t s = TOFGRAPH_ELEMENT_SIGNED, u = TOFGRAPH_ELEMENT_UNSIGNED, f = TOFGRAPH_ELEMENT_FLOAT;
  static constexpr std::array<ElementType, 14> types = {
      {{f, 0}, {s, 1}, {u, 1}, {s, 2}, {u, 2}, {s, 4}, {u, 4}, {f, 4}, {f, 0}, {f, 8}, {f, 0}, {f, 0}, {s, 8}, {u, 8}}};
  return type < types.size() ? types[type] : types[0];
}
/// The same number in another type. @param name of the variable @throws std::runtime_error if the type lacks that
/// number
template <class Wanted, class Stored> Wanted mat5_converted(Stored value, const std::string& name) {
  using Limits = std::numeric_limits<Wanted>;
  const auto number = static_cast<long double>(value);  // this type holds every number that a file may store
  const bool in_range =
      number >= static_cast<long double>(Limits::lowest()) && number <= static_cast<long double>(Limits::max());
  if (in_range || (std::is_floating_point_v<Wanted> && !std::isfinite(number))) {
    const auto wanted = static_cast<Wanted>(number);
    if (static_cast<long double>(wanted) == number || std::isnan(number)) return wanted;
  }
  throw std::runtime_error("is damaged: values of the variable '" + name + "' do not fit its type");
}

/// Converts values to the type of their array: MATLAB stores a double in fewer bytes if that loses nothing.
inline void convert_mat5(std::span<const std::uint8_t> values, ElementType type, bool big_endian,
                         const FileArray& array, void* to) {
  auto* const out = static_cast<std::uint8_t*>(to);
  if (type.kind == array.kind && type.bytes == array.bytes && !big_endian) {
    std::memcpy(out, values.data(), values.size());
    return;
  }
  with_element(type, [&](auto stored) {
    with_element({array.kind, array.bytes}, [&](auto wanted) {
      for (std::size_t i = 0; i < values.size() / sizeof stored; ++i) {
        std::array<std::uint8_t, sizeof stored> one;
        std::copy_n(&values[i * sizeof stored], sizeof stored, one.begin());
        if (big_endian) std::ranges::reverse(one);
        std::memcpy(&stored, one.data(), sizeof stored);
        if constexpr (std::is_same_v<decltype(stored), decltype(wanted)>)
          wanted = stored;
        else
          wanted = mat5_converted<decltype(wanted)>(stored, array.name);
        std::memcpy(out + i * sizeof wanted, &wanted, sizeof wanted);
      }
    });
  });
}

}  // namespace tofgraph
