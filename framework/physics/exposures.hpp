// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Raw images of a frame with any phase steps at one or more frequencies: determines which of them give a phase and
/// computes it by linear least squares, in double. A sample is c_k = A_k - B_k = x cos(theta_k) - y sin(theta_k) +
/// offset with x = amplitude cos(Psi), y = amplitude sin(Psi).
#pragma once

#include <tofgraph/array.hpp>
#include <tofgraph/physics/constants.hpp>
#include <tofgraph/physics/phasor.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace tofgraph::physics {

using Exposures = std::vector<tofgraph_exposure>;
inline constexpr std::size_t max_exposures = 32, min_exposures = 3;

/// 0, 90, 180, 270 degrees at the frame's own frequency.
inline const std::array<tofgraph_exposure, 4> four_exposures = {
    {{0, 0}, {std::numbers::pi / 2, 0}, {2 * (std::numbers::pi / 2), 0}, {3 * (std::numbers::pi / 2), 0}}};

inline Exposures exposures_of(const Strided<const tofgraph_exposure>& exposures) {
  Exposures all(four_exposures.begin(), four_exposures.end());
  if (exposures.size == 0) return all;
  all.clear();
  for (const tofgraph_exposure& exposure : exposures) all.push_back(exposure);
  return all;
}
/// Exposures of the camera; four_exposures if it states none.
inline Exposures exposures_of(const tofgraph_camera& camera) {
  return exposures_of({camera.exposures, camera.exposure_size, camera.exposure_count});
}

/// Frequency of each exposure, Hz. @param own the frame's modulation frequency, used for exposures that state none
inline std::vector<double> frequencies_of(const Exposures& exposures, double own) {
  std::vector<double> frequencies;
  for (const tofgraph_exposure& e : exposures) frequencies.push_back(e.frequency > 0 ? e.frequency : own);
  return frequencies;
}

inline bool same_exposures(const Exposures& a, const Exposures& b) {
  return std::ranges::equal(a, b, [](const tofgraph_exposure& x, const tofgraph_exposure& y) {
    return std::abs(x.phase - y.phase) < 1e-9 && x.frequency == y.frequency;
  });
}
/// Compares the steps modulo 2 pi and the frequencies. @param frequency used for exposures that state none, Hz
inline bool same_steps(const Exposures& a, const Exposures& b, double frequency) {
  return std::ranges::equal(a, b, [&](const tofgraph_exposure& x, const tofgraph_exposure& y) {
    const auto of = [&](const tofgraph_exposure& e) { return e.frequency > 0 ? e.frequency : frequency; };
    return std::abs(std::remainder(x.phase - y.phase, two_pi)) < 1e-9 && of(x) == of(y);
  });
}
/// True for four_exposures, which files omit.
inline bool are_default(const Exposures& exposures) {
  return same_exposures(exposures, {four_exposures.begin(), four_exposures.end()});
}

/// True if the step equals this number of quarter turns, modulo whole turns.
inline bool is_quarter(double phase, double quarters) {
  return std::abs(std::remainder(phase - quarters * std::numbers::pi / 2, two_pi)) < 1e-9;
}

/// Indices of the images of 0, 90, 180, 270 degrees among four steps of 90 degrees at one frequency, in any order and
/// with either sign. Empty for other exposures.
inline std::vector<std::size_t> quarter_order(const Exposures& exposures) {
  std::vector<std::size_t> order;
  for (int quarter = 0; quarter < 4 && exposures.size() == 4; ++quarter) {
    const auto found =
        std::ranges::find_if(exposures, [&](const tofgraph_exposure& e) { return is_quarter(e.phase, quarter); });
    const bool same = found != exposures.end() && found->frequency == exposures[0].frequency;
    if (same) order.push_back(static_cast<std::size_t>(found - exposures.begin()));
  }
  return order.size() == 4 ? order : std::vector<std::size_t>{};
}

