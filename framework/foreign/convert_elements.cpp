// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Highway compiles the plain loops for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "framework/foreign/convert_elements.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <hwy/highway.h>
#include <tofgraph/file_format.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "foreign/convert_elements.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::foreign::HWY_NAMESPACE {

template <class T> bool ConvertType(const std::uint8_t* HWY_RESTRICT in, std::size_t count, LinearScale conversion,
                                    float largest, float* HWY_RESTRICT out) {
  const double zero = conversion.zero, scale = conversion.scale;
  if (std::is_same_v<T, float> && zero == 0 && scale == 1) {
    std::memcpy(out, in, count * sizeof(T));
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      T value;
      std::memcpy(&value, in + i * sizeof(T), sizeof value);
      out[i] = static_cast<float>((static_cast<double>(value) - zero) * scale);
    }
  }
  int wrong = 0;
  if (largest > 0) {
    for (std::size_t i = 0; i < count; ++i)
      wrong |= 1 - (static_cast<int>(out[i] > 0) & static_cast<int>(out[i] <= largest));
  } else {
    for (std::size_t i = 0; i < count; ++i)
      wrong |= 1 - static_cast<int>(std::abs(out[i]) <= std::numeric_limits<float>::max());
  }
  return wrong == 0;
}

bool Convert(ElementType type, const std::uint8_t* in, std::size_t count, LinearScale conversion, float largest,
             float* out) {
  return with_element(type,
                      [&](auto zero) { return ConvertType<decltype(zero)>(in, count, conversion, largest, out); });
}

}  // namespace tofgraph::foreign::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tofgraph::foreign {

HWY_EXPORT(Convert);

bool convert_elements(ElementType type, const std::uint8_t* in, std::size_t count, LinearScale conversion,
                      float largest, float* out) {
  return HWY_DYNAMIC_DISPATCH(Convert)(type, in, count, conversion, largest, out);
}

}  // namespace tofgraph::foreign
#endif
