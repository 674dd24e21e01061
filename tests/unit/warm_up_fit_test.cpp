// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: WarmUpFit.TimeConstants*:WarmUpFit.NoDrift*
// Rooms: calibration
// The fit of a warm-up, compared with a dense scan of its likelihood and the Cramer-Rao bound of the simulated data.
#include "calibration/warm_up.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace tofgraph::calibration {
namespace {

constexpr double mm = 1e-3, minute = 60;

struct Truth {
  double drift, time_constant;  ///< m, s
  std::size_t points;
  bool dense_at_start;
  double span, noise;  ///< s, m
};

struct Drawn {
  std::vector<double> times, distances;
};

Drawn draw(const Truth& truth, std::mt19937_64& random) {
  std::normal_distribution<double> unit;
  Drawn drawn;
  for (std::size_t i = 0; i < truth.points; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(truth.points - 1);
    const double t = 5 + truth.span * (truth.dense_at_start ? share * share : share);
    drawn.times.push_back(t);
    drawn.distances.push_back(3 + truth.drift * (1 - std::exp(-t / truth.time_constant)) + truth.noise * unit(random));
  }
  return drawn;
}

/// Residual sum of squares of a regression line over 1 - exp(-t / tau), in closed form.
double squares(const Drawn& d, double tau) {
  const auto n = static_cast<double>(d.times.size());
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (std::size_t i = 0; i < d.times.size(); ++i) {
    const double e = 1 - std::exp(-d.times[i] / tau), v = d.distances[i] - 3;
    x += e;
    y += v;
    xx += e * e;
    xy += e * v;
    yy += v * v;
  }
  const double cov = xy - x * y / n, var = xx - x * x / n;
  return yy - y * y / n - cov * cov / var;
}

/// Relative Cramer-Rao bound of the time constant, from the 3 x 3 information matrix.
double bound(const Truth& truth, const Drawn& d) {
  std::array<std::array<double, 3>, 3> f{};
  for (const double t : d.times) {
    const double e = std::exp(-t / truth.time_constant);
    const std::array row = {1.0, 1 - e, -truth.drift * t / truth.time_constant * e};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) f[i][k] += row[i] * row[k];
    }
  }
  const double minor = f[0][0] * f[1][1] - f[0][1] * f[0][1];
  const double determinant = f[2][2] * minor - f[1][2] * (f[0][0] * f[1][2] - f[0][1] * f[0][2]) +
                             f[0][2] * (f[0][1] * f[1][2] - f[1][1] * f[0][2]);
  return truth.noise * std::sqrt(minor / determinant);
}

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

TEST(WarmUpFit, IsTheBestOfADenseScanOfTheLikelihood) {
  std::mt19937_64 random(3);
  for (const double tau : {2 * minute, 7 * minute, 12 * minute, 40 * minute}) {
    for (const std::size_t points : {10U, 24U, 80U}) {
      for (const bool dense : {false, true}) {
        const Truth truth{20 * mm, tau, points, dense, 120 * minute, 0.5 * mm};
        const Drawn d = draw(truth, random);
        if (bound(truth, d) > 0.25) continue;  // the likelihood is flat
        const Drift fit = fit_drift(d.times, d.distances, false);
        double best = 0, least = 1;
        for (double scanned = 0.5 * minute; scanned < 300 * minute; scanned *= 1.0005) {
          if (const double s = squares(d, scanned); s < least) {
            least = s;
            best = scanned;
          }
        }
        EXPECT_NEAR(fit.time_constant.value, best, 1e-3 * best)
            << tau << " s, " << points << " points: " << fit.time_constant.value << " for " << best << " s";
      }
    }
  }
}

TEST(WarmUpFit, TimeConstantsAreAsExactAsTheDataAllowAndTheirIntervalsHold) {
  std::mt19937_64 random(4);
  std::vector<double> errors;
  int inside = 0, judged = 0, slow = 0, fits = 0;
  for (int run = 0; run < 4; ++run) {
    for (const double tau : {2.0, 5.0, 7.0, 12.0, 15.0, 40.0}) {
      for (const std::size_t points : {10U, 14U, 24U, 60U, 200U}) {
        for (const double drift : {5 * mm, 20 * mm, 40 * mm}) {
          for (const bool dense : {false, true}) {
            const Truth truth{drift, tau * minute, points, dense, tau > 20 ? 8 * 60 * minute : 120 * minute, 0.3 * mm};
            const Drawn d = draw(truth, random);
            const Drift fit = fit_drift(d.times, d.distances);
            ++fits;
            slow += fit.has_slow() ? 1 : 0;
            if (bound(truth, d) >= 0.03) continue;
            EXPECT_TRUE(fit.seen) << tau << " min, " << points << " points, " << drift / mm << " mm";
            ++judged;
            errors.push_back(std::abs(fit.time_constant.value / truth.time_constant - 1));
            inside += std::abs(fit.time_constant.value - truth.time_constant) < 1.96 * fit.time_constant.sd ? 1 : 0;
          }
        }
      }
    }
  }
  std::printf(
      "%d fits with a bound below 3 %%: median error %.2f %%, 95 %% intervals hold %.1f %%; %d of %d fits with a "
      "second constant\n",
      judged, 100 * median(errors), 100.0 * inside / judged, slow, fits);
  EXPECT_GE(judged, 200);
  EXPECT_LT(median(errors), 0.05);
  EXPECT_GE(inside, 0.92 * judged);
  EXPECT_LE(inside, 0.98 * judged);
  EXPECT_LE(slow, 0.02 * fits) << "no second constant is there";
}

