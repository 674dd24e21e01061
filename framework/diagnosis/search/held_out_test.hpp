// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Tests of what was found by predictions of held-out conditions.
#pragma once

#include "diagnosis/search/search_result.hpp"

namespace tofgraph::diagnosis {

/// Why the distances refute what was found, or nothing. @param without, with gap out of fold, m @param what is taken
/// out
std::string gap_worsened(double without, double with, const char* what);

/// Why an effect does not prove itself out of fold, or nothing.
std::string held_out_failure(const EffectFinding& found);

}  // namespace tofgraph::diagnosis
