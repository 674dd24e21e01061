// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Conversion of contiguous elements, with the vector instructions of the processor.
#pragma once

#include <tofgraph/file_format.hpp>

#include <cstddef>
#include <cstdint>

namespace tofgraph::foreign {

/// (value - zero) scale, computed in double precision.
struct LinearScale {
  double zero, scale;
};

/// Converts contiguous elements to float. @param largest 0: all finite values are measurements; otherwise those above 0
/// and up to it
/// @returns true if all converted values are measurements
bool convert_elements(ElementType type, const std::uint8_t* in, std::size_t count, LinearScale conversion,
                      float largest, float* out);

}  // namespace tofgraph::foreign
