// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/buffer.hpp"

#include <new>

namespace tofgraph::graph {
namespace {
constexpr std::align_val_t alignment{64};
constexpr std::size_t granule = 4096;
}  // namespace

BufferRef::~BufferRef() {
  if (buffer_ == nullptr || buffer_->references.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
  if (buffer_->pool != nullptr) {
    buffer_->pool->put_back(buffer_);
    return;
  }
  if (buffer_->release != nullptr) buffer_->release(buffer_->owner);
  delete buffer_;
}

BufferPool::~BufferPool() {
  for (auto& [size, first] : free_) {
    while (first != nullptr) {
      Buffer* buffer = std::exchange(first, first->next_free);
      ::operator delete(buffer->data, alignment);
      delete buffer;
    }
  }
}

BufferRef BufferPool::get(std::size_t bytes) {
  const std::size_t capacity = (std::max<std::size_t>(bytes, 1) + granule - 1) / granule * granule;
  {
    const std::scoped_lock lock(mutex_);
    if (Buffer*& first = free_[capacity]; first != nullptr) return BufferRef(std::exchange(first, first->next_free));
  }
  auto buffer = std::make_unique<Buffer>();
  buffer->data = ::operator new(capacity, alignment);
  buffer->capacity = capacity;
  buffer->pool = this;
  allocated_.fetch_add(1);
  return BufferRef(buffer.release());
}

BufferRef BufferPool::lent(void* data, std::size_t bytes, void* owner, void (*release)(void*)) {
  auto* buffer = new Buffer;
  buffer->data = data;
  buffer->capacity = bytes;
  buffer->owner = owner;
  buffer->release = release;
  return BufferRef(buffer);
}

void BufferPool::put_back(Buffer* buffer) noexcept {
  const std::scoped_lock lock(mutex_);
  Buffer*& first = free_.find(buffer->capacity)->second;  // inserted by get()
  buffer->next_free = std::exchange(first, buffer);
}

}  // namespace tofgraph::graph
