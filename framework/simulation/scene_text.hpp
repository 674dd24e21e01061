// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "config/document.hpp"

#include <string>

namespace tofgraph::simulation {

/// A scene's document as YAML; the files that it names become absolute paths.
std::string scene_text(const config::Value& document);

}  // namespace tofgraph::simulation
