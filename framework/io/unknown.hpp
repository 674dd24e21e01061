// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

namespace tofgraph::io {

/// Value that represents an unknown number.
inline constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

}  // namespace tofgraph::io
