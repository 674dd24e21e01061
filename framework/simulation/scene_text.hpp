// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "config/document.hpp"

#include <string>

namespace tofgraph::simulation {

/// Scene document as YAML; the paths of referenced files become absolute.
std::string scene_text(const config::Value& document);

}  // namespace tofgraph::simulation
