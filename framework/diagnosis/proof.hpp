// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file What the predictions of conditions that were put aside say against what was found.
#pragma once

#include "diagnosis/found.hpp"

namespace tofgraph::diagnosis {

/// Why the distances refute what was found, or nothing. @param without, with gap out of fold, m @param what is taken
/// out
std::string ruined(double without, double with, const char* what);

/// Why an effect does not prove itself out of fold, or nothing.
std::string unproved(const Found& found);

}  // namespace tofgraph::diagnosis
