// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Content of an image file. The readers are a separate module (images_module.cpp), loaded when used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Larger images are rejected: a small damaged or compressed file could announce any size.
inline constexpr std::uint64_t max_image_pixels = std::uint64_t{1} << 25U;

struct ImageData {
  std::vector<double> values;                    ///< row-major
  std::size_t rows = 0, columns = 0, depth = 1;  ///< depth: numbers per pixel
  std::string unit;                              ///< stated by the file; empty: not stated
  bool of_bytes = false;                         ///< 8-bit picture
};

/// @param dataset of an HDF5 file; empty: the only one, or `map` @param problem why reading failed, or empty
using ReadImage = void(const std::string& file, const std::string& dataset, ImageData& image, std::string& problem);
inline constexpr const char* read_image_symbol = "tofgraph_read_image";

}  // namespace tofgraph::io
