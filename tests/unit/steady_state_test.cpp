// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A running graph asks for no memory: every call of malloc in the process is counted, the libraries' included.
#include <tofgraph/pipeline.hpp>

#include <gtest/gtest.h>

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
void* __libc_malloc(std::size_t size);                         // NOLINT
void* __libc_calloc(std::size_t number, std::size_t size);     // NOLINT
void* __libc_realloc(void* memory, std::size_t size);          // NOLINT
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

/// Calls of malloc between two frames of a run, far from its beginning and its end.
std::size_t calls_in_steady_state(const std::string& line, const std::string& node, const std::string& camera) {
  Pipeline pipeline(line, camera);
  pipeline.plugin_path({TOFGRAPH_BINARY_DIR "/tests/plugins"});
  calls = 0;
  pipeline.on_frame(node, [](const Frame& frame) {
    if (frame.metadata().number == 1000) counting = true;
    if (frame.metadata().number == 3000) counting = false;
  });
  pipeline.run(4000, 2);
  return calls;
}

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
  EXPECT_EQ(calls_in_steady_state("ramp frames=0 ! scale channel=distance ! make_depth ! null", "make_depth", ""), 0U);
}

TEST_F(SteadyState, DecoderModelAndCloudAskForNone) {
  EXPECT_EQ(calls_in_steady_state("simulator distance='1 m' frames=0 ! four_phase_decoder ! optimized_bistatic ! "
                                  "point_cloud ! null",
                                  "point_cloud", "camcube2"),
            0U);
}

}  // namespace
}  // namespace tofgraph
