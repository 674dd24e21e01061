// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A capture that is written behind: who brings the frames does not wait for the disk.
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

/// Copies frames into a queue of bounded memory, from which a thread of its own writes them. Only when the queue is
/// full the caller waits. For one caller.
class QueuedCapture {
 public:
  /// @param max_bytes of frames that wait; one frame may always wait
  QueuedCapture(std::unique_ptr<CaptureWriter> writer, std::size_t max_bytes);
  /// Writes what waits; without finish() the file keeps the name that it has meanwhile.
  ~QueuedCapture();
  QueuedCapture(const QueuedCapture&) = delete;
  QueuedCapture& operator=(const QueuedCapture&) = delete;

  /// Takes a copy of a frame; waits where the queue is full. The arguments: see CaptureWriter::append.
  /// @throws std::runtime_error what the writing of this or an earlier frame failed with, and how many frames are lost
  void append(const tofgraph_metadata& metadata, std::span<const tofgraph_view> views);
  /// Writes what waits and gives the file its name. @throws std::runtime_error as append()
  void finish(const std::string& provenance = {});

 private:
  struct Waiting {
    tofgraph_metadata metadata{};
    std::vector<std::vector<std::byte>> data;
    std::vector<tofgraph_view> views;
    std::size_t bytes = 0;
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
  std::vector<Waiting> spare_;  ///< memory of frames that were written
  std::size_t bytes_ = 0;       ///< that wait or are being written
  std::size_t taken_ = 0;       ///< frames
  bool ending_ = false;
  std::optional<std::string> error_;
  std::thread thread_;
};

}  // namespace tofgraph::io
