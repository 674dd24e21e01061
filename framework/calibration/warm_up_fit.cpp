// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Exponentials by variable projection: for each time constant the lengths follow from linear least squares.
#include "calibration/warm_up.hpp"

#include <Eigen/Dense>

#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

namespace tofgraph::calibration {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

constexpr double slow_ratio = 3;     ///< of two time constants: closer ones cannot be told apart
constexpr double min_bic_gain = 10;  ///< for a second time constant: very strong evidence (Kass and Raftery 1995)
constexpr double max_spans = 5;      ///< of the recording: slower drift is a straight line in it
constexpr double min_drift_sds = 3;  ///< standard deviations of a drift that is seen
constexpr std::size_t grid = 60;     ///< time constants that are tried first, in equal ratios

double warm(double time, double tau) { return -std::expm1(-time / tau); }

Matrix columns_of(const Vector& t, const std::vector<double>& taus) {
  Matrix a(t.size(), static_cast<Eigen::Index>(1 + taus.size()));
  for (Eigen::Index i = 0; i < t.size(); ++i) {
    a(i, 0) = 1;
    for (std::size_t k = 0; k < taus.size(); ++k) a(i, static_cast<Eigen::Index>(k + 1)) = warm(t[i], taus[k]);
  }
  return a;
}

/// Squares left with these time constants.
double left(const Vector& t, const Vector& y, const std::vector<double>& taus) {
  const Matrix a = columns_of(t, taus);
  return (y - a * a.colPivHouseholderQr().solve(y)).squaredNorm();
}

/// Where f is least between a and b, in the logarithm.
double least(double a, double b, const std::function<double(double)>& f) {
  constexpr double ratio = 1 / std::numbers::phi;
  double low = std::log(a), high = std::log(b);
  double x1 = high - ratio * (high - low), x2 = low + ratio * (high - low);
  double f1 = f(std::exp(x1)), f2 = f(std::exp(x2));
  while (high - low > 1e-6) {
    if (f1 < f2) {
      high = x2;
      x2 = x1;
      f2 = f1;
      x1 = high - ratio * (high - low);
      f1 = f(std::exp(x1));
    } else {
      low = x1;
      x1 = x2;
      f1 = f2;
      x2 = low + ratio * (high - low);
      f2 = f(std::exp(x2));
    }
  }
  return std::exp((low + high) / 2);
}

/// The best of a grid and of the surroundings of its best.
double search(double from, double to, const std::function<double(double)>& f) {
  const double step = std::pow(to / from, 1.0 / static_cast<double>(grid - 1));
  double best = from, value = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < grid; ++k) {
    const double tau = from * std::pow(step, static_cast<double>(k));
    if (const double now = f(tau); now < value) {
      value = now;
      best = tau;
    }
  }
  return least(std::max(best / step, from), std::min(best * step, to), f);
}

struct Bounds {
  double shortest, longest;  ///< s
};

Bounds bounds_of(const Vector& t) {
  const double span = t[t.size() - 1] - t[0];
  return {std::max(span / static_cast<double>(t.size()), 1.0), max_spans * span};
}

std::vector<double> one_constant(const Vector& t, const Vector& y) {
  const Bounds b = bounds_of(t);
  return {search(b.shortest, b.longest, [&](double tau) { return left(t, y, {tau}); })};
}

std::vector<double> two_constants(const Vector& t, const Vector& y) {
  const Bounds b = bounds_of(t);
  double slow = 0;
  const auto best_slow = [&](double tau) {
    return search(std::min(slow_ratio * tau, b.longest), b.longest, [&](double other) {
      return left(t, y, {tau, other});
    });
  };
  const double fast = search(b.shortest, b.longest / slow_ratio, [&](double tau) {
    return left(t, y, {tau, best_slow(tau)});
  });
  slow = best_slow(fast);
  return {fast, slow};
}

double bic(double squares, std::size_t points, std::size_t parameters) {
  const auto n = static_cast<double>(points);
  return n * std::log(squares / n) + static_cast<double>(parameters) * std::log(n);
}

/// How many points say as much as one independent one: 1 + 2 sum of the autocorrelations of what a fit leaves, up to
/// the first that is lost in the noise (Sokal 1997).
double points_per_independent(const Vector& residual) {
  const Eigen::Index n = residual.size();
  const double square = residual.squaredNorm(), lost = 1 / std::sqrt(static_cast<double>(n));
  double sum = 1;
  for (Eigen::Index lag = 1; lag < n / 4 && square > 0; ++lag) {
    const double r = residual.head(n - lag).dot(residual.tail(n - lag)) / square;
    if (r < lost) break;
    sum += 2 * r;
  }
  return sum;
}

