// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Runs the program with a software camera, over USB or in place of the vendor's library.
#pragma once

#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <chrono>
#include <string>
#include <vector>

namespace tofgraph::tests {

/// Shell command that runs `command` with software cameras plugged in. @param options of the software camera
inline std::string with_software_camera(const std::string& options, const std::string& command) {
#if defined(__SANITIZE_ADDRESS__)
  const std::string preload = " --preload 'libasan.so.8 libumockdev-preload.so.0'";
#elif defined(__SANITIZE_THREAD__)
  const std::string preload = " --preload 'libtsan.so.2 libumockdev-preload.so.0'";
#else
  const std::string preload;
#endif
  return "umockdev-wrapper '" TOFGRAPH_BINARY_DIR "/tests/software_camera' " + options + preload + " -- " + command;
}

inline bool has_software_camera() {
  return std::filesystem::exists(TOFGRAPH_BINARY_DIR "/tests/software_camera") &&
         std::system("command -v umockdev-wrapper >/dev/null") == 0;
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

/// Writes a raw dump byte by byte from the layout: image i holds phase 3 - i; A and B of a pixel, big-endian.
/// @param taps frames x 4 x 2 x pixels, the phases in the order of k
inline void write_dump(const std::filesystem::path& file, const std::vector<std::uint16_t>& taps, std::size_t pixels) {
  std::string bytes;
  for (std::size_t frame = 0; frame < taps.size() / (8 * pixels); ++frame) {
    for (std::size_t i = 0; i < 4; ++i) {
      bytes.append(512, static_cast<char>('a' + i));
      const std::uint16_t* a = &taps[(frame * 4 + 3 - i) * 2 * pixels];
      for (std::size_t p = 0; p < pixels; ++p) {
        for (const std::uint16_t value : {a[p], a[pixels + p]}) {
          bytes.push_back(static_cast<char>(value >> 8U));
          bytes.push_back(static_cast<char>(value & 255U));
        }
      }
    }
  }
  write_text(file, bytes);
}

/// Frames of 204 x 204 px in which every sample differs from its neighbours in all directions.
inline std::vector<std::uint16_t> distinct_taps(std::size_t frames) {
  std::vector<std::uint16_t> taps(frames * 8 * 204 * 204);
  for (std::size_t i = 0; i < taps.size(); ++i) taps[i] = static_cast<std::uint16_t>(i * 40503U >> 7U);
  return taps;
}

inline nlohmann::json json_in(const std::filesystem::path& file) {
  return nlohmann::json::parse(read_text(file), nullptr, false);
}

}  // namespace tofgraph::tests
