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
  std::size_t missing = 0;       ///< numbers skipped by the frame counter
  bool cut = false;              ///< the file is truncated; if not, the following are 0
  std::size_t lost = 0;          ///< frames that the file announces beyond its truncated end
  std::size_t without_time = 0;  ///< frames whose time stamp was lost or never recorded
};

/// Copies every complete frame of an interrupted recording into a capture, which is written atomically as plain HDF5.
/// The recording is not changed. If it is truncated, as after an interrupted copy, the frames up to the first with an
/// incomplete chunk are copied; this needs a temporary copy beside `file`.
/// @param part remaining file, FILE.h5.part, or any capture @param file capture to be written
/// @param frame_done called with the number of finished frames and of all frames; may be empty
/// @throws std::runtime_error naming the file: it is still being written, nothing can be read, or the capture cannot be
/// written
Repaired repair_capture(const std::filesystem::path& part, const std::filesystem::path& file, bool overwrite,
                        const std::function<void(std::size_t, std::size_t)>& frame_done = {});

/// Number of missing frames between two frames of a capture, by their counter; 0 if the counter went back.
std::size_t frames_between(std::uint64_t before, std::uint64_t after);

}  // namespace tofgraph::io
