// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Between the source's thread and the graph: frames that wait, frames under way, frames dropped.
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

  /// Gives the buffers back.
  void clear() {
    for (tofgraph_frame& frame : frames) frame.clear();
  }
};

/// Holds all tokens of a run. At most `in_flight` are under way in the graph, and at most queue.capacity wait.
/// Nothing here allocates once it is made. [any thread]
class FrameQueue {
 public:
  FrameQueue(std::size_t nodes, std::size_t in_flight, const Queue& queue, BufferPool& pool);

  /// Waits for a token that the source may fill. @returns null once stopped() says so; wake() makes it ask again
  FrameSlot* acquire(const std::function<bool()>& stopped);
  /// A token that was not filled after all.
  void put_back(FrameSlot* slot);
  /// A filled token. @returns what is to go on its way now: this one, one that waited longer, or null
  FrameSlot* submit(FrameSlot* slot);
  /// A token at the end of its way. @returns what is to go on its way in its place, or null
  FrameSlot* release(FrameSlot* slot);
  /// Waits until no frame is under way or waits. @returns false once stopped() says so
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

  std::mutex mutex_;  // those below
  std::condition_variable changed_;
  std::vector<FrameSlot*> free_;
  boost::circular_buffer<FrameSlot*> waiting_;
  std::size_t in_flight_ = 0;
  std::size_t next_sequence_ = 0;
};

}  // namespace tofgraph::graph
