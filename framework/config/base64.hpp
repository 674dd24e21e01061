// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Binary data as text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace tofgraph::config {

/// Base64 text of binary data (RFC 4648).
inline std::string base64(const void* data, std::size_t bytes) {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto* in = static_cast<const unsigned char*>(data);
  std::string text;
  text.reserve((bytes + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes; i += 3) {
    const std::size_t left = bytes - i;
    const std::uint32_t word = static_cast<std::uint32_t>(in[i]) << 16U |
                               (left > 1 ? static_cast<std::uint32_t>(in[i + 1]) << 8U : 0U) |
                               (left > 2 ? static_cast<std::uint32_t>(in[i + 2]) : 0U);
    text.push_back(digits[word >> 18U & 63U]);
    text.push_back(digits[word >> 12U & 63U]);
    text.push_back(left > 1 ? digits[word >> 6U & 63U] : '=');
    text.push_back(left > 2 ? digits[word & 63U] : '=');
  }
  return text;
}

}  // namespace tofgraph::config
