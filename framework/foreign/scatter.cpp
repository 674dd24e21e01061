// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "foreign/scatter.hpp"

#include "foreign/convert_elements.hpp"

#include <tofgraph/channels.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <vector>

namespace tofgraph::foreign {
namespace {

template <class T> T element(const std::uint8_t* in, std::uint64_t i) {
  T value;
  std::memcpy(&value, in + i * sizeof(T), sizeof value);
  return value;
}

/// Calls run(first input element, first output element, count, output step) for each run of the fastest axis.
template <class Run> void each_run(std::span<const AxisStep> steps, Run&& run) {
  const AxisStep last = steps.back();
  std::uint64_t outer = 1;
  for (const AxisStep& axis : steps.first(steps.size() - 1)) outer *= axis.extent;
  for (std::uint64_t i = 0; i < outer; ++i) {
    std::uint64_t rest = i, to = 0;
    for (std::size_t axis = steps.size() - 1; axis-- > 0;) {
      to += rest % steps[axis].extent * steps[axis].step;
      rest /= steps[axis].extent;
    }
    run(i * last.extent, to, last.extent, last.step);
  }
}

template <class T, class U> class Scatter {
 public:
  Scatter(const Conversion& conversion, const std::uint8_t* in, U* out, std::uint16_t* flags)
      : c_(conversion), in_(in), out_(out), flags_(flags) {}

  void operator()(std::uint64_t from, std::uint64_t to, std::uint64_t count, std::uint64_t step) const {
    to += c_.first;
    if constexpr (std::is_same_v<U, float>) {
      if (step == 1 && !c_.mask && c_.signed_bits == 0 && c_.invalid.empty()) return convert_run(from, to, count);
    }
    for (std::uint64_t i = 0; i < count; ++i) {
      const T given = element<T>(in_, from + i);
      const std::uint64_t at = to + i * step;
      const std::uint16_t found = flags_of(given);
      if (found != 0 && flags_ != nullptr) flags_[at / c_.per_pixel % c_.pixels] |= found;
      out_[at] = (found & flag::invalid) != 0 ? nothing() : converted(number_of(given));
    }
  }

 private:
  /// Converts contiguous elements without masks and codes.
  void convert_run(std::uint64_t from, std::uint64_t to, std::uint64_t count) const {
    constexpr std::uint64_t part = 1024;  // fits into the cache
    constexpr std::uint32_t kind = std::is_floating_point_v<T> ? TOFGRAPH_ELEMENT_FLOAT
                                   : std::is_signed_v<T>       ? TOFGRAPH_ELEMENT_SIGNED
                                                               : TOFGRAPH_ELEMENT_UNSIGNED;
    for (std::uint64_t begin = 0; begin < count; begin += part) {
      const std::uint64_t n = std::min(part, count - begin);
      U* out = out_ + to + begin;
      if (convert_elements({kind, sizeof(T)}, in_ + (from + begin) * sizeof(T), n, {c_.zero, c_.scale},
                           c_.is_length ? max_length : 0, out) ||
          (std::is_integral_v<T> && !c_.is_length))
        continue;
      for (std::uint64_t i = 0; i < n; ++i) {
        if (c_.is_length ? is_valid_length(out[i]) : std::isfinite(out[i])) continue;
        count_refused(static_cast<float>(out[i]), static_cast<double>(element<T>(in_, from + begin + i)));
        out[i] = nothing();
        if (flags_ != nullptr) flags_[(to + begin + i) / c_.per_pixel % c_.pixels] |= flag::invalid;
      }
    }
  }
  static constexpr U nothing() {
    if constexpr (std::is_floating_point_v<U>) return std::numeric_limits<U>::quiet_NaN();
    return U{0};
  }
  double number_of(T value) const {
    if constexpr (std::is_integral_v<T>) {
      if (c_.mask) return static_cast<double>(static_cast<T>(static_cast<std::uint64_t>(value) & *c_.mask));
      if (c_.signed_bits != 0) {
        const std::uint64_t sign = std::uint64_t{1} << (c_.signed_bits - 1);
        const std::uint64_t bits = static_cast<std::uint64_t>(value) & (2 * sign - 1);
        return static_cast<double>(static_cast<std::int64_t>(bits ^ sign) - static_cast<std::int64_t>(sign));
      }
    }
    return static_cast<double>(value);
  }
  void count_refused(float length, double stored) const {
    if (c_.is_length && c_.refused != nullptr) c_.refused->add(length, stored);
  }
  std::uint16_t flags_of(T value) const {
    const double code = c_.signed_bits != 0 ? number_of(value) : static_cast<double>(value);
    if (std::ranges::binary_search(c_.invalid, code)) return flag::invalid;
    std::uint16_t flags = 0;
    if constexpr (std::is_integral_v<T>) {
      const std::uint64_t word = static_cast<std::make_unsigned_t<T>>(value);
      std::uint64_t dropped = c_.mask ? word & ~*c_.mask : 0;
      for (const StatusBits& status : c_.status) {
        if ((word & status.bits) != 0) flags |= status.flags;
        dropped &= ~status.bits;
      }
      if (dropped != 0 && c_.dropped != nullptr) {
        c_.dropped->bits |= dropped;
        ++c_.dropped->count;
      }
    }
    if (c_.mask && std::ranges::binary_search(c_.invalid, number_of(value))) flags |= flag::invalid;
    return (flags & flag::invalid) != 0 || is_measurement(value) ? flags : flags | flag::invalid;
  }
  bool is_measurement(T value) const {
    const auto si = static_cast<float>((number_of(value) - c_.zero) * c_.scale);
    bool valid = !c_.is_length || is_valid_length(si);
    if constexpr (std::is_floating_point_v<T>) valid = valid && std::isfinite(value);
    if (!valid) count_refused(si, number_of(value));
    return valid;
  }
  U converted(double value) const {
    const double shifted = value - c_.zero;
    if constexpr (std::is_floating_point_v<U>) return static_cast<U>(shifted * c_.scale);
    if (!(shifted >= static_cast<double>(std::numeric_limits<U>::min()) &&
          shifted <= static_cast<double>(std::numeric_limits<U>::max()) && shifted == std::floor(shifted)))
      throw ForeignError(
          fmt::format("the value {} does not fit into a channel of {} to {}: check 'zero', 'mask' and "
                      "'type'",
                      shifted, std::numeric_limits<U>::min(), std::numeric_limits<U>::max()));
    return static_cast<U>(shifted);
  }

  const Conversion& c_;
  const std::uint8_t* in_;
  U* out_;
  std::uint16_t* flags_;
};

template <class T> void scatter_from(const std::uint8_t* in, std::span<const AxisStep> steps, const Conversion& c,
                                     void* out, std::uint16_t* flags) {
  switch (c.type) {
    case TOFGRAPH_TYPE_U16:
      return each_run(steps, Scatter<T, std::uint16_t>(c, in, static_cast<std::uint16_t*>(out), flags));
    case TOFGRAPH_TYPE_I16:
      return each_run(steps, Scatter<T, std::int16_t>(c, in, static_cast<std::int16_t*>(out), flags));
    case TOFGRAPH_TYPE_I32:
      return each_run(steps, Scatter<T, std::int32_t>(c, in, static_cast<std::int32_t*>(out), flags));
    default:
      return each_run(steps, Scatter<T, float>(c, in, static_cast<float*>(out), flags));
  }
}

/// Merges successive axes that are contiguous in both input and output.
std::vector<AxisStep> merged(std::span<const AxisStep> steps) {
  std::vector<AxisStep> result;
  for (const AxisStep& axis : steps) {
    if (!result.empty() && result.back().step == axis.extent * axis.step)
      result.back() = {result.back().extent * axis.extent, axis.step};
    else
      result.push_back(axis);
  }
  return result;
}

}  // namespace

void scatter(const FileArray& array, const std::uint8_t* in, std::span<const AxisStep> stated, const Conversion& c,
             void* out, std::uint16_t* flags) {
  const std::vector<AxisStep> steps = merged(stated);
  std::uint64_t words = 1;
  for (const AxisStep& axis : steps) words *= axis.extent;
  if (c.dropped != nullptr) c.dropped->words += words;
  with_element({array.kind, array.bytes}, [&](auto zero) { scatter_from<decltype(zero)>(in, steps, c, out, flags); });
}

void mark_invalid_points(float* points, std::uint16_t* flags, std::uint64_t pixels, io::RefusedLengths& refused) {
  const PointRule rule("");
  for (std::uint64_t i = 0; i < pixels; ++i) {
    const std::span<const float> point(points + 3 * i, 3);
    if (rule.is_valid(point.data())) continue;
    if (std::ranges::none_of(point, [](float v) { return std::isnan(v); })) {
      const bool origin = std::ranges::all_of(point, [](float v) { return v == 0; });
      const float length = origin ? 0 : std::numeric_limits<float>::infinity();
      refused.add(length, static_cast<double>(length));
    }
    std::fill_n(points + 3 * i, 3, std::numeric_limits<float>::quiet_NaN());
    if (flags != nullptr) flags[i] |= flag::invalid;
  }
}

}  // namespace tofgraph::foreign
