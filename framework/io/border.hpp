// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Structs of the plugin interface as this host defines them, independent of the size used by the other side.
#pragma once

#include <tofgraph/effect.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <stdexcept>

namespace tofgraph::io {

/// Violation of the plugin interface, reported with the plugin's file.
class PluginDefect : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// Sizes in API 2.0, the minimum for a struct of this major version. They never change.
template <class T> inline constexpr std::size_t first_size = sizeof(T);
template <> inline constexpr std::size_t first_size<tofgraph_view> = 104;
template <> inline constexpr std::size_t first_size<tofgraph_channel> = 88;
template <> inline constexpr std::size_t first_size<tofgraph_light> = 40;
template <> inline constexpr std::size_t first_size<tofgraph_exposure> = 16;
template <> inline constexpr std::size_t first_size<tofgraph_camera> = 248;
template <> inline constexpr std::size_t first_size<tofgraph_port> = 96;
template <> inline constexpr std::size_t first_size<tofgraph_parameter> = 80;
template <> inline constexpr std::size_t first_size<tofgraph_extension> = 24;
template <> inline constexpr std::size_t first_size<tofgraph_light_state> = 320;
template <> inline constexpr std::size_t first_size<tofgraph_effect> = 48;
template <> inline constexpr std::size_t first_size<tofgraph_descriptor> = 184;
template <> inline constexpr std::size_t first_size<tofgraph_host> = 192;

/// Converts a struct of `bytes` bytes to the host's: members beyond its end are taken from `absent`.
/// @throws PluginDefect if it is smaller than in API 2.0
template <class T> T host_sized(const void* given, std::size_t bytes, const T& absent = {}) {
  if (bytes < first_size<T>) throw PluginDefect("a struct is smaller than in API 2.0: is its size set?");
  T result = absent;
  std::memcpy(static_cast<void*>(&result), given, std::min(bytes, sizeof(T)));
  return result;
}

/// The same for a struct that begins with its size.
template <class T> T host_sized(const T& given, const T& absent = {}) {
  T result = host_sized<T>(&given, given.size, absent);
  result.size = sizeof(T);
  return result;
}

}  // namespace tofgraph::io
