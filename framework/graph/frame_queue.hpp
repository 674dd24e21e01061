// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Between the source's thread and the graph: frames that wait, frames under way, frames dropped.
#pragma once

#include "graph/frame.hpp"
#include "graph/pipeline.hpp"

#include <boost/circular_buffer.hpp>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <vector>

namespace tofgraph::graph {

/// Frame in flight, with a slot for the output of each node.
struct Token {
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
  Token* acquire(const std::function<bool()>& stopped);
  /// A token that was not filled after all.
  void put_back(Token* token);
  /// A filled token. @returns what is to go on its way now: this one, one that waited longer, or null
  Token* submit(Token* token);
  /// A token at the end of its way. @returns what is to go on its way in its place, or null
  Token* release(Token* token);
  void wake();

  std::uint64_t dropped() const { return dropped_.load(); }

 private:
  Token* next();

  const std::size_t in_flight_limit_;
  const Queue queue_;
  std::vector<Token> tokens_;
  std::atomic<std::uint64_t> dropped_{0};

  std::mutex mutex_;  // those below
  std::condition_variable changed_;
  std::vector<Token*> free_;
  boost::circular_buffer<Token*> waiting_;
  std::size_t in_flight_ = 0;
  std::size_t next_sequence_ = 0;
};

}  // namespace tofgraph::graph
