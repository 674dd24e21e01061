// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Recovery of an interrupted recording as a capture.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

namespace tofgraph::io {

struct Repaired {
  std::size_t frames = 0;
  std::size_t missing = 0;       ///< numbers that the frames' counter left out
  bool cut = false;              ///< the file is shorter than HDF5 left it; of another one the following are 0
  std::size_t lost = 0;          ///< frames that the file announces beyond the place where it was cut off
  std::size_t without_time = 0;  ///< frames whose time stamp was lost, or never recorded
};

/// Copies every complete frame of a recording that was cut off into a capture, which appears whole or not at all and is
/// plain HDF5. The recording stays as it is. Of a file that is shorter than HDF5 left it, as after an interrupted copy,
/// the frames up to the first one with a chunk that is not whole are copied; for this it is copied once beside `file`.
/// @param part what is left, FILE.h5.part, or any capture @param file the capture to be written
/// @param frame_done called with the number of frames done and of all; may be empty
/// @throws std::runtime_error naming the file: it is still being written, nothing can be read, or the capture cannot be
/// written
Repaired repair_capture(const std::filesystem::path& part, const std::filesystem::path& file, bool overwrite,
                        const std::function<void(std::size_t, std::size_t)>& frame_done = {});

/// Frames that are missing between two of a capture, by their counter. A counter that went back tells nothing: 0.
std::size_t frames_between(std::uint64_t before, std::uint64_t after);

}  // namespace tofgraph::io
