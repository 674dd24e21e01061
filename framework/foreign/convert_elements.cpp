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

/// Converts with a measurement's condition known to the compiler, which vectorises the single pass.
template <class T, class Number, class IsMeasurement>
bool ConvertEach(const std::uint8_t* HWY_RESTRICT in, std::size_t count, Number number, IsMeasurement is_measurement,
                 float* HWY_RESTRICT out) {
  int wrong = 0;
  for (std::size_t i = 0; i < count; ++i) {
    T value;
    std::memcpy(&value, in + i * sizeof(T), sizeof value);
    out[i] = number(value);
    wrong |= 1 - is_measurement(out[i]);
  }
  return wrong == 0;
}

template <class T> bool ConvertType(const std::uint8_t* HWY_RESTRICT in, std::size_t count, LinearScale conversion,
                                    float largest, float* HWY_RESTRICT out) {
  const double zero = conversion.zero, scale = conversion.scale;
  const auto is_length = [largest](float v) { return static_cast<int>(v > 0) & static_cast<int>(v <= largest); };
  const auto is_finite = [](float v) { return static_cast<int>(std::abs(v) <= std::numeric_limits<float>::max()); };
  const auto convert = [&](auto number) {
    return largest > 0 ? ConvertEach<T>(in, count, number, is_length, out)
                       : ConvertEach<T>(in, count, number, is_finite, out);
  };
  if constexpr (std::is_same_v<T, float>) {
    if (zero == 0 && scale == 1) return convert([](float value) { return value; });
  }
  if (zero == 0) return convert([scale](T value) { return static_cast<float>(static_cast<double>(value) * scale); });
  return convert([=](T value) { return static_cast<float>((static_cast<double>(value) - zero) * scale); });
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
