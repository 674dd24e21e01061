// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A number for every pixel, from an HDF5 file.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::io {

/// The values of a dataset height x width; remembered by file, time and dataset.
/// @throws std::runtime_error what is missing or of another size
std::shared_ptr<const std::vector<double>> read_pixel_map(const std::string& file, const std::string& dataset,
                                                          std::size_t rows, std::size_t columns);

/// What is remembered of a file that goes away.
void forget_pixel_maps(const std::string& file);

/// A map on its way into a file.
struct PixelMapData {
  std::string dataset;
  std::vector<double> values;  ///< rows x columns
};

/// Writes a new file with these datasets. @throws std::runtime_error
void write_pixel_maps(const std::string& file, const std::vector<PixelMapData>& maps, std::size_t rows,
                      std::size_t columns);
/// As if they had been read from a file that was just written with them.
void remember_pixel_maps(const std::string& file, const std::vector<PixelMapData>& maps, std::size_t rows,
                         std::size_t columns);

}  // namespace tofgraph::io
