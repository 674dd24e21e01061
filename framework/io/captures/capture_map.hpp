// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Map of one number per pixel, in an HDF5 file.
#pragma once

#include "io/image_data.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Reads a dataset height x width and its optional attribute `unit`. @param dataset empty: the only one, or `map`
/// @throws std::runtime_error naming what is missing or damaged
ImageData read_pixel_map(const std::string& file, const std::string& dataset);
/// Test of a map, to be run in a separate process, under resource limits that remain in effect for the process.
void read_pixel_map_on_trial(const std::string& file, const std::string& dataset);

/// Map to be written to a file.
struct PixelMapData {
  std::string dataset, unit;
  std::vector<double> values;  ///< rows x columns
};

/// Writes a new file with these datasets. @throws std::runtime_error
void write_pixel_maps(const std::string& file, const std::vector<PixelMapData>& maps, std::size_t rows,
                      std::size_t columns);

}  // namespace tofgraph::io
