// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Exponentials by variable projection: for given time constants the amplitudes follow from linear least squares.
#include "calibration/warm_up.hpp"

#include "calibration/interval.hpp"

#include <Eigen/Dense>
#include <boost/math/tools/minima.hpp>

#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace tofgraph::calibration {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

constexpr double slow_ratio = 3;      ///< ratio of two time constants: closer ones cannot be distinguished
constexpr double min_bic_gain = 10;   ///< for a second time constant: very strong evidence (Kass and Raftery 1995)
constexpr double max_spans = 5;       ///< relative to the recording: slower drift is linear within it
constexpr double false_alarm = 2e-4;  ///< probability of detecting a drift of a given time constant in pure noise
constexpr double min_spacings = 0.2;  ///< relative to the closest points: faster drift decays to 1 % within one
constexpr std::size_t grid = 60;      ///< number of time constants tried first, in geometric progression

double warm(double time, double tau) { return -std::expm1(-time / tau); }

Matrix columns_of(const Vector& t, const std::vector<double>& taus) {
  Matrix a(t.size(), static_cast<Eigen::Index>(1 + taus.size()));
  for (Eigen::Index i = 0; i < t.size(); ++i) {
    a(i, 0) = 1;
    for (std::size_t k = 0; k < taus.size(); ++k) a(i, static_cast<Eigen::Index>(k + 1)) = warm(t[i], taus[k]);
  }
  return a;
}

/// Residual sum of squares with these time constants.
double remaining_squares(const Vector& t, const Vector& y, const std::vector<double>& taus) {
  const Matrix a = columns_of(t, taus);
  return (y - a * a.colPivHouseholderQr().solve(y)).squaredNorm();
}

double squares_about_mean(const Vector& y) { return (y.array() - y.mean()).matrix().squaredNorm(); }

/// Minimum of f over a logarithmic grid, refined between the neighbours of its best point.
double search(double from, double to, const std::function<double(double)>& f) {
  const double step = std::log(to / from) / static_cast<double>(grid - 1);
  const auto at = [&](double k) { return from * std::exp(step * k); };
  double best = 0, value = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < grid; ++k) {
    if (const double now = f(at(static_cast<double>(k))); now < value) {
      value = now;
      best = static_cast<double>(k);
    }
  }
  constexpr int bits = 20;
  const auto [k, refined] =
      boost::math::tools::brent_find_minima([&](double x) { return f(at(x)); }, std::max(best - 1, 0.0),
                                            std::min(best + 1, static_cast<double>(grid - 1)), bits);
  return refined < value ? at(k) : at(best);
}

struct Bounds {
  double shortest, longest;  ///< s
};

Bounds bounds_of(const Vector& t) {
  constexpr double moment = 1;  // s: closer points are repetitions
  double spacing = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 1; i < t.size(); ++i) {
    if (t[i] - t[i - 1] > moment) spacing = std::min(spacing, t[i] - t[i - 1]);
  }
  const double span = std::max(t[t.size() - 1] - t[0], moment);
  return {std::max(min_spacings * std::min(spacing, span), min_spacings * moment), max_spans * span};
}

std::vector<double> one_constant(const Vector& t, const Vector& y) {
  const Bounds b = bounds_of(t);
  return {search(b.shortest, b.longest, [&](double tau) { return remaining_squares(t, y, {tau}); })};
}

std::vector<double> two_constants(const Vector& t, const Vector& y) {
  const Bounds b = bounds_of(t);
  const auto best_slow = [&](double tau) {
    return search(std::min(slow_ratio * tau, b.longest), b.longest, [&](double other) {
      return remaining_squares(t, y, {tau, other});
    });
  };
  const double fast = search(b.shortest, b.longest / slow_ratio, [&](double tau) {
    return remaining_squares(t, y, {tau, best_slow(tau)});
  });
  return {fast, best_slow(fast)};
}

double bic(double squares, std::size_t points, std::size_t parameters) {
  const auto n = static_cast<double>(points);
  return n * std::log(squares / n) + static_cast<double>(parameters) * std::log(n);
}

/// Number of points that carry as much information as one independent point: 1 + 2 sum of the autocorrelations of the
/// residual, up to the first that is not significant (Sokal 1997).
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

