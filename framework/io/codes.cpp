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

/// Distinct values, ascending, and their numbers. @param values ascending
std::vector<SuspectedCode> distinct(const std::vector<double>& values) {
  std::vector<SuspectedCode> runs;
  for (const double value : values) {
    if (runs.empty() || runs.back().value != value) runs.push_back({value, 0});
    ++runs.back().count;
  }
  return runs;
}

/// Median distance of successive distinct values: 1 of integers that all occur, more of coarsely quantised values.
double median_gap(const std::vector<SuspectedCode>& runs) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < runs.size(); ++i) gaps.push_back(runs[i].value - runs[i - 1].value);
  if (gaps.size() < 2) return 0;
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>((gaps.size() - 1) / 2);
  std::ranges::nth_element(gaps, middle);
  return *middle;
}

}  // namespace

std::vector<SuspectedCode> suspected_codes(std::vector<double> values, double largest) {
  std::erase_if(values, [](double value) { return !(value > 0 && std::isfinite(value)); });
  std::ranges::sort(values);
  const std::vector<SuspectedCode> runs = distinct(values);
  const double min_gap = min_steps * median_gap(runs);
  const auto is_alone = [&](std::size_t i) {
    const double value = runs[i].value, gap = std::max(isolation * value, min_gap);
    return runs.size() > 1 && (i == 0 || runs[i - 1].value < value - gap) &&
           (i + 1 == runs.size() || runs[i + 1].value > value + gap);
  };
  std::vector<bool> repeated;
  std::vector<double> others;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    repeated.push_back(runs[i].count >= min_count && is_alone(i));
    if (!repeated[i]) others.insert(others.end(), runs[i].count, runs[i].value);
  }
  const double high =
      others.empty() ? std::numeric_limits<double>::infinity() : others[others.size() - 1 - others.size() / 50];
  std::vector<SuspectedCode> codes;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const double value = runs[i].value;
    const bool full = std::isfinite(largest) && is_full_word(value);
    const double factor = 50 * runs[i].count > values.size() ? far_above_many : far_above;
    if (value == largest || (repeated[i] && (full || value > factor * high))) codes.push_back(runs[i]);
  }
  return codes;
}

}  // namespace tofgraph::io
