// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Typed views of channels, and iteration over arrays of the plugin interface.
#pragma once

#include <tofgraph/plugin.h>

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace tofgraph {

/// TOFGRAPH_TYPE_.. of an element type; TOFGRAPH_TYPE_ANY for void.
template <class T> constexpr std::uint32_t element_type() {
  using V = std::remove_const_t<T>;
  if constexpr (std::is_void_v<V>) return TOFGRAPH_TYPE_ANY;
  constexpr std::size_t size = sizeof(std::conditional_t<std::is_void_v<V>, char, V>);
  if constexpr (std::is_floating_point_v<V>) return size == 4 ? TOFGRAPH_TYPE_F32 : TOFGRAPH_TYPE_F64;
  return size == 1             ? TOFGRAPH_TYPE_U8
         : size == 4           ? TOFGRAPH_TYPE_I32
         : std::is_signed_v<V> ? TOFGRAPH_TYPE_I16
                               : TOFGRAPH_TYPE_U16;
}

/// Size of one element in bytes; 0 for TOFGRAPH_TYPE_ANY.
constexpr std::size_t element_size(std::uint32_t type) {
  constexpr std::size_t sizes[] = {0, 4, 8, 1, 2, 2, 4};
  return type < std::size(sizes) ? sizes[type] : 0;
}

/// Readable name of an element type.
constexpr const char* element_name(std::uint32_t type) {
  constexpr const char* names[] = {"any", "float32", "float64", "uint8", "uint16", "int16", "int32"};
  return type < std::size(names) ? names[type] : "unknown";
}

/// Array of structs of the plugin interface, with the element size given at run time.
template <class T> struct Strided {
  T* first;
  std::size_t stride, size;  ///< bytes, elements
  T& operator[](std::size_t i) const {
    return *reinterpret_cast<T*>(reinterpret_cast<std::uintptr_t>(first) + i * stride);
  }
  struct Iterator {
    Strided all;
    std::size_t i;
    T& operator*() const { return all[i]; }
    void operator++() { ++i; }
    bool operator!=(const Iterator& other) const { return i != other.i; }
  };
  Iterator begin() const { return {*this, 0}; }
  Iterator end() const { return {*this, size}; }
};

inline Strided<const tofgraph_light> lights_of(const tofgraph_camera& camera) {
  return {camera.lights, camera.light_size, camera.light_count};
}

/// View without data, to be filled in by the host.
inline tofgraph_view empty_view() {
  tofgraph_view view{};
  view.size = sizeof view;
  return view;
}

/// Non-owning view of up to four dimensions, row-major without gaps.
template <class T> class Array {
 public:
  Array() = default;

  /// @throws std::runtime_error if the view has no data, elements of another type, or gaps
  explicit Array(const tofgraph_view& view) : view_(view) {
    if (view.data == nullptr) refuse(" is missing");
    if (view.type != element_type<T>()) refuse(std::string(" is not ") + element_name(element_type<T>()));
    auto stride = static_cast<std::int64_t>(sizeof(T));
    for (std::uint32_t i = view.rank; i-- > 0;) {
      if (view.stride[i] != stride) refuse(" has gaps");
      stride *= static_cast<std::int64_t>(view.extent[i]);
      size_ *= view.extent[i];
    }
  }

  T* data() const { return static_cast<T*>(view_.data); }
  std::size_t size() const { return view_.data != nullptr ? size_ : 0; }
  std::size_t rank() const { return view_.rank; }
  std::size_t extent(std::size_t i) const { return view_.extent[i]; }
  std::size_t rows() const { return view_.extent[0]; }
  std::size_t columns() const { return view_.extent[1]; }
  T* begin() const { return data(); }
  T* end() const { return data() + size(); }
  T& operator[](std::size_t i) const { return data()[i]; }
  /// Pixel of an image.
  T& operator()(std::size_t row, std::size_t column) const { return data()[row * columns() + column]; }
  std::span<T> span() const { return {data(), size()}; }
  /// The i-th slice along the slowest dimension: an image of a stack, a row of an image.
  std::span<T> slice(std::size_t i) const { return span().subspan(i * (size() / extent(0)), size() / extent(0)); }
  explicit operator bool() const { return view_.data != nullptr; }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw std::runtime_error((view_.channel != nullptr ? view_.channel : "the channel") + what);
  }

  tofgraph_view view_{};
  std::size_t size_ = 1;
};

}  // namespace tofgraph
