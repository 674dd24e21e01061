// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "conformance/allocations.hpp"

#include <malloc.h>

#include <atomic>
#include <cstdlib>

namespace tofgraph::conformance {
namespace {
std::atomic<bool> counting{false};
std::atomic<std::size_t> calls{0};

void count_call() {
  if (counting.load(std::memory_order_relaxed)) calls.fetch_add(1, std::memory_order_relaxed);
}
}  // namespace

CountedCalls::CountedCalls() {
  calls = 0;
  counting = true;
}
CountedCalls::~CountedCalls() { counting = false; }
std::size_t CountedCalls::count() { return calls; }

std::size_t memory_in_use() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

}  // namespace tofgraph::conformance

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// The wrappers call the C library's own functions; operator new uses malloc.
using tofgraph::conformance::count_call;
extern "C" {
void* __libc_malloc(std::size_t size);                           // NOLINT
void* __libc_calloc(std::size_t number, std::size_t size);       // NOLINT
void* __libc_realloc(void* memory, std::size_t size);            // NOLINT
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT
void* __libc_valloc(std::size_t size);                           // NOLINT
void* __libc_pvalloc(std::size_t size);                          // NOLINT
#define TOFGRAPH_REPLACES __attribute__((visibility("default")))
TOFGRAPH_REPLACES void* malloc(std::size_t size) { return count_call(), __libc_malloc(size); }
TOFGRAPH_REPLACES void* calloc(std::size_t number, std::size_t size) {
  return count_call(), __libc_calloc(number, size);
}
TOFGRAPH_REPLACES void* realloc(void* memory, std::size_t size) { return count_call(), __libc_realloc(memory, size); }
TOFGRAPH_REPLACES void* reallocarray(void* memory, std::size_t number, std::size_t size) {
  std::size_t bytes = 0;
  count_call();
  return __builtin_mul_overflow(number, size, &bytes) ? nullptr : __libc_realloc(memory, bytes);
}
TOFGRAPH_REPLACES void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return count_call(), __libc_memalign(alignment, size);
}
TOFGRAPH_REPLACES void* memalign(std::size_t alignment, std::size_t size) {
  return count_call(), __libc_memalign(alignment, size);
}
TOFGRAPH_REPLACES void* valloc(std::size_t size) { return count_call(), __libc_valloc(size); }
TOFGRAPH_REPLACES void* pvalloc(std::size_t size) { return count_call(), __libc_pvalloc(size); }
TOFGRAPH_REPLACES int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  count_call();
  *memory = __libc_memalign(alignment, size);
  return *memory != nullptr ? 0 : 12;
}
}
#endif
