// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Check of the header sizes that a layout states for a file against the content of the file.
#pragma once

#include "foreign/layout.hpp"

#include <filesystem>
#include <optional>
#include <string>

namespace tofgraph::foreign {

/// Evidence against the stated `file_header`, `frame_header` or `image_header`.
struct HeaderDoubt {
  std::string text;      ///< one sentence
  std::string evidence;  ///< text with numbers
  std::string mend;      ///< corrected keys of the layout; empty: the file does not determine them
};

/// Examines a file that does not end with a whole frame of its layout. The true length of a frame is the distance at
/// which successive frames match best; at the true start of an image, steps from row to row exceed those within rows.
/// Returns nothing if no bytes are left over.
/// @throws std::runtime_error if the file cannot be read; the message ends a sentence about the file
std::optional<HeaderDoubt> header_doubt(const std::filesystem::path& file, const Layout& layout);

}  // namespace tofgraph::foreign
