// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Images from NumPy's .npy files (format 1.0 to 3.0).
#pragma once

#include "io/image_data.hpp"

#include <bit>
#include <cstdint>
#include <istream>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Thrown for non-numeric elements: strings, dates, records, Python objects.
struct NotNumbers : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Header of an array.
struct NpyHeader {
  char order = '<';  ///< byte order: <, >, or | and = if not applicable or native
  char kind = 'f';   ///< f, i, u, b
  std::size_t bytes = 4;
  bool by_columns = false;           ///< Fortran order
  std::vector<std::uint64_t> shape;  ///< as written
  std::uint64_t begin = 0;           ///< offset of the elements from the beginning of the array

  bool other_order() const {
    return (order == '>') == (std::endian::native == std::endian::little) && (order == '<' || order == '>');
  }
};

/// Reads the header, up to the elements. @param size bytes of the whole array
/// @throws std::runtime_error "is not a .npy file ..", a sentence without the file's name
NpyHeader read_npy_header(std::istream& in, std::uint64_t size);

/// Reads two-dimensional floating-point numbers of 32 or 64 bits, or integers of 8 to 64 bits or booleans, also with
/// two or three numbers per pixel (a third dimension), in either byte order, row-major or column-major (Fortran
/// order).
/// @throws std::runtime_error if the file is not such an array, or its size differs from that announced by the
/// header. Nothing is allocated before this check.
ImageData read_npy(const std::string& file);

}  // namespace tofgraph::io