TEST(WarmUpFit, ASecondConstantIsFoundWhereItIs) {
  std::mt19937_64 random(5);
  Drawn d = draw({20 * mm, 6 * minute, 200, false, 480 * minute, 0.3 * mm}, random);
  for (std::size_t i = 0; i < d.times.size(); ++i)
    d.distances[i] -= 8 * mm * (1 - std::exp(-d.times[i] / (120 * minute)));
  const Drift fit = fit_drift(d.times, d.distances);
  ASSERT_TRUE(fit.has_slow());
  EXPECT_NEAR(fit.time_constant.value, 6 * minute, 4 * fit.time_constant.sd);
  EXPECT_NEAR(fit.slow_time_constant.value, 120 * minute, 4 * fit.slow_time_constant.sd);
  EXPECT_NEAR(fit.slow_drift.value, -8 * mm, 4 * fit.slow_drift.sd);
}

TEST(WarmUpFit, ASecondConstantIsFoundInSixteenPoints) {
  // Times of pipelines/chapter3/rmse_8h.yaml. With one constant alone the misfit would be taken for noise that hides
  // all drift.
  Drawn d;
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0, 0.1 * mm);
  for (const double t : {0, 5, 10, 15, 20, 30, 40, 60, 90, 120, 180, 240, 300, 360, 420, 480}) {
    d.times.push_back(t * minute);
    d.distances.push_back(0.5 + 19.5 * mm * (1 - std::exp(-t / 15)) - 20 * mm * (1 - std::exp(-t / 600)) +
                          noise(random));
  }
  const Drift fit = fit_drift(d.times, d.distances);
  ASSERT_TRUE(fit.has_slow());
  EXPECT_TRUE(fit.seen);
  EXPECT_NEAR(fit.drift.value, 19.5 * mm, 4 * fit.drift.sd);
  EXPECT_LT(fit.drift.sd, 1 * mm);
  EXPECT_NEAR(fit.time_constant.value, 15 * minute, 4 * fit.time_constant.sd);
  EXPECT_NEAR(fit.slow_time_constant.value, 600 * minute, 4 * fit.slow_time_constant.sd);
}

TEST(WarmUpFit, ASettlingTimeNeedsADrift) {
  std::mt19937_64 random(8);
  const Drawn warm = draw({20 * mm, 12 * minute, 60, false, 120 * minute, 0.5 * mm}, random);
  const double settled = settled_after(fit_drift(warm.times, warm.distances), 2 * mm, 120 * minute);
  EXPECT_NEAR(settled, 12 * minute * std::log(10), 2 * minute);
  const Drawn nothing = draw({0, 12 * minute, 60, false, 120 * minute, 0.5 * mm}, random);
  EXPECT_TRUE(std::isnan(settled_after(fit_drift(nothing.times, nothing.distances), 0.1 * mm, 120 * minute)));
}

TEST(WarmUpFit, NoDriftIsSeenInNoiseAndItsUpperLimitHolds) {
  std::mt19937_64 random(6);
  int seen = 0, above = 0, small = 0, runs = 0;
  for (const std::size_t points : {6U, 10U, 24U, 60U, 200U}) {
    for (int run = 0; run < 100; ++run) {
      const bool dense = run % 2 == 0;
      const Drawn nothing = draw({0, 720, points, dense, 120 * minute, 0.5 * mm}, random);
      seen += fit_drift(nothing.times, nothing.distances).seen ? 1 : 0;
      const double drift = 0.1 * mm;  // below the noise
      const Drawn hidden = draw({drift, 720, points, dense, 120 * minute, 0.5 * mm}, random);
      const Drift fit = fit_drift(hidden.times, hidden.distances);
      ++runs;
      if (fit.seen) continue;
      ++small;
      above += fit.upper_limit > drift ? 1 : 0;
    }
  }
  std::printf("a drift seen in noise: %d of %d; upper limit above a hidden drift: %d of %d\n", seen, runs, above,
              small);
  EXPECT_LE(seen, 5);
  EXPECT_GE(above, 0.95 * small);
}

}  // namespace
}  // namespace tofgraph::calibration
