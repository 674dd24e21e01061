// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/codes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tofgraph::io {
namespace {

constexpr std::size_t min_count = 10;     ///< equal elements
constexpr double isolation = 1e-3;        ///< relative distance from other values
constexpr double min_steps = 1.5;         ///< distance from other values relative to the usual one
constexpr double far_above = 1.5;         ///< relative to the limit of 98 % of the values except isolated repeated ones
constexpr double far_above_many = 10;     ///< the same of more than 2 % of all values: a wall may be behind a board
constexpr double min_power_of_two = 256;  ///< smaller codes 2^n - 1 are indistinguishable from measurements

bool is_full_word(double value) {
  return value + 1 >= min_power_of_two && value == std::floor(value) &&
         std::exp2(std::round(std::log2(value + 1))) == value + 1;
}

/// Sorts values and joins those that are equal.
void join_equal(std::vector<CountedValue>& values) {
  if (!std::ranges::is_sorted(values, {}, &CountedValue::value)) std::ranges::sort(values, {}, &CountedValue::value);
  auto last = values.begin();
  for (auto next = values.begin(); next != values.end(); ++next) {
    if (next == last) continue;
    if (next->value == last->value)
      last->count += next->count;
    else
      *++last = *next;
  }
  if (last != values.end()) values.erase(last + 1, values.end());
}

/// Median distance of successive distinct values: 1 of integers that all occur, more of coarsely quantised values.
double median_gap(const std::vector<CountedValue>& runs) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < runs.size(); ++i) gaps.push_back(runs[i].value - runs[i - 1].value);
  if (gaps.size() < 2) return 0;
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>((gaps.size() - 1) / 2);
  std::ranges::nth_element(gaps, middle);
  return *middle;
}

/// The smallest value of a type if it is repeated without any similar value.
std::vector<CountedValue> code_at(double smallest, const std::vector<CountedValue>& values) {
  CountedValue lowest{smallest, 0};
  double next = std::numeric_limits<double>::infinity();
  for (const CountedValue& v : values) {
    if (v.value == smallest)
      lowest.count += v.count;
    else
      next = std::min(next, v.value);
  }
  const bool alone = next > smallest + std::max(isolation * -smallest, min_steps);
  return lowest.count >= min_count && alone ? std::vector{lowest} : std::vector<CountedValue>{};
}

}  // namespace

std::vector<CountedValue> suspected_codes(std::vector<CountedValue> runs, double largest, double smallest) {
  std::vector<CountedValue> codes;
  if (smallest < 0) codes = code_at(smallest, runs);
  std::erase_if(runs, [](const CountedValue& v) { return !(v.value > 0 && std::isfinite(v.value)); });
  join_equal(runs);
  const double min_gap = min_steps * median_gap(runs);
  const auto is_alone = [&](std::size_t i) {
    const double value = runs[i].value, gap = std::max(isolation * value, min_gap);
    return runs.size() > 1 && (i == 0 || runs[i - 1].value < value - gap) &&
           (i + 1 == runs.size() || runs[i + 1].value > value + gap);
  };
  std::vector<bool> repeated;
  std::size_t elements = 0, others = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    repeated.push_back(runs[i].count >= min_count && is_alone(i));
    elements += runs[i].count;
    if (!repeated[i]) others += runs[i].count;
  }
  double high = std::numeric_limits<double>::infinity();
  std::size_t above = others / 50;  // 2 %
  for (std::size_t i = runs.size(); i-- > 0 && std::isinf(high);) {
    if (repeated[i]) continue;
    if (runs[i].count > above) high = runs[i].value;
    above -= std::min(above, runs[i].count);
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const double value = runs[i].value;
    const double factor = 50 * runs[i].count > elements ? far_above_many : far_above;
    if (value == largest || (repeated[i] && (value > factor * high || (std::isfinite(largest) && is_full_word(value)))))
      codes.push_back(runs[i]);
  }
  return codes;
}

}  // namespace tofgraph::io
