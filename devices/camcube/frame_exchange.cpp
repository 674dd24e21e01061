// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "devices/camcube/frame_exchange.hpp"

#include <utility>

namespace tofgraph::camcube {

std::int64_t now_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

/// Merges faults: the loss of the device replaces earlier faults.
void FrameExchange::merge(MaybeFault& earlier, MaybeFault later) {
  if (later && (!earlier || (later->second && !earlier->second))) earlier = std::move(later);
}

void FrameExchange::offer(RawFrame& frame) {
  {
    const std::scoped_lock lock(mutex_);
    if (count_ == waiting_.size()) {
      MaybeFault before = std::exchange(waiting_[first_].before, std::nullopt);
      first_ = (first_ + 1) % waiting_.size();
      --count_;
      ++overtaken_;
      MaybeFault& next = count_ == 0 ? last_fault_ : waiting_[first_].before;
      merge(before, std::exchange(next, std::nullopt));
      next = std::move(before);
    }
    Waiting& place = waiting_[(first_ + count_) % waiting_.size()];
    std::swap(place.frame, frame);
    place.before = std::exchange(last_fault_, std::nullopt);
    ++count_;
  }
  changed_.notify_one();
}

void FrameExchange::fail(const Fault& fault) {
  {
    const std::scoped_lock lock(mutex_);
    merge(last_fault_, std::pair(std::string(fault.what()), fault.lost));
  }
  changed_.notify_one();
}

bool FrameExchange::take(RawFrame& frame, std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, patience, [this] { return count_ != 0 || last_fault_ || woken_; });
  if (woken_ || (count_ == 0 && !last_fault_)) return false;
  MaybeFault& fault = count_ != 0 ? waiting_[first_].before : last_fault_;
  if (fault) {
    const auto [text, lost] = *std::exchange(fault, std::nullopt);
    throw Fault(text, lost);
  }
  std::swap(waiting_[first_].frame, frame);
  first_ = (first_ + 1) % waiting_.size();
  --count_;
  return true;
}

void FrameExchange::wake() {
  {
    const std::scoped_lock lock(mutex_);
    woken_ = true;
  }
  changed_.notify_one();
}

void FrameExchange::clear() {
  const std::scoped_lock lock(mutex_);
  for (Waiting& one : waiting_) one.before.reset();
  last_fault_.reset();
  first_ = count_ = 0;
}

std::uint64_t FrameExchange::overtaken() const {
  const std::scoped_lock lock(mutex_);
  return overtaken_;
}

}  // namespace tofgraph::camcube
