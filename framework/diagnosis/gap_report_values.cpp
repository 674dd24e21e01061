// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/gap_report_values.hpp"

#include <fmt/format.h>

#include <cmath>

namespace tofgraph::diagnosis {

std::string shown(double value, std::size_t observable) {
  if (!std::isfinite(value)) return "-";
  return observable == distance ? fmt::format("{:.3g} mm", 1e3 * value) : fmt::format("{:.3g} %", 100 * value);
}
double scaled(double value, std::size_t observable) { return observable == distance ? 1e3 * value : 100 * value; }
std::string unit_of(std::size_t observable) { return observable == distance ? "mm" : "%"; }

std::string label(std::size_t observable) { return observable_labels.at(observable); }

Residuals residuals(const Problem& problem, const State& state, std::size_t observable) {
  const auto rows = expected(problem, state);
  const std::size_t n = problem.design.superpixels();
  Residuals result(problem.data.size(), std::vector<double>(n, NAN));
  for (std::size_t i = 0; i < result.size(); ++i) {
    for (std::size_t s = 0; s < n; ++s) {
      const std::size_t row = observable * n + s;
      if (std::isinf(problem.data[i].variance[row])) continue;
      const double slope = observable == distance ? problem.design.shift(i)[row] : 1;  // half paths become depths
      result[i][s] = (problem.data[i].value[row] - rows[i][row]) / slope;
    }
  }
  return result;
}

double mean(const std::vector<double>& values) {
  double sum = 0, count = 0;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    sum += v;
    ++count;
  }
  return count > 0 ? sum / count : NAN;
}

}  // namespace tofgraph::diagnosis
