// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Checks that a picture is whole before a decoder, which may fill up what is missing, sees it.
#pragma once

#include <cstdint>
#include <filesystem>

namespace tofgraph::io {

/// Walks through the parts of a PNG, JPEG or TIFF file; other formats are left to their decoders.
/// @throws std::runtime_error when the file ends before the image does, naming the bytes that are announced and those
/// that are there, or when it announces more than max_image_pixels
void check_picture(const std::filesystem::path& file);

}  // namespace tofgraph::io