/// True for four_exposures in their order.
inline bool are_the_four(const Exposures& exposures) {
  return quarter_order(exposures) == std::vector<std::size_t>{0, 1, 2, 3};
}

/// Number with at most four decimal places: "31.7012", "0".
inline std::string short_number(double value) {
  std::string text = std::to_string(std::round(value * 1e4) / 1e4);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text;
}

/// Text: "4 exposures: 0, 90, 180, 270 deg", "6 exposures: 0, 120, 240 deg at 80 MHz; 0, 120, 240 deg at 16 MHz".
inline std::string exposures_text(const Exposures& exposures) {
  std::string text = std::to_string(exposures.size()) + " exposures: ";
  for (std::size_t k = 0; k < exposures.size(); ++k) {
    const double frequency = exposures[k].frequency;
    const bool last = k + 1 == exposures.size();
    text += short_number(exposures[k].phase * 180 / std::numbers::pi);
    if (!last && exposures[k + 1].frequency == frequency) {
      text += ", ";
      continue;
    }
    text += " deg" + (frequency > 0 ? " at " + short_number(frequency * 1e-6) + " MHz" : std::string());
    if (!last) text += "; ";
  }
  return text;
}

/// Exposures of one frequency and the least squares of the phase: x = sum cosine[j] c[image[j]], y with sine, both
/// independent of the offset. The orthonormal rows of `rest` span the residual space of the fit.
struct PhaseFit {
  double frequency = 0;  ///< Hz; 0: the frame's own
  std::vector<std::size_t> image;
  std::vector<double> cosine, sine;
  std::vector<std::vector<double>> rest;
  double xx = 0, xy = 0, yy = 0;  ///< covariance of x and y for samples of variance 1

  /// Phase variance relative to that of the same number of equal steps; 1 is the optimum.
  double loss() const { return (xx + yy) * static_cast<double>(image.size()) / 4; }
};

/// @returns cosine and sine empty when the steps leave the phase undetermined
inline PhaseFit phase_fit(const Exposures& exposures, double frequency) {
  PhaseFit fit;
  fit.frequency = frequency;
  using Row = std::vector<double>;
  std::array<Row, 3> columns;  // of the design matrix: cos, -sin, 1
  for (std::size_t k = 0; k < exposures.size(); ++k) {
    if (exposures[k].frequency != frequency) continue;
    fit.image.push_back(k);
    columns[0].push_back(std::cos(exposures[k].phase));
    columns[1].push_back(-std::sin(exposures[k].phase));
    columns[2].push_back(1);
  }
  const std::size_t n = fit.image.size();
  const auto dot = [](const Row& a, const Row& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
  };
  // Gram-Schmidt, twice to limit rounding errors; unit vectors after the three columns span the residual space.
  std::vector<Row> basis;
  const auto add = [&](Row v, double least) {
    for (int twice = 0; twice < 2; ++twice) {
      for (const Row& b : basis) {
        const double along = dot(b, v);
        for (std::size_t i = 0; i < n; ++i) v[i] -= along * b[i];
      }
    }
    const double length = std::sqrt(dot(v, v));
    if (length <= least) return false;
    for (double& value : v) value /= length;
    basis.push_back(std::move(v));
    return true;
  };
  // The offset first: the other two columns are orthogonalised against it.
  std::array<Row, 2> free = {columns[0], columns[1]};
  for (Row& column : free) {
    const double mean = dot(column, columns[2]) / static_cast<double>(std::max<std::size_t>(n, 1));
    for (double& value : column) value -= mean;
  }
  const double cc = dot(free[0], free[0]), cs = dot(free[0], free[1]), ss = dot(free[1], free[1]);
  const double determinant = cc * ss - cs * cs;
  if (n < min_exposures || !(determinant > 1e-8)) return fit;
  fit.xx = ss / determinant;
  fit.xy = -cs / determinant;
  fit.yy = cc / determinant;
  for (std::size_t i = 0; i < n; ++i) {
    fit.cosine.push_back(fit.xx * free[0][i] + fit.xy * free[1][i]);
    fit.sine.push_back(fit.xy * free[0][i] + fit.yy * free[1][i]);
  }
  for (const Row& column : {columns[2], columns[0], columns[1]}) add(column, 0);
  for (std::size_t i = 0; i < n && basis.size() < n; ++i) {
    Row unit(n, 0);
    unit[i] = 1;
    if (add(unit, 1e-6)) fit.rest.push_back(basis.back());
  }
  return fit;
}

