// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Reference-counted channel memory, and a pool that reuses blocks.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>

namespace tofgraph::graph {

class BufferPool;

/// Memory block, 64-byte aligned: owned by the pool or lent by a plugin.
struct Buffer {
  void* data = nullptr;
  std::size_t capacity = 0;
  std::atomic<std::uint32_t> references{0};
  BufferPool* pool = nullptr;              ///< owner after the last release; null: lent
  Buffer* next_free = nullptr;             ///< free list of one size; intrusive, so that put_back() cannot fail
  void* owner = nullptr;                   ///< owner of lent memory
  void (*release)(void* owner) = nullptr;  ///< releases lent memory
};

/// Shared reference to a buffer; the last one returns it to the pool or the lender.
class BufferRef {
 public:
  BufferRef() = default;
  explicit BufferRef(Buffer* buffer) : buffer_(buffer) { add(); }
  BufferRef(const BufferRef& other) : buffer_(other.buffer_) { add(); }
  BufferRef(BufferRef&& other) noexcept : buffer_(std::exchange(other.buffer_, nullptr)) {}
  BufferRef& operator=(BufferRef other) noexcept {
    std::swap(buffer_, other.buffer_);
    return *this;
  }
  ~BufferRef();

  void* data() const { return buffer_->data; }
  std::size_t capacity() const { return buffer_->capacity; }
  /// Returns whether this is the only reference and the memory is the pool's, so that it may be written.
  bool unique() const { return buffer_->pool != nullptr && buffer_->references.load(std::memory_order_acquire) == 1; }
  explicit operator bool() const { return buffer_ != nullptr; }

 private:
  void add() {
    if (buffer_ != nullptr) buffer_->references.fetch_add(1, std::memory_order_relaxed);
  }
  Buffer* buffer_ = nullptr;
};

/// Pool of blocks by size. Thread-safe. Every buffer keeps its pool alive, also beyond the end of the run.
class BufferPool : public std::enable_shared_from_this<BufferPool> {
 public:
  BufferPool() = default;
  BufferPool(const BufferPool&) = delete;
  BufferPool& operator=(const BufferPool&) = delete;
  ~BufferPool();

  /// @returns a buffer of at least `bytes`, content undefined. @throws std::bad_alloc
  BufferRef get(std::size_t bytes);
  /// Wraps memory of a plugin in a buffer.
  static BufferRef lent(void* data, std::size_t bytes, void* owner, void (*release)(void*));
  /// Number of blocks ever allocated from the system; constant in the steady state of a graph.
  std::size_t allocated() const { return allocated_.load(); }

 private:
  friend class BufferRef;
  void put_back(Buffer* buffer) noexcept;

  std::mutex mutex_;
  std::unordered_map<std::size_t, Buffer*> free_;  ///< first free block by size; an entry for each size ever requested
  std::atomic<std::size_t> allocated_{0};
};

}  // namespace tofgraph::graph
