// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Detects runs without a valid pixel: the sinks concerned and the reasons for the invalid pixels.
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

/// Frames that reach one sink, until one has a valid pixel. Frames without a length channel are not examined.
class ValidFrames {
 public:
  void add(std::span<tofgraph_frame* const> frames);  ///< [any thread]
  /// Returns whether frames arrived and none had a valid pixel.
  bool all_invalid() const { return !found_.load() && frames_ > 0; }
  /// Returns whether none of them had any pixels, e.g. a cloud without points.
  bool all_empty() const { return all_invalid() && pixels_ == 0; }
  std::uint64_t frames() const { return frames_; }
  /// Flags of the invalid pixels, by their share.
  std::string reasons() const;

 private:
  /// @returns true if the frame has a valid pixel or no channel to examine
  bool examine(const tofgraph_frame& frame);

  static constexpr std::size_t bits = 16;
  std::atomic<bool> found_{false};
  std::mutex mutex_;  // guards the members below
  std::uint64_t frames_ = 0, pixels_ = 0, too_long_ = 0;
  std::array<std::uint64_t, bits> flagged_{};
};

/// Adds a warning to the result if no frame that reached a sink had a valid pixel; an error if none had a pixel.
/// @param frames one per node
void judge_frames(const Graph& graph, std::span<const ValidFrames> frames, RunResult& result);

}  // namespace tofgraph::graph
