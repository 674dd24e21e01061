// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Runs that give no valid pixel: which sinks they reach, and why the pixels are invalid.
#pragma once

#include "graph/graph.hpp"
#include "graph/run_statistics.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>

namespace tofgraph::graph {

/// Frames that reach one sink, until one of them has a valid pixel. Frames without a length channel are not examined.
class ValidFrames {
 public:
  void add(std::span<tofgraph_frame* const> frames);  ///< [any thread]
  /// Frames arrived, and none had a valid pixel.
  bool all_invalid() const { return !found_.load() && frames_ > 0; }
  /// None of them had a pixel at all, like a cloud without points.
  bool all_empty() const { return all_invalid() && pixels_ == 0; }
  std::uint64_t frames() const { return frames_; }
  /// The flags of the invalid pixels by their share.
  std::string reasons() const;

 private:
  /// @returns true when the frame has a valid pixel or nothing that tells
  bool examine(const tofgraph_frame& frame);

  static constexpr std::size_t bits = 16;
  std::atomic<bool> found_{false};
  std::mutex mutex_;  // of the rest
  std::uint64_t frames_ = 0, pixels_ = 0, too_long_ = 0;
  std::array<std::uint64_t, bits> flagged_{};
};

/// Adds a warning to the result where no frame that reached a sink had a valid pixel; an error where none had a pixel.
/// @param frames one for each node
void judge_frames(const Graph& graph, std::span<const ValidFrames> frames, RunResult& result);

}  // namespace tofgraph::graph
