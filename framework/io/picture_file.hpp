// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Completeness check of picture files, because decoders may fill in missing data.
#pragma once

#include <cstdint>
#include <filesystem>

namespace tofgraph::io {

/// Walks through the segments of a PNG, JPEG or TIFF file; other formats are left to their decoders.
/// @throws std::runtime_error if the file ends before the image does, with the announced and the existing number of
/// bytes, or if it announces more than max_image_pixels
void check_picture(const std::filesystem::path& file);

}  // namespace tofgraph::io
