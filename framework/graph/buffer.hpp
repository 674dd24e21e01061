// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Memory of channels: counted references, and a pool that hands the same blocks out again.
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

/// A block of memory, 64-byte aligned: the pool's, or lent by a plugin.
struct Buffer {
  void* data = nullptr;
  std::size_t capacity = 0;
  std::atomic<std::uint32_t> references{0};
  BufferPool* pool = nullptr;              ///< owner after the last release; null: lent
  Buffer* next_free = nullptr;             ///< of the same size, in the pool: giving back must not ask for memory
  void* owner = nullptr;                   ///< owner of lent memory
  void (*release)(void* owner) = nullptr;  ///< releases lent memory
};

/// Holds a buffer; the last holder gives it back.
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
  /// Nobody else holds it, and it is the pool's: it may be written.
  bool unique() const { return buffer_->pool != nullptr && buffer_->references.load(std::memory_order_acquire) == 1; }
  explicit operator bool() const { return buffer_ != nullptr; }

 private:
  void add() {
    if (buffer_ != nullptr) buffer_->references.fetch_add(1, std::memory_order_relaxed);
  }
  Buffer* buffer_ = nullptr;
};

/// Blocks by size. Thread-safe. Outlives every buffer that it made: whoever keeps one beyond the run keeps the pool.
class BufferPool : public std::enable_shared_from_this<BufferPool> {
 public:
  BufferPool() = default;
  BufferPool(const BufferPool&) = delete;
  BufferPool& operator=(const BufferPool&) = delete;
  ~BufferPool();

  /// @returns a buffer of at least `bytes`, content undefined. @throws std::bad_alloc
  BufferRef get(std::size_t bytes);
  /// A buffer around memory of a plugin.
  static BufferRef lent(void* data, std::size_t bytes, void* owner, void (*release)(void*));
  /// Number of blocks ever allocated from the system: constant in the steady state of a graph.
  std::size_t allocated() const { return allocated_.load(); }

 private:
  friend class BufferRef;
  void put_back(Buffer* buffer) noexcept;

  std::mutex mutex_;
  std::unordered_map<std::size_t, Buffer*> free_;  ///< the first of each size that was ever made
  std::atomic<std::size_t> allocated_{0};
};

}  // namespace tofgraph::graph
