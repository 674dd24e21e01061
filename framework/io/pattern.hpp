// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Calibration pattern without a campaign.
#pragma once

#include "io/campaign.hpp"

namespace tofgraph::io {

/// Reads a pattern, written as under `pattern:` of a campaign. Errors are reported to the diagnostics; the result must
/// not be used in that case.
Pattern read_pattern(const config::Value& value, config::Diagnostics& diagnostics);

}  // namespace tofgraph::io
