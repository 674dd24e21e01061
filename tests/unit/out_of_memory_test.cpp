// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: OutOfMemory.*
// Rooms: graph io
// Memory exhaustion while frames flow, in the threads of source and stages: the run ends cleanly, with an error, and
// the next one works.
#include <gtest/gtest.h>
#include <tofgraph/pipeline.hpp>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

#include "tests/program.hpp"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TOFGRAPH_OTHER_MALLOC
#endif

namespace {
constexpr long none = 1L << 60U;
std::atomic<long> calls{0}, first{none}, end{none};  ///< calls in [first, end) fail
std::atomic<long> failed{0};

/// Set in the thread that starts the run, which can handle exceptions and starts and ends with JSON, whose destructor
/// in nlohmann's library itself allocates memory.
thread_local bool spared = false;

bool fails() {
  if (spared) return false;
  const long call = calls.fetch_add(1);
  const bool fails = call >= first.load() && call < end.load();
  if (fails) failed.fetch_add(1);
  return fails;
}
}  // namespace

#ifndef TOFGRAPH_OTHER_MALLOC
// The C++ library's operator delete frees memory from malloc.
[[gnu::noinline]] void* operator new(std::size_t size) {
  void* memory = fails() ? nullptr : std::malloc(size != 0 ? size : 1);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] void* operator new[](std::size_t size) { return operator new(size); }
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto unit = static_cast<std::size_t>(alignment);
  void* memory = fails() ? nullptr : std::aligned_alloc(unit, (size + unit - 1) / unit * unit);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
#endif

namespace tofgraph::tests {
namespace {

constexpr std::uint64_t frames = 12;

/// A run in which allocations fail after the second frame has arrived. @returns the error; empty: success
std::string run_with(long allocations, long number, const std::filesystem::path& capture) {
  Pipeline pipeline("ramp frames=" + std::to_string(frames) +
                    " ! make_depth ! capture_writer path=" + capture.string());
  pipeline.plugin_path({TOFGRAPH_BINARY_DIR "/tests/plugins"});
  pipeline.on_frame("ramp", [&](const Frame& frame) {
    if (frame.metadata().number != 1 || number == 0) return;
    failed = 0;
    first = calls + allocations;
    end = first + number;
  });
  std::string error;
  try {
    EXPECT_EQ(pipeline.run(0, 2).frames, frames);
  } catch (const std::exception& thrown) {
    first = none;
    error = thrown.what();
    EXPECT_NE(error, "");
  }
  first = none;
  return error;
}

bool can_be_read(const std::filesystem::path& capture) {
  Pipeline pipeline("capture_reader file=" + capture.string() + " ! null");
  pipeline.plugin_path({TOFGRAPH_BINARY_DIR "/tests/plugins"});
  return pipeline.run().frames > 0;
}

/// Fails after 0, 1, 2 ... further allocations, later in larger steps, until a run has no more of them. @param number
/// of consecutive calls that fail
void fail_everywhere(long number) {
#ifdef TOFGRAPH_OTHER_MALLOC
  GTEST_SKIP() << "the sanitizer has its own operator new";
#endif
  spared = true;
  const TemporaryFolder folder;
  std::size_t ended = 0;
  long longest = 0;
  for (long allocations = 0;; allocations += 1 + allocations / 16) {
    ASSERT_LT(allocations, 20000) << "the run asks for memory without end";
    const std::filesystem::path capture = folder.path() / ("c" + std::to_string(allocations) + ".h5");
    const std::string error = run_with(allocations, number, capture);
    const bool there = std::filesystem::exists(capture);
    EXPECT_TRUE(there || !error.empty());
    EXPECT_TRUE(!there || can_be_read(capture)) << error;
    std::filesystem::remove(capture);
    std::filesystem::remove(capture.string() + ".part");
    ended += error.empty() ? 0 : 1;
    if (failed == 0) break;
    longest = std::max(longest, failed.load());
  }
  EXPECT_GT(ended, 10U) << "too few of the failures ended a run: the test looks at nothing";
  EXPECT_GT(longest, std::min(number - 1, 2L)) << "several calls were to fail in a row";
  EXPECT_EQ(run_with(-1, 0, folder.path() / "last.h5"), "");
}

TEST(OutOfMemory, OnceInAThreadOfTheRun) { fail_everywhere(1); }

TEST(OutOfMemory, ForAWhileInThreadsOfTheRun) { fail_everywhere(20); }

}  // namespace
}  // namespace tofgraph::tests
