// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Report of a live source on frames lost before it. The plugin interface has no counter for them, so the warning
/// has to be parsed for their number.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "config/say.hpp"

namespace tofgraph::config {

inline constexpr std::string_view overtaken_words = " came faster than they were taken, and made room for newer ones";

inline std::string overtaken_text(std::uint64_t frames) {
  return counted(frames, "frame") + std::string(overtaken_words);
}
/// 0 for any other text.
inline std::uint64_t overtaken_in(const std::string& text) {
  return text.ends_with(overtaken_words) ? std::strtoull(text.c_str(), nullptr, 10) : 0;
}

}  // namespace tofgraph::config
