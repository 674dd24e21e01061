// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/codes.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::io {
namespace {

constexpr std::size_t min_count = 10;     ///< equal elements
constexpr double isolation = 1e-3;        ///< relative distance from other values
constexpr double far_above = 1.5;         ///< relative to the limit of 98 % of the values
constexpr double min_power_of_two = 256;  ///< smaller codes 2^n - 1 are indistinguishable from measurements

bool is_full_word(double value) {
  return value + 1 >= min_power_of_two && value == std::floor(value) &&
         std::exp2(std::round(std::log2(value + 1))) == value + 1;
}

}  // namespace

std::vector<SuspectedCode> suspected_codes(std::vector<double> values, double largest) {
  std::erase_if(values, [](double value) { return !(value > 0 && std::isfinite(value)); });
  std::ranges::sort(values);
  const std::size_t n = values.size();
  const double most = n == 0 ? 0 : values[n - 1 - n / 50];
  std::vector<SuspectedCode> codes;
  for (std::size_t begin = 0, end = 0; begin < n; begin = end) {
    const double value = values[begin];
    while (end < n && values[end] == value) ++end;
    const bool alone = (begin == 0 || values[begin - 1] < value * (1 - isolation)) &&
                       (end == n || values[end] > value * (1 + isolation));
    const bool repeated = end - begin >= min_count && end - begin < n && alone;
    const bool full = std::isfinite(largest) && is_full_word(value);
    if (value == largest || (repeated && (full || value > far_above * most))) codes.push_back({value, end - begin});
  }
  return codes;
}

}  // namespace tofgraph::io
