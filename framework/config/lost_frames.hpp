// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Warning of a live source about frames lost before it. The plugin interface has no counter for them, so their
/// number is parsed from the warning.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "config/log.hpp"

namespace tofgraph::config {

inline constexpr std::string_view lost_frames_words = " came faster than they were taken, and made room for newer ones";

inline std::string lost_frames_text(std::uint64_t frames) {
  return counted(frames, "frame") + std::string(lost_frames_words);
}
/// Number of lost frames; 0 for any other text.
inline std::uint64_t lost_frames_in(const std::string& text) {
  return text.ends_with(lost_frames_words) ? std::strtoull(text.c_str(), nullptr, 10) : 0;
}

}  // namespace tofgraph::config
