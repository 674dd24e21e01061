// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "devices/camcube/frame_exchange.hpp"

#include <utility>

namespace tofgraph::camcube {

std::int64_t now_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

void FrameExchange::offer(RawFrame& frame) {
  {
    const std::scoped_lock lock(mutex_);
    if (count_ == waiting_.size()) {
      first_ = (first_ + 1) % waiting_.size();
      --count_;
      ++overtaken_;
    }
    std::swap(waiting_[(first_ + count_) % waiting_.size()], frame);
    ++count_;
  }
  changed_.notify_one();
}

void FrameExchange::fail(const Fault& fault) {
  {
    const std::scoped_lock lock(mutex_);
    if (!fault_) fault_.emplace(fault.what(), fault.lost);
  }
  changed_.notify_one();
}

bool FrameExchange::take(RawFrame& frame, std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, patience, [this] { return count_ != 0 || fault_ || woken_; });
  if (woken_) return false;
  if (count_ != 0) {
    std::swap(waiting_[first_], frame);
    first_ = (first_ + 1) % waiting_.size();
    --count_;
    return true;
  }
  if (!fault_) return false;
  const auto [text, lost] = *std::exchange(fault_, std::nullopt);
  throw Fault(text, lost);
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
  first_ = count_ = 0;
  fault_.reset();
}

std::uint64_t FrameExchange::overtaken() const {
  const std::scoped_lock lock(mutex_);
  return overtaken_;
}

}  // namespace tofgraph::camcube
