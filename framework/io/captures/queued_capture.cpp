// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/queued_capture.hpp"

#include "config/log.hpp"
#include "config/thrown.hpp"

#include <tofgraph/array.hpp>

#include <fmt/format.h>

#include <cstring>
#include <stdexcept>
#include <utility>

namespace tofgraph::io {
namespace {

/// Size of a view without gaps, in bytes; other views are rejected when they are written.
std::size_t bytes_of(const tofgraph_view& view) {
  std::size_t bytes = view.data != nullptr ? element_size(view.type) : 0;
  for (std::uint32_t i = 0; i < view.rank; ++i) bytes *= view.extent[i];
  return bytes;
}

/// The same, rounded up so that the next view is aligned.
std::size_t aligned_bytes_of(const tofgraph_view& view) {
  constexpr std::size_t alignment = alignof(std::max_align_t);
  return (bytes_of(view) + alignment - 1) / alignment * alignment;
}

}  // namespace

QueuedCapture::QueuedCapture(std::unique_ptr<CaptureWriter> writer, std::size_t max_bytes)
    : writer_(std::move(writer)), max_bytes_(max_bytes), thread_([this] { write_all(); }) {}

QueuedCapture::~QueuedCapture() { drain(); }

void QueuedCapture::drain() {
  {
    const std::scoped_lock lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void QueuedCapture::write_all() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ending_ || !queue_.empty(); });
    if (queue_.empty() || !write_one(lock)) return;
  }
}

/// @returns false after a failure: queued frames are lost
bool QueuedCapture::write_one(std::unique_lock<std::mutex>& lock) {
  Waiting frame = std::move(queue_.front());
  queue_.pop_front();
  lock.unlock();
  std::string problem;
  try {
    writer_->append(frame.metadata, frame.views);
  } catch (...) {
    problem = config::what_was_thrown();
  }
  lock.lock();
  const bool written = problem.empty();
  if (written) {
    bytes_ -= frame.bytes();
    keep(std::move(frame));
  } else {
    error_ = std::move(problem);
  }
  changed_.notify_all();
  return written;
}

/// Keeps the memory of a frame for reuse, unless memory for the list itself is exhausted.
void QueuedCapture::keep(Waiting frame) noexcept {
  try {
    spare_.push_back(std::move(frame));
  } catch (const std::bad_alloc&) {
  }
}

QueuedCapture::Waiting QueuedCapture::copy_of(const tofgraph_metadata& metadata, std::span<const tofgraph_view> views) {
  Waiting frame;
  {
    const std::scoped_lock lock(mutex_);
    if (!spare_.empty()) {
      frame = std::move(spare_.back());
      spare_.pop_back();
    }
  }
  frame.metadata = metadata;
  frame.views.assign(views.begin(), views.end());
  std::size_t bytes = 0;
  for (const tofgraph_view& view : views) bytes += aligned_bytes_of(view);
  frame.data.resize(bytes);
  std::byte* at = frame.data.data();
  for (tofgraph_view& view : frame.views) {
    if (view.data == nullptr) continue;
    std::memcpy(at, view.data, bytes_of(view));
    view.data = at;
    at += aligned_bytes_of(view);
  }
  return frame;
}

void QueuedCapture::append(const tofgraph_metadata& metadata, std::span<const tofgraph_view> views) {
  Waiting frame = copy_of(metadata, views);
  const std::size_t bytes = frame.bytes();
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return error_ || bytes_ == 0 || bytes_ + bytes <= max_bytes_; });
    if (error_) fail(1);
    bytes_ += bytes;
    ++taken_;
    queue_.push_back(std::move(frame));
  }
  changed_.notify_all();
}

void QueuedCapture::finish(const std::string& provenance) {
  drain();
  if (error_) fail(0);
  writer_->finish(provenance);
}

void QueuedCapture::fail(std::size_t one_more) const {
  const std::size_t written = writer_->frames(), lost = taken_ + one_more - written;
  throw std::runtime_error(fmt::format("{}\n         {} written and can be read, {} could not be written", *error_,
                                       config::counted(written, "frame") + (written == 1 ? " is" : " are"),
                                       config::counted(lost, "frame")));
}

}  // namespace tofgraph::io
