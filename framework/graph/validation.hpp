// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// run --validate: checks a stage during one call. Written memory gets guard bytes before and behind it, memory that is
/// only read must stay unchanged, and the output must be consistent with the channel `flags`.
#pragma once

#include "graph/frame.hpp"

#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::graph {

/// Error of a stage that violated the plugin interface or its own announcement; other errors are reported by the stage
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
  Validation();  ///< becomes that of this thread
  ~Validation();
  Validation(const Validation&) = delete;
  Validation& operator=(const Validation&) = delete;

  /// Validation of this thread's call, or null.
  static Validation* current();

  /// Memory for a channel that the stage may write.
  BufferRef guarded(BufferPool& pool, std::size_t bytes, const std::string& channel);
  /// Returns whether the stage received the buffer for writing.
  bool gave(const BufferRef& buffer) const;
  /// Records a channel that the stage may read but not change.
  void shown(const tofgraph_frame::Channel& channel);

  /// @throws BrokenPromise the first memory violation, with the channel
  void check_memory() const;
  /// @throws BrokenPromise the first length channel that disagrees with `flags`, with the pixels
  static void check_flags(const tofgraph_frame& frame);
  /// @param known TOFGRAPH_KNOWS_.. bits that the source announced
  /// @throws BrokenPromise the first of them that the frame lacks
  static void check_metadata(const tofgraph_metadata& metadata, std::uint64_t known);

 private:
  struct Given {
    std::string channel;
    BufferRef whole;  ///< including guards
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

/// Buffer that the running call may write: from the frame's pool, with guards under validation.
BufferRef buffer_to_write(const tofgraph_frame& frame, std::size_t bytes, const std::string& channel);
/// Returns whether the running call may write a channel's buffer in place.
bool may_write(const BufferRef& buffer);

}  // namespace tofgraph::graph