/// Distinct frequencies in ascending order.
inline std::vector<double> each_once(std::vector<double> frequencies) {
  std::ranges::sort(frequencies);
  frequencies.erase(std::unique(frequencies.begin(), frequencies.end()), frequencies.end());
  return frequencies;
}

/// Fits per frequency in ascending order.
inline std::vector<PhaseFit> phase_fits(const Exposures& exposures) {
  std::vector<PhaseFit> fits;
  for (const double frequency : each_once(frequencies_of(exposures, 0)))
    fits.push_back(phase_fit(exposures, frequency));
  return fits;
}

/// Reason why these are not four_exposures in their order, as a sentence; empty if they are.
inline std::string not_the_four(const Exposures& exposures) {
  if (are_the_four(exposures)) return {};
  return "needs four exposures at 0, 90, 180 and 270 deg of one frequency, in this order; there are " +
         exposures_text(exposures);
}

/// Reason why these are not exposures of one frequency, as a sentence; empty if they are.
inline std::string not_one_frequency(const Exposures& exposures) {
  if (phase_fits(exposures).size() == 1) return {};
  return "needs exposures of one frequency; there are " + exposures_text(exposures);
}

/// Reason why these exposures do not determine a phase, as a sentence; empty if they do.
inline std::string exposures_problem(const Exposures& exposures) {
  if (exposures.size() < min_exposures || exposures.size() > max_exposures)
    return "a frame has " + std::to_string(exposures.size()) + " exposures, expected 3 to 32";
  const bool own = exposures[0].frequency == 0;
  for (std::size_t k = 0; k < exposures.size(); ++k) {
    const double phase = exposures[k].phase, frequency = exposures[k].frequency;
    const std::string name = "exposure " + std::to_string(k);
    if (!std::isfinite(phase)) return name + " has no phase";
    if (!own && frequency == 0) return name + " has a frequency of 0 Hz or none, but others have one";
    if (own ? frequency != 0 : !(frequency >= 1e3 && frequency <= 1e10))
      return name + " has the frequency " + short_number(frequency) + " Hz, expected " +
             (own ? "none, as the others" : "1 kHz to 10 GHz");
  }
  for (const PhaseFit& fit : phase_fits(exposures)) {
    const std::string at = own ? "" : " at " + short_number(fit.frequency * 1e-6) + " MHz";
    std::string steps;
    std::size_t different = 0;
    for (std::size_t i = 0; i < fit.image.size(); ++i) {
      const double phase = exposures[fit.image[i]].phase;
      steps += (i == 0 ? "" : ", ") + short_number(phase * 180 / std::numbers::pi);
      const bool again =
          std::any_of(fit.image.begin(), fit.image.begin() + static_cast<std::ptrdiff_t>(i),
                      [&](auto k) { return std::abs(std::remainder(exposures[k].phase - phase, two_pi)) < 1e-9; });
      if (!again) ++different;
    }
    if (different < min_exposures)
      return "the steps " + steps + " deg" + at + " are only " + std::to_string(different) +
             " different ones, expected at least three of each frequency";
    if (fit.cosine.empty() || fit.loss() > 1e4)
      return "the steps " + steps + " deg" + at + " are so close to each other that the phase is undetermined";
  }
  return {};
}

}  // namespace tofgraph::physics