/// Jacobian of the model with respect to start, drifts and time constants; x contains the amplitudes.
Matrix jacobian_of(const Vector& t, const std::vector<double>& taus, const Vector& x) {
  const Matrix a = columns_of(t, taus);
  Matrix jacobian(t.size(), static_cast<Eigen::Index>(1 + 2 * taus.size()));
  jacobian.leftCols(a.cols()) = a;
  for (std::size_t k = 0; k < taus.size(); ++k) {
    const auto index = static_cast<Eigen::Index>(k);
    const double tau = taus[k];
    jacobian.col(a.cols() + index) = -x[index + 1] / (tau * tau) * (t.array() * (-t.array() / tau).exp()).matrix();
  }
  return jacobian;
}

/// Standard deviations of the parameters, scaled by Student's t distribution such that +-1.96 of them cover 95 %;
/// infinite if the data do not determine a parameter.
Vector standard_deviations(const Matrix& jacobian, double variance, double freedom) {
  const double student = student_95(std::max(freedom, 1.0)) / 1.96;
  const Vector scale = jacobian.colwise().norm().cwiseMax(std::numeric_limits<double>::min());
  const Matrix scaled = jacobian * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix> system(scaled.transpose() * scaled);
  constexpr double singular = 1e-12;
  if (!(system.eigenvalues().minCoeff() > singular))
    return Vector::Constant(jacobian.cols(), std::numeric_limits<double>::infinity());
  const Matrix inverse =
      system.eigenvectors() * system.eigenvalues().cwiseInverse().asDiagonal() * system.eigenvectors().transpose();
  return student * (inverse.diagonal() * variance).cwiseSqrt().cwiseQuotient(scale);
}

/// Upper 95 % limit of the drift for typical time constants of cameras.
double upper_limit_of(const Vector& t, const Vector& y, double redundancy) {
  constexpr double one_sided = 1.645;
  double limit = 0;
  for (const double tau : usual_time_constants) {
    const Matrix a = columns_of(t, {tau});
    const Vector x = a.colPivHouseholderQr().solve(y);
    const double freedom = std::max(static_cast<double>(t.size()) - 2, 1.0);
    const double variance = (y - a * x).squaredNorm() / static_cast<double>(std::max<Eigen::Index>(t.size() - 2, 1));
    limit = std::max(limit, std::abs(x[1]) + one_sided * standard_deviations(a, variance * redundancy, freedom)[1]);
  }
  return limit;
}

void set_estimates(const Vector& t, const Vector& y, const std::vector<double>& taus, Drift& drift) {
  const Matrix a = columns_of(t, taus);
  const Vector x = a.colPivHouseholderQr().solve(y);
  const Vector residual = y - a * x;
  const Matrix jacobian = jacobian_of(t, taus, x);
  const double squares = residual.squaredNorm();
  const auto points = static_cast<double>(t.size()), parameters = static_cast<double>(jacobian.cols());
  drift.scatter = std::sqrt(squares / std::max(points - parameters, 1.0));
  drift.redundancy = points_per_independent(residual);
  const Vector sd =
      standard_deviations(jacobian, drift.scatter * drift.scatter * drift.redundancy, points - parameters);
  drift.start = {x[0], sd[0]};
  drift.drift = {x[1], sd[1]};
  drift.time_constant = {taus[0], sd[a.cols()]};
  if (taus.size() > 1) {
    drift.slow_drift = {x[2], sd[2]};
    drift.slow_time_constant = {taus[1], sd[a.cols() + 1]};
  }
  // F test of two parameters against a constant, its variance ratio divided by the redundancy.
  const double freedom = points - parameters, gain = squares_about_mean(y) / squares - 1;
  drift.seen = freedom > 0 && std::pow(1 + gain / drift.redundancy, -freedom / 2) < false_alarm;
  drift.upper_limit = drift.seen ? unknown : upper_limit_of(t, y, drift.redundancy);
}

Vector as_vector(const std::vector<double>& values) {
  return Eigen::Map<const Vector>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// Holds out the inner fifths of the points, each predicted from the others.
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
  constexpr std::size_t enough = 12;
  bool slow = false;
  if (slow_too && times.size() >= enough) {
    const std::vector<double> two = two_constants(t, y);
    const Matrix a = columns_of(t, two);
    const Vector residual = y - a * a.colPivHouseholderQr().solve(y);
    const double gain =
        bic(remaining_squares(t, y, taus), times.size(), 3) - bic(remaining_squares(t, y, two), times.size(), 5);
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
  constexpr double wanted = 0.1, longer = 1.1;  // relative to the time constant
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
  if (!drift.seen || !std::isfinite(drift.time_constant.sd)) return unknown;
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
