// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Queue between the source's thread and the graph: waiting frames, frames in flight, dropped frames.
#pragma once

#include "graph/frame.hpp"
#include "graph/pipeline.hpp"

#include <boost/circular_buffer.hpp>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <vector>

namespace tofgraph::graph {

/// Frame in flight, with a slot for the output of each node.
struct FrameSlot {
  std::size_t sequence = 0;  ///< index among the frames that were not dropped
  std::vector<tofgraph_frame> frames;
  std::vector<bool> absent;  ///< per node: no output for this frame

  /// Returns the buffers to the pool.
  void clear() {
    for (tofgraph_frame& frame : frames) frame.clear();
  }
};

/// Holds all frame slots of a run. At most `in_flight` are in the graph and at most queue.capacity wait. Allocates only
/// on construction. [any thread]
class FrameQueue {
 public:
  FrameQueue(std::size_t nodes, std::size_t in_flight, const Queue& queue, BufferPool& pool);

  /// Waits for a slot that the source may fill. @returns null once stopped() is true; wake() evaluates it again
  FrameSlot* acquire(const std::function<bool()>& stopped);
  /// Returns a slot that was not filled.
  void put_back(FrameSlot* slot);
  /// Accepts a filled slot. @returns the slot to process now: this one, one that has waited longer, or null
  FrameSlot* submit(FrameSlot* slot);
  /// Accepts a slot that has been processed. @returns the slot to process in its place, or null
  FrameSlot* release(FrameSlot* slot);
  /// Waits until no frame is in flight or waiting. @returns false once stopped() is true
  bool wait_until_idle(const std::function<bool()>& stopped);
  void wake();

  std::uint64_t dropped() const { return dropped_.load(); }

 private:
  FrameSlot* next();
  template <class Ready> void wait(std::unique_lock<std::mutex>& lock, const Ready& ready);

  const std::size_t in_flight_limit_;
  const Queue queue_;
  std::vector<FrameSlot> slots_;
  std::atomic<std::uint64_t> dropped_{0};

  std::mutex mutex_;  // guards the members below
  std::condition_variable changed_;
  std::vector<FrameSlot*> free_;
  boost::circular_buffer<FrameSlot*> waiting_;
  std::size_t in_flight_ = 0;
  std::size_t next_sequence_ = 0;
};

}  // namespace tofgraph::graph
