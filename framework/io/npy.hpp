// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Images from NumPy's .npy files (format 1.0 to 3.0).
#pragma once

#include "io/image_data.hpp"

#include <string>

namespace tofgraph::io {

/// Reads two-dimensional floating-point numbers of 32 or 64 bits, or integers of 8 to 64 bits or booleans, of either
/// byte order, stored by rows or by columns (Fortran order).
/// @throws std::runtime_error when the file is not such an array, or does not hold exactly the bytes that its header
/// announces. Nothing is allocated before that is known.
ImageData read_npy(const std::string& file);

}  // namespace tofgraph::io
