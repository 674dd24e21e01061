// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// run --validate: looks over a stage's shoulder during one call. What it writes gets guard bytes before and behind,
/// what it only reads must stay as it was, and what leaves keeps the promise of the channel `flags`.
#pragma once

#include "graph/frame.hpp"

#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::graph {

/// Error of a stage that did what it may not, or not what it had announced; any other error is what a stage says
/// itself.
class BrokenPromise : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Returns whether plugins are validated in this process: `run --validate`.
bool validating();
void set_validating();

class Validation {
 public:
  Validation();  ///< from here on that of this thread
  ~Validation();
  Validation(const Validation&) = delete;
  Validation& operator=(const Validation&) = delete;

  /// That of the call that this thread is in, or null.
  static Validation* current();

  /// Memory for a channel that the stage may write.
  BufferRef guarded(BufferPool& pool, std::size_t bytes, const std::string& channel);
  /// Returns whether the stage received the buffer for writing.
  bool gave(const BufferRef& buffer) const;
  /// The stage sees a channel, and may not change it.
  void shown(const tofgraph_frame::Channel& channel);

  /// @throws BrokenPromise the first thing that the stage did wrong to memory, with the channel
  void check_memory() const;
  /// @throws BrokenPromise the first length channel that disagrees with `flags`, with the pixels
  static void check_flags(const tofgraph_frame& frame);
  /// @param known TOFGRAPH_KNOWS_.. bits that the source announced
  /// @throws BrokenPromise the first of them that the frame does not know
  static void check_metadata(const tofgraph_metadata& metadata, std::uint64_t known);

 private:
  struct Given {
    std::string channel;
    BufferRef whole;  ///< with its guards
    std::size_t bytes;
  };
  struct Shown {
    std::string channel;
    BufferRef buffer;
    std::size_t bytes, hash;
  };
  Validation* before_;
  std::vector<Given> given_;
  std::vector<Shown> shown_;
};

/// A buffer that the running call may write: of the frame's pool, guarded where somebody watches.
BufferRef buffer_to_write(const tofgraph_frame& frame, std::size_t bytes, const std::string& channel);
/// Returns whether the running call may write a channel's buffer in place.
bool may_write(const BufferRef& buffer);

}  // namespace tofgraph::graph
