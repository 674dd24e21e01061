// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Values of the pixels from a file, as a parameter's value: read once, by the host.
#pragma once

#include "io/image_data.hpp"

#include <tofgraph/plugin.h>

#include <string>
#include <vector>

namespace tofgraph::io {

class ImageFile {
 public:
  /// Reads an HDF5 dataset, a PNG of 16 bit, a TIFF or a .npy of one channel.
  /// @param parameter that it is for
  /// @param dataset of an HDF5 file; empty: the only one there, or `map`
  /// @param unit of the values, "0.1 mm" or "mm"; empty: what the file says, else SI
  /// @param wanted the parameter's unit, SI
  /// @param mask whether values are only 0 or not 0: pictures may then have 8 bits
  /// @throws std::runtime_error what is wrong with the file, its values or its unit
  ImageFile(std::string parameter, std::string file, const std::string& dataset, const std::string& unit,
            const std::string& wanted, bool mask = false);

  const std::string& parameter() const { return parameter_; }
  const std::string& file() const { return file_; }
  /// float64, rows x columns, SI. Valid as long as this lives.
  const tofgraph_view& view() const { return view_; }

 private:
  std::string parameter_, file_, unit_;
  std::vector<double> values_;
  tofgraph_view view_{};
};

/// Reads a file of values as ImageFile does, also with several numbers a pixel (.npy, HDF5). Values may be NaN.
/// @throws std::runtime_error what is wrong with the file
ImageData read_image(const std::string& file, const std::string& dataset);

/// A view of values that somebody else keeps. @param name of the parameter
tofgraph_view image_view(const double* values, std::size_t rows, std::size_t columns, const char* name,
                         const char* unit);

}  // namespace tofgraph::io
