// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: SteadyState.SimulatorDecoder*:SteadyState.TheDecoder*
// Rooms: graph
// Memory allocations of a running graph: every call in the process is counted, including those of libraries.
#include <tofgraph/pipeline.hpp>

#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <functional>
#include <new>

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
// All allocation functions of the C library, forwarded to its internal functions; operator new uses malloc.
extern "C" {
void* __libc_malloc(std::size_t size);                           // NOLINT
void* __libc_calloc(std::size_t number, std::size_t size);       // NOLINT
void* __libc_realloc(void* memory, std::size_t size);            // NOLINT
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT
void* __libc_valloc(std::size_t size);                           // NOLINT
void* __libc_pvalloc(std::size_t size);                          // NOLINT
void* malloc(std::size_t size) { return count(), __libc_malloc(size); }
void* calloc(std::size_t number, std::size_t size) { return count(), __libc_calloc(number, size); }
void* realloc(void* memory, std::size_t size) { return count(), __libc_realloc(memory, size); }
void* reallocarray(void* memory, std::size_t number, std::size_t size) {
  std::size_t bytes = 0;
  count();
  return __builtin_mul_overflow(number, size, &bytes) ? nullptr : __libc_realloc(memory, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return count(), __libc_memalign(alignment, size); }
void* memalign(std::size_t alignment, std::size_t size) { return count(), __libc_memalign(alignment, size); }
void* valloc(std::size_t size) { return count(), __libc_valloc(size); }
void* pvalloc(std::size_t size) { return count(), __libc_pvalloc(size); }
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  count();
  *memory = __libc_memalign(alignment, size);
  return *memory != nullptr ? 0 : 12;
}
}
#endif

namespace tofgraph {
namespace {

constexpr unsigned threads = 2;

/// Number of allocations in this number of frames of a run, after its start-up.
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
  pipeline.run(first + frames + 500, threads);
  return calls;
}

/// Allocations must not continue while frames arrive. A limited number is allowed: the pool's, for buffers and
/// handles if more frames are in flight at once than before, and those of the frames in flight when counting began or
/// ended.
constexpr std::size_t under_way = 2 * threads + 4 + 1, channels = 6, few = 2 * channels * under_way;

class SteadyState : public testing::Test {
 protected:
  void SetUp() override {
#ifdef TOFGRAPH_OTHER_MALLOC
    GTEST_SKIP() << "the sanitizer's malloc cannot be counted";
#endif
  }
};

/// Without this check the count could be zero because calls are not counted.
TEST_F(SteadyState, EveryWayToMemoryIsCounted) {
  void* memory = nullptr;
  const auto counts = [&](const char* way, const std::function<void()>& ask, const std::function<void()>& give_back) {
    calls = 0;
    counting = true;
    ask();
    counting = false;
    EXPECT_EQ(calls.load(), 1U) << way;
    EXPECT_NE(memory, nullptr) << way;
    give_back();
  };
  const auto release = [&] { free(memory); };
  counts(
      "malloc", [&] { memory = malloc(1); }, release);
  counts(
      "calloc", [&] { memory = calloc(1, 1); }, release);
  counts(
      "realloc", [&] { memory = realloc(nullptr, 1); }, release);
  counts(
      "reallocarray", [&] { memory = reallocarray(nullptr, 1, 1); }, release);
  counts(
      "aligned_alloc", [&] { memory = aligned_alloc(64, 64); }, release);
  counts(
      "memalign", [&] { memory = memalign(64, 64); }, release);
  counts(
      "valloc", [&] { memory = valloc(1); }, release);
  counts(
      "pvalloc", [&] { memory = pvalloc(1); }, release);
  counts(
      "posix_memalign", [&] { EXPECT_EQ(posix_memalign(&memory, 64, 64), 0); }, release);
  counts(
      "new", [&] { memory = ::operator new(1); }, [&] { ::operator delete(memory); });
  counts(
      "aligned new", [&] { memory = ::operator new (64, std::align_val_t{64}); },
      [&] { ::operator delete (memory, std::align_val_t{64}); });
}

TEST_F(SteadyState, HostAndShimAskForNothingAFrame) {
  const std::size_t all =
      calls_in(20000, "ramp frames=0 ! scale channel=distance ! make_depth ! null", "make_depth", "");
  EXPECT_LE(all, few);
}

/// Frames lent by the simulator without noise have two handles each; later nodes add none.
TEST_F(SteadyState, TheDecoderOfAnyExposuresAsksForNothing) {
  const std::size_t all =
      calls_in(1000, "simulator distance='1 m' frames=0 noise=none ! phase_decoder ! null", "phase_decoder", "monstar");
  EXPECT_LE(all, 2 * 1000 + few);
}

TEST_F(SteadyState, SimulatorDecoderModelAndCloudAskForNothing) {
  const std::size_t all =
      calls_in(2000, "simulator distance='1 m' frames=0 ! four_phase_decoder ! optimized_bistatic ! point_cloud ! null",
               "point_cloud", "camcube2");
  EXPECT_LE(all, few);
}

}  // namespace
}  // namespace tofgraph