void set_estimates(const Vector& t, const Vector& y, const std::vector<double>& taus, Drift& drift) {
  const Matrix a = columns_of(t, taus);
  const Vector x = a.colPivHouseholderQr().solve(y);
  const Vector residual = y - a * x;
  Matrix jacobian(t.size(), static_cast<Eigen::Index>(1 + 2 * taus.size()));
  jacobian.leftCols(a.cols()) = a;
  for (std::size_t k = 0; k < taus.size(); ++k) {
    const double tau = taus[k];
    for (Eigen::Index i = 0; i < t.size(); ++i)
      jacobian(i, a.cols() + static_cast<Eigen::Index>(k)) =
          -x[static_cast<Eigen::Index>(k + 1)] * t[i] / (tau * tau) * std::exp(-t[i] / tau);
  }
  const auto freedom = static_cast<double>(std::max<Eigen::Index>(t.size() - jacobian.cols(), 1));
  const double squares = residual.squaredNorm();
  drift.scatter = std::sqrt(squares / freedom);
  drift.redundancy = points_per_independent(residual);
  const Matrix covariance = (jacobian.transpose() * jacobian).completeOrthogonalDecomposition().pseudoInverse() *
                            (squares / freedom * drift.redundancy);
  const auto estimate = [&](Eigen::Index k, double value) {
    return Estimate{value, std::sqrt(std::max(covariance(k, k), 0.0))};
  };
  drift.start = estimate(0, x[0]);
  drift.drift = estimate(1, x[1]);
  drift.time_constant = estimate(a.cols(), taus[0]);
  if (taus.size() > 1) {
    drift.slow_drift = estimate(2, x[2]);
    drift.slow_time_constant = estimate(a.cols() + 1, taus[1]);
  }
  const auto points = static_cast<std::size_t>(t.size());
  const double constant = bic((y.array() - y.mean()).matrix().squaredNorm(), points, 1);
  drift.seen = std::abs(drift.drift.value) > min_drift_sds * drift.drift.sd ||
               (points > 4 && (constant - bic(squares, points, 3)) / drift.redundancy > min_bic_gain);
}

Vector as_vector(const std::vector<double>& values) {
  return Eigen::Map<const Vector>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// The inner fifths of the points, each predicted from the others.
void hold_out(const Vector& t, const Vector& y, bool slow, Drift& drift) {
  constexpr Eigen::Index parts = 5, few = 15;
  if (t.size() < few) return;
  std::map<double, std::vector<double>> before, after;
  for (Eigen::Index part = 1; part < parts - 1; ++part) {
    const Eigen::Index begin = t.size() * part / parts, end = t.size() * (part + 1) / parts, n = t.size() - end + begin;
    Vector rest_t(n), rest_y(n);
    rest_t << t.head(begin), t.tail(t.size() - end);
    rest_y << y.head(begin), y.tail(y.size() - end);
    Drift fit;
    set_estimates(rest_t, rest_y, slow ? two_constants(rest_t, rest_y) : one_constant(rest_t, rest_y), fit);
    for (Eigen::Index i = begin; i < end; ++i) {
      before[static_cast<double>(part)].push_back(y[i] - rest_y.mean());
      after[static_cast<double>(part)].push_back(y[i] - fit.at(t[i]));
    }
  }
  drift.held_out_before = interval_of(before);
  drift.held_out_after = interval_of(after);
}

}  // namespace

double Drift::at(double time) const {
  const double slow = has_slow() ? slow_drift.value * warm(time, slow_time_constant.value) : 0;
  return start.value + drift.value * warm(time, time_constant.value) + slow;
}

Drift fit_drift(const std::vector<double>& times, const std::vector<double>& distances, bool slow_too) {
  const Vector t = as_vector(times), y = as_vector(distances);
  std::vector<double> taus = one_constant(t, y);
  constexpr std::size_t enough = 20;
  bool slow = false;
  if (slow_too && times.size() >= enough) {
    const std::vector<double> two = two_constants(t, y);
    const Matrix a = columns_of(t, two);
    const Vector residual = y - a * a.colPivHouseholderQr().solve(y);
    const double gain = bic(left(t, y, taus), times.size(), 3) - bic(left(t, y, two), times.size(), 5);
    slow = gain / points_per_independent(residual) > min_bic_gain;
    if (slow) taus = two;
  }
  Drift drift;
  set_estimates(t, y, taus, drift);
  hold_out(t, y, slow, drift);
  return drift;
}

Estimate fit_droop(const std::vector<double>& times, const std::vector<double>& amplitudes, double time_constant) {
  const Vector t = as_vector(times), y = as_vector(amplitudes);
  const Matrix a = columns_of(t, {time_constant});
  const Vector x = a.colPivHouseholderQr().solve(y);
  const double squares = (y - a * x).squaredNorm() / static_cast<double>(std::max<Eigen::Index>(t.size() - 2, 1));
  const Eigen::Matrix2d covariance = (a.transpose() * a).inverse() * squares;
  return {-x[1] / x[0], std::sqrt(covariance(1, 1)) / std::abs(x[0])};
}

double sufficient_span(const Drift& drift, double interval) {
  constexpr double wanted = 0.1, longer = 1.1;  // of the time constant
  const double tau = drift.time_constant.value, w = drift.drift.value;
  double span = tau;
  for (int step = 0; step < 80; ++step, span *= longer) {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    const auto points = physics::to_integer(std::floor(std::min(span / interval, 1e4)), 0);
    const double pace = span / std::max(points, 1);
    for (int i = 0; i <= points; ++i) {
      const double t = i * pace;
      const Eigen::Vector3d row(1, warm(t, tau), -w * t / (tau * tau) * std::exp(-t / tau));
      information += row * row.transpose() * (pace / interval);
    }
    const double sd = std::sqrt(information.inverse()(2, 2) * drift.redundancy) * drift.scatter;
    if (sd < wanted * tau) break;
  }
  return std::max(span, 3 * tau);
}

double settled_after(const Drift& drift, double tolerance, double end) {
  constexpr int steps = 20000;
  const double slow = drift.has_slow() ? drift.slow_drift.value : 0;
  const double last = drift.start.value + drift.drift.value + slow;
  const double longest =
      std::max({end, 10 * drift.time_constant.value, drift.has_slow() ? 10 * drift.slow_time_constant.value : 0});
  for (int i = steps; i >= 0; --i) {
    const double time = longest * i / steps;
    if (std::abs(drift.at(time) - last) > tolerance) return longest * std::min(i + 1, steps) / steps;
  }
  return 0;
}

}  // namespace tofgraph::calibration
