// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Evidence that the headers of a headerless file's layout are of another size than those in the file.
#pragma once

#include "foreign/layout.hpp"

#include <filesystem>
#include <optional>
#include <string>

namespace tofgraph::foreign {

/// Doubt about `file_header`, `frame_header` or `image_header`.
struct HeaderDoubt {
  std::string text;      ///< a sentence
  std::string evidence;  ///< with figures
  std::string mend;      ///< the lines of the layout; empty: the content of the file does not determine them
};

/// Examines a file that does not end with a whole frame of its layout. The true length of a frame is the distance at
/// which the bytes of successive frames match best; the true start of an image is where the step from the end of a row
/// to the next one stands out. Without a doubt where no bytes are left over.
/// @throws std::runtime_error a file that cannot be read, as the end of a sentence about it
std::optional<HeaderDoubt> header_doubt(const std::filesystem::path& file, const Layout& layout);

}  // namespace tofgraph::foreign
