// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Capture with deferred writing: the producer of frames does not wait for the disk.
#pragma once

#include "io/captures/capture.hpp"

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace tofgraph::io {

/// Copies frames into a bounded queue, from which a separate thread writes them. The caller waits only if the queue is
/// full. For a single caller.
class QueuedCapture {
 public:
  /// @param max_bytes limit of the memory of the queued frames; one frame may always be queued
  QueuedCapture(std::unique_ptr<CaptureWriter> writer, std::size_t max_bytes);
  /// Writes the queued frames; without finish() the file keeps its temporary name.
  ~QueuedCapture();
  QueuedCapture(const QueuedCapture&) = delete;
  QueuedCapture& operator=(const QueuedCapture&) = delete;

  /// Queues a copy of a frame; waits if the queue is full. Arguments: see CaptureWriter::append.
  /// @throws std::runtime_error the failure of writing this or an earlier frame, and the number of lost frames
  void append(const tofgraph_metadata& metadata, std::span<const tofgraph_view> views);
  /// Writes the queued frames and renames the file. @throws std::runtime_error as append()
  void finish(const std::string& provenance = {});

 private:
  struct Waiting {
    tofgraph_metadata metadata{};
    std::vector<std::byte> data;       ///< of all views, each aligned for any type
    std::vector<tofgraph_view> views;  ///< into `data`
    std::size_t bytes() const { return sizeof *this + data.size() + views.size() * sizeof(tofgraph_view); }
  };

  void write_all();
  bool write_one(std::unique_lock<std::mutex>& lock);
  void keep(Waiting frame) noexcept;
  Waiting copy_of(const tofgraph_metadata& metadata, std::span<const tofgraph_view> views);
  void drain();
  [[noreturn]] void fail(std::size_t one_more) const;

  std::unique_ptr<CaptureWriter> writer_;
  const std::size_t max_bytes_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Waiting> queue_;
  std::vector<Waiting> spare_;  ///< memory of written frames, for reuse
  std::size_t bytes_ = 0;       ///< queued or being written
  std::size_t taken_ = 0;       ///< frames
  bool ending_ = false;
  std::optional<std::string> error_;
  std::thread thread_;
};

}  // namespace tofgraph::io
