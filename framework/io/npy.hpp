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

/// Thrown for elements that are no numbers: texts, dates, records, Python's objects.
struct NotNumbers : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Header of an array.
struct NpyHeader {
  char order = '<';  ///< byte order: <, >, or | and = where there is none or that of this machine
  char kind = 'f';   ///< f, i, u, b
  std::size_t bytes = 4;
  bool by_columns = false;           ///< Fortran order
  std::vector<std::uint64_t> shape;  ///< as written
  std::uint64_t begin = 0;           ///< of the elements, from the begin of the array

  bool other_order() const {
    return (order == '>') == (std::endian::native == std::endian::little) && (order == '<' || order == '>');
  }
};

/// Reads the header, up to the elements. @param size bytes of the whole array
/// @throws std::runtime_error "is not a .npy file ..", a sentence without the file's name
NpyHeader read_npy_header(std::istream& in, std::uint64_t size);

/// Reads two-dimensional floating-point numbers, also with two or three of them a pixel (a third dimension), of 32 or
/// 64 bits, or integers of 8 to 64 bits or booleans, of either byte order, stored by rows or by columns (Fortran
/// order).
/// @throws std::runtime_error when the file is not such an array, or does not hold exactly the bytes that its header
/// announces. Nothing is allocated before that is known.
ImageData read_npy(const std::string& file);

}  // namespace tofgraph::io
