// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Conversion of text to valid UTF-8: file names may have any encoding, JSON and HTML are UTF-8.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <string_view>

namespace tofgraph::config {

/// Text with each byte that is not part of valid UTF-8 written as \xE4 etc.
std::string as_utf8(std::string_view text);

/// JSON value as text; invalid UTF-8 is escaped as by as_utf8. @param indent -1: on one line
std::string json_text(const nlohmann::json& value, int indent = -1);

}  // namespace tofgraph::config
