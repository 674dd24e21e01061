// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/bundle.hpp"

#include "calibration/bundle_problem.hpp"

#include <fmt/format.h>

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace tofgraph::calibration {
namespace {

constexpr double outlier_view = 6;     ///< mean square residual relative to that of the median view: 2.4 times its rms
constexpr double outlier_corner = 30;  ///< squared residual relative to the variance: 5.5 standard deviations
constexpr double tolerated = 0.1;      ///< px: smaller residuals are not outliers, however small the others are
constexpr double undetermined = 0.05;  ///< relative standard deviation of the focal length
constexpr double nearly_parallel = 0.985;  ///< cosine of a tilt of 10 deg

/// Squared residual normalised by its stated covariance; expectation 2.
double squared_residual(const Corner& corner, const std::array<double, 2>& residual) {
  const auto [uu, uv, vv] = corner.covariance;
  return (vv * residual[0] * residual[0] - 2 * uv * residual[0] * residual[1] + uu * residual[1] * residual[1]) /
         (uu * vv - uv * uv);
}

class Solver {
 public:
  Solver(const Observations& observations, const LensOptions& options)
      : observations_(observations), problem_(observations, options) {
    for (const View& view : observations.views) with_distances_ |= !view.distances.empty();
    with_distances_ = with_distances_ && options.distances && observations.light.has_value();
  }

  LensSolution solve() {
    leave_outliers_out();
    if (!problem_.solve(false, false, scatter_)) not_solved_error();
    update_corner_scatter();
    if (with_distances_) use_distances();
    problem_.update_residuals(with_distances_);
    return result();
  }

 private:
  bool parallel() const {
    return std::ranges::all_of(problem_.views,
                               [](const SolvedView& v) { return std::abs(v.pose.rotation[8]) > nearly_parallel; });
  }

  [[noreturn]] void not_solved_error() const {
    if (parallel()) undetermined_error(0);
    throw std::runtime_error(
        "the fit of the lens did not converge: the corners do not tell all that is free; take more views, or free less "
        "(--free, --without warp)");
  }

  /// @param sd relative standard deviation of the focal length; 0: unknown
  [[noreturn]] void undetermined_error(double sd) const {
    if (parallel())
      throw std::runtime_error(
          "the focal length is not determined: the board is nearly parallel to the sensor in all views; tilt it by 20 "
          "to 40 deg about both axes in most of them");
    throw std::runtime_error(fmt::format(
        "the focal length is not determined: its standard deviation would be {:.0f} %; take more views, the board "
        "tilted by 20 to 40 deg about both axes in most of them",
        100 * sd));
  }

  /// Excludes views one by one, the worst first, until the others are consistent; then single corners.
  void leave_outliers_out() {
    for (;;) {
      problem_.solve(true, false, scatter_);
      problem_.update_residuals(false);
      if (!leave_view_out()) break;
    }
    for (int round = 0; round < 5 && leave_corners_out(); ++round) {
      problem_.solve(false, false, scatter_);
      problem_.update_residuals(false);
    }
  }

  bool leave_view_out() {
    std::vector<double> means;
    for (const SolvedView& view : problem_.views) {
      std::vector<double> squares;
      for (std::size_t i = 0; i < view.residuals.size(); ++i)
        squares.push_back(squared_residual(observations_.views[view.view].corners[i], view.residuals[i]));
      // a single bad corner does not make an outlier view: the largest tenth is ignored
      std::ranges::sort(squares);
      const std::size_t kept = squares.size() - squares.size() / 10;
      means.push_back(std::accumulate(squares.begin(), squares.begin() + static_cast<std::ptrdiff_t>(kept), 0.0) /
                      static_cast<double>(kept));
    }
    const double typical = std::max(physics::median(std::vector(means)), 1e-12);
    const auto worst = static_cast<std::size_t>(std::ranges::max_element(means) - means.begin());
    const SolvedView& view = problem_.views[worst];
    if (means[worst] < outlier_view * typical || view.rms < tolerated) return false;
    const LeftOut outlier{view.view, fmt::format("its corners do not fit the others: residuals of {:.2f} px, {:.1f} "
                                                 "times those of the other views",
                                                 view.rms, std::sqrt(means[worst] / typical))};
    if (problem_.views.size() <= min_views) {
      kept_.push_back(outlier);
      return false;
    }
    left_out_.push_back(outlier);
    problem_.leave_out(worst);
    return true;
  }

  bool leave_corners_out() {
    std::vector<double> squares;
    for (const SolvedView& view : problem_.views)
      for (std::size_t i = 0; i < view.used.size(); ++i)
        if (view.used[i])
          squares.push_back(squared_residual(observations_.views[view.view].corners[i], view.residuals[i]));
    const double variance = physics::median(squares) / 1.386;  // median of chi-square with two degrees of freedom
    std::size_t changed = 0;
    for (SolvedView& view : problem_.views) {
      for (std::size_t i = 0; i < view.used.size(); ++i) {
        const double square = squared_residual(observations_.views[view.view].corners[i], view.residuals[i]);
        const bool good =
            square < outlier_corner * variance || std::hypot(view.residuals[i][0], view.residuals[i][1]) < tolerated;
        changed += good != view.used[i] ? 1 : 0;
        view.used[i] = good;
      }
    }
    return changed > 0;
  }

  void update_corner_scatter() {
    problem_.update_residuals(false);
    double squares = 0, count = 0;
    for (const SolvedView& view : problem_.views) {
      for (std::size_t i = 0; i < view.used.size(); ++i) {
        if (!view.used[i]) continue;
        squares += squared_residual(observations_.views[view.view].corners[i], view.residuals[i]);
        count += 2;
      }
    }
    const Layout layout = problem_.layout(false);
    degrees_ = count - static_cast<double>(layout.lens.size() + layout.warp + 6 * problem_.views.size());
    if (!(degrees_ > 0))
      throw std::runtime_error("too few corners were seen for the unknowns of the lens and the poses");
    scatter_.corners = std::max(std::sqrt(squares / degrees_), 1e-6);
  }

  /// Estimates the noise of the distances and the scatter of the views' shifts with the rest (MacKay's iteration).
  void use_distances() {
    constexpr double min_shift = 5e-5;  // m
    for (int round = 0; round < 6; ++round) {
      problem_.solve(false, true, scatter_);
      problem_.update_residuals(true);
      const Eigen::MatrixXd covariance = problem_.covariance(true, scatter_);
      const Layout layout = problem_.layout(true);
      double squares = 0, count = 0, shifts = 0, known = 0;
      for (std::size_t i = 0; i < problem_.views.size(); ++i) {
        const SolvedView& view = problem_.views[i];
        const View& seen = observations_.views[view.view];
        if (seen.distances.empty()) continue;
        for (std::size_t k = 0; k < seen.distances.size(); ++k)
          squares += std::min(std::pow(view.distance_residuals[k] / seen.distances[k].sd, 2),
                              25 * scatter_.distances * scatter_.distances);
        count += static_cast<double>(seen.distances.size()) - 2;
        shifts += view.range_shift * view.range_shift;
        const auto at = static_cast<Eigen::Index>(layout.pose(i) + 6);
        known += 1 - covariance(at, at) / (scatter_.range_shift * scatter_.range_shift);
      }
      scatter_.distances = std::max(std::sqrt(squares / std::max(count, 1.0)), 1e-6);
      scatter_.range_shift = std::max(std::sqrt(shifts / std::max(known, 0.5)), min_shift);
    }
    if (!problem_.solve(false, true, scatter_)) not_solved_error();
  }

  LensSolution result() {
    LensSolution solution{.lens = problem_.lens,
                          .warp = problem_.warp,
                          .range_offset = problem_.range[0],
                          .range_scale = problem_.range[1],
                          .with_distances = with_distances_,
                          .left_out = left_out_,
                          .doubtful = kept_,
                          .layout = problem_.layout(with_distances_),
                          .covariance = problem_.covariance(with_distances_, scatter_),
                          .variance_factor = scatter_.corners * scatter_.corners,
                          .degrees_of_freedom = degrees_,
                          .range_noise_factor = scatter_.distances,
                          .range_shift_sd = scatter_.range_shift};
    solution.views = problem_.views;
    double squares = 0, count = 0;
    for (const SolvedView& view : solution.views) {
      const auto used = static_cast<double>(std::ranges::count(view.used, true));
      squares += 2 * used * view.rms * view.rms;
      count += 2 * used;
      solution.corners_left_out += view.used.size() - static_cast<std::size_t>(used);
    }
    solution.rms = std::sqrt(squares / count);
    const double focal = solution.lens[lens::fx];
    if (!(focal > 0) || !(solution.lens[lens::fy] > 0) || !(solution.sd(lens::fx) < undetermined * focal))
      undetermined_error(solution.sd(lens::fx) / std::abs(focal));
    return solution;
  }

  const Observations& observations_;
  BundleProblem problem_;
  Scatter scatter_;
  std::vector<LeftOut> left_out_, kept_;
  double degrees_ = 0;
  bool with_distances_ = false;
};

}  // namespace

double LensSolution::sd(std::size_t parameter) const {
  const auto at = std::ranges::find(layout.lens, parameter);
  if (at == layout.lens.end()) return 0;
  const auto i = static_cast<Eigen::Index>(at - layout.lens.begin());
  return std::sqrt(covariance(i, i));
}

LensSolution solve_lens(const Observations& observations, const LensOptions& options) {
  if (observations.views.size() < min_views)
    throw std::runtime_error(
        fmt::format("{} view{} of the board cannot determine a lens: at least {} are needed, 10 to "
                    "30 are good",
                    observations.views.size(), observations.views.size() == 1 ? "" : "s", min_views));
  return Solver(observations, options).solve();
}

}  // namespace tofgraph::calibration
