// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Validation of a fitted lens: projection uncertainty, agreement of halves of the views, prediction of held-out
/// views, adequacy of the lens model, and the most informative further view.
#pragma once

#include "calibration/board_measurement.hpp"
#include "calibration/bundle.hpp"

#include <Eigen/Core>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Standard deviation of the projection of a point that is fixed in space, px. The point is fixed relative to the
/// boards of all views, whose pose errors partly compensate those of the lens (as in mrcal).
class ProjectionUncertainty {
 public:
  explicit ProjectionUncertainty(const LensSolution& solution) : solution_(solution) {}

  /// Value of the worst direction; NaN if the lens cannot be inverted. @param range m, from the lens centre
  double at(double u, double v, double range) const;
  /// d pixel / d parameters, two rows; nullopt if the lens cannot be inverted.
  std::optional<Eigen::Matrix<double, 2, Eigen::Dynamic>> jacobian(double u, double v, double range) const;

 private:
  const LensSolution& solution_;
};

/// Comparison of two lenses, each from half of the views.
struct TwoSets {
  bool done = false;
  double difference = 0;  ///< px, rms over the image, after compensation by rotation and translation of the camera
  double predicted = 0;   ///< px, from the uncertainties of both
  bool agree() const { return difference < 2 * predicted; }
};

/// Reprojection of held-out views; only their poses are fitted.
struct HeldOutViews {
  bool done = false;
  std::size_t folds = 0;
  double rms = 0, low = 0, high = 0;  ///< px per coordinate, with its 95 % interval over views
  double fitted = 0;                  ///< px, of the same views, with the lens fitted to them
  double nominal = unknown;           ///< px, with the lens of the camera's profile; NaN: unknown
};

/// Score test on terms that were not fitted.
struct Structure {
  double statistic = 0, terms = 0, p_value = 1;
  double size = 0;          ///< px rms, explained by such terms
  bool found = false;       ///< significant and of practical relevance
  std::string explanation;  ///< the single most explanatory term and its fraction
};
inline constexpr double structure_p_value = 1e-3;  ///< significance level
inline constexpr double structure_size = 0.01;     ///< px: limit of practical relevance

struct NextView {
  bool found = false;
  std::array<double, 2> tilt{};    ///< rad, about x and y
  std::array<double, 3> centre{};  ///< m, of the board in the optical frame
  std::array<double, 2> pixel{};   ///< px, image of its centre
  double before = 0, after = 0;    ///< px, mean uncertainty over the image
};

TwoSets compare_halves(const Observations& observations, const LensOptions& options, const LensSolution& solution);
HeldOutViews predict_left_out(const Observations& observations, const LensOptions& options,
                              const LensSolution& solution);
/// Tests further terms of the lens (higher radial, thin prism, skew) and of the board (bending beyond quadratic).
Structure lens_structure(const Observations& observations, const LensSolution& solution);
Structure board_structure(const Observations& observations, const LensSolution& solution);
NextView suggest_view(const Observations& observations, const LensSolution& solution);

/// Mean distance of the boards from the lens, m, at which uncertainties are stated.
double typical_range(const LensSolution& solution);

}  // namespace tofgraph::calibration
