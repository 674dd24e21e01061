// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Text that is always UTF-8. File names are bytes of any encoding, JSON and HTML are UTF-8.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <string_view>

namespace tofgraph::config {

/// The text with each byte that is not part of valid UTF-8 written as \xE4 and so on.
std::string as_utf8(std::string_view text);

/// A JSON value as text, by as_utf8 where it holds other bytes. @param indent -1: on one line
std::string json_text(const nlohmann::json& value, int indent = -1);

}  // namespace tofgraph::config
