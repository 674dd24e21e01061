// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A running graph asks for no memory: every call of malloc in the process is counted, the libraries' included.
#include <tofgraph/pipeline.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TOFGRAPH_OTHER_MALLOC
#endif

namespace {
std::atomic<bool> counting{false};
std::atomic<std::size_t> calls{0};

void count() {
  if (counting.load(std::memory_order_relaxed)) calls.fetch_add(1, std::memory_order_relaxed);
}
}  // namespace

#ifndef TOFGRAPH_OTHER_MALLOC
// The names and signatures are those of the C library, whose own functions do the work.
extern "C" {
void* __libc_malloc(std::size_t size);                           // NOLINT
void* __libc_calloc(std::size_t number, std::size_t size);       // NOLINT
void* __libc_realloc(void* memory, std::size_t size);            // NOLINT
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT
void* malloc(std::size_t size) { return count(), __libc_malloc(size); }
void* calloc(std::size_t number, std::size_t size) { return count(), __libc_calloc(number, size); }
void* realloc(void* memory, std::size_t size) { return count(), __libc_realloc(memory, size); }
void* aligned_alloc(std::size_t alignment, std::size_t size) { return count(), __libc_memalign(alignment, size); }
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  count();
  *memory = __libc_memalign(alignment, size);
  return *memory != nullptr ? 0 : 12;
}
}
#endif

namespace tofgraph {
namespace {

/// Calls of malloc in so many frames of a run, after its beginning.
std::size_t calls_in(std::uint64_t frames, const std::string& line, const std::string& node,
                     const std::string& camera) {
  constexpr std::uint64_t first = 500;
  Pipeline pipeline(line, camera);
  pipeline.plugin_path({TOFGRAPH_BINARY_DIR "/tests/plugins"});
  calls = 0;
  pipeline.on_frame(node, [frames](const Frame& frame) {
    if (frame.metadata().number == first) counting = true;
    if (frame.metadata().number == first + frames) counting = false;
  });
  pipeline.run(first + frames + 500, 2);
  return calls;
}

/// The scheduler takes its own memory in blocks, now and then; a call a frame would be as many as there are frames.
void expect_none_a_frame(std::size_t seen, std::uint64_t frames) { EXPECT_LT(seen, frames / 20); }

class SteadyState : public testing::Test {
 protected:
  void SetUp() override {
#ifdef TOFGRAPH_OTHER_MALLOC
    GTEST_SKIP() << "the sanitizer's malloc cannot be counted";
#endif
    free(std::malloc(1));
    counting = true;
    free(std::malloc(1));
    counting = false;
    ASSERT_GT(calls.load(), 0U) << "the count does not count";
  }
};

TEST_F(SteadyState, HostAndShimAskForNoMemory) {
  expect_none_a_frame(calls_in(20000, "ramp frames=0 ! scale channel=distance ! make_depth ! null", "make_depth", ""),
                      20000);
}

TEST_F(SteadyState, TheDecoderOfAnyExposuresAsksForNone) {
  const std::string source = "simulator distance='1 m' frames=0 noise=none";
  const std::size_t own = calls_in(200, source + " ! null", "simulator", "monstar");
  const std::size_t all = calls_in(200, source + " ! phase_decoder ! null", "phase_decoder", "monstar");
  expect_none_a_frame(all - std::min(all, own), 200);
}

TEST_F(SteadyState, DecoderModelAndCloudAskForNone) {
  const std::string source = "simulator distance='1 m' frames=0";
  const std::size_t own = calls_in(2000, source + " ! null", "simulator", "camcube2");
  const std::size_t all = calls_in(2000, source + " ! four_phase_decoder ! optimized_bistatic ! point_cloud ! null",
                                   "point_cloud", "camcube2");
  expect_none_a_frame(all - std::min(all, own), 2000);
}

}  // namespace
}  // namespace tofgraph
