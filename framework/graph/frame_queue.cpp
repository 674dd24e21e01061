// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/frame_queue.hpp"

namespace tofgraph::graph {

FrameQueue::FrameQueue(std::size_t nodes, std::size_t in_flight, const Queue& queue, BufferPool& pool)
    : in_flight_limit_(in_flight),
      queue_(queue),
      tokens_(in_flight + queue.capacity + 1),
      waiting_(queue.capacity + 1) {
  free_.reserve(tokens_.size());
  for (Token& token : tokens_) {
    token.frames.resize(nodes);
    token.absent.resize(nodes);
    for (tofgraph_frame& frame : token.frames) frame.pool = &pool;
    free_.push_back(&token);
  }
}

Token* FrameQueue::acquire(const std::function<bool()>& stopped) {
  const bool drop = queue_.policy == QueuePolicy::drop_oldest;
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return stopped() || (!free_.empty() && (drop || waiting_.size() < queue_.capacity)); });
  if (stopped()) return nullptr;
  Token* token = free_.back();
  free_.pop_back();
  return token;
}

void FrameQueue::put_back(Token* token) {
  token->clear();
  const std::scoped_lock lock(mutex_);
  free_.push_back(token);
}

Token* FrameQueue::next() {
  Token* token = waiting_.front();
  waiting_.pop_front();
  token->sequence = next_sequence_++;
  return token;
}

Token* FrameQueue::submit(Token* token) {
  const std::scoped_lock lock(mutex_);
  waiting_.push_back(token);
  if (in_flight_ < in_flight_limit_) {
    ++in_flight_;
    return next();
  }
  if (queue_.policy == QueuePolicy::drop_oldest && waiting_.size() > queue_.capacity) {
    Token* oldest = waiting_.front();
    waiting_.pop_front();
    oldest->clear();
    free_.push_back(oldest);
    dropped_.fetch_add(1);
  }
  return nullptr;
}

Token* FrameQueue::release(Token* token) {
  token->clear();
  Token* following = nullptr;
  {
    const std::scoped_lock lock(mutex_);
    free_.push_back(token);
    if (waiting_.empty())
      --in_flight_;
    else
      following = next();
  }
  changed_.notify_one();
  return following;
}

void FrameQueue::wake() {
  const std::scoped_lock lock(mutex_);
  changed_.notify_all();
}

}  // namespace tofgraph::graph
