// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/frame_queue.hpp"

namespace tofgraph::graph {

FrameQueue::FrameQueue(std::size_t nodes, std::size_t in_flight, const Queue& queue, BufferPool& pool)
    : in_flight_limit_(in_flight), queue_(queue), slots_(in_flight + queue.capacity + 1), waiting_(queue.capacity + 1) {
  free_.reserve(slots_.size());
  for (FrameSlot& slot : slots_) {
    slot.frames.resize(nodes);
    slot.absent.resize(nodes);
    for (tofgraph_frame& frame : slot.frames) frame.pool = &pool;
    free_.push_back(&slot);
  }
}

/// Checks again every 200 ms, because a cancelled flow notifies no one.
template <class Ready> void FrameQueue::wait(std::unique_lock<std::mutex>& lock, const Ready& ready) {
  while (!changed_.wait_for(lock, std::chrono::milliseconds(200), ready)) {
  }
}

FrameSlot* FrameQueue::acquire(const std::function<bool()>& stopped) {
  const bool drop = queue_.policy == QueuePolicy::drop_oldest;
  std::unique_lock lock(mutex_);
  wait(lock, [&] { return stopped() || (!free_.empty() && (drop || waiting_.size() < queue_.capacity)); });
  if (stopped()) return nullptr;
  FrameSlot* slot = free_.back();
  free_.pop_back();
  return slot;
}

void FrameQueue::put_back(FrameSlot* slot) {
  slot->clear();
  const std::scoped_lock lock(mutex_);
  free_.push_back(slot);
}

FrameSlot* FrameQueue::next() {
  FrameSlot* slot = waiting_.front();
  waiting_.pop_front();
  slot->sequence = next_sequence_++;
  return slot;
}

FrameSlot* FrameQueue::submit(FrameSlot* slot) {
  const std::scoped_lock lock(mutex_);
  waiting_.push_back(slot);
  if (in_flight_ < in_flight_limit_) {
    ++in_flight_;
    return next();
  }
  if (queue_.policy == QueuePolicy::drop_oldest && waiting_.size() > queue_.capacity) {
    FrameSlot* oldest = waiting_.front();
    waiting_.pop_front();
    oldest->clear();
    free_.push_back(oldest);
    dropped_.fetch_add(1);
  }
  return nullptr;
}

FrameSlot* FrameQueue::release(FrameSlot* slot) {
  slot->clear();
  FrameSlot* following = nullptr;
  {
    const std::scoped_lock lock(mutex_);
    free_.push_back(slot);
    if (waiting_.empty())
      --in_flight_;
    else
      following = next();
  }
  changed_.notify_one();
  return following;
}

bool FrameQueue::wait_until_idle(const std::function<bool()>& stopped) {
  std::unique_lock lock(mutex_);
  wait(lock, [&] { return stopped() || free_.size() == slots_.size(); });
  return !stopped();
}

void FrameQueue::wake() {
  const std::scoped_lock lock(mutex_);
  changed_.notify_all();
}

}  // namespace tofgraph::graph
