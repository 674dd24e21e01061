// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Pixel values from a file, as the value of a parameter: read once, by the host.
#pragma once

#include "io/image_data.hpp"

#include <tofgraph/plugin.h>

#include <string>
#include <vector>

namespace tofgraph::io {

class ImageFile {
 public:
  /// Reads an HDF5 dataset, a 16-bit PNG, a TIFF or a .npy of one channel.
  /// @param parameter name of the parameter
  /// @param dataset of an HDF5 file; empty: the only one, or `map`
  /// @param unit of the values, "0.1 mm" or "mm"; empty: the unit stated in the file, else SI
  /// @param wanted unit of the parameter, SI
  /// @param mask true if values are only compared with 0: pictures may then have 8 bits
  /// @throws std::runtime_error naming the problem with the file, its values or its unit
  ImageFile(std::string parameter, std::string file, const std::string& dataset, const std::string& unit,
            const std::string& wanted, bool mask = false);

  const std::string& parameter() const { return parameter_; }
  const std::string& file() const { return file_; }
  /// float64, rows x columns, SI. Valid during the lifetime of this object.
  const tofgraph_view& view() const { return view_; }

 private:
  std::string parameter_, file_, unit_;
  std::vector<double> values_;
  tofgraph_view view_{};
};

/// Reads a file of values like ImageFile, also with several numbers per pixel (.npy, HDF5). Values may be NaN.
/// @throws std::runtime_error naming the problem with the file
ImageData read_image(const std::string& file, const std::string& dataset);

/// Non-owning view of values. @param name of the parameter
tofgraph_view image_view(const double* values, std::size_t rows, std::size_t columns, const char* name,
                         const char* unit);

}  // namespace tofgraph::io
