// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Distance error that is smooth over the image and new in each condition: boards that are not flat, reflections that
/// vary. Cosines over the image with random heights, smaller for shorter waves.
#pragma once

#include "diagnosis/data/observables.hpp"

#include <Eigen/Dense>

#include <memory>
#include <random>
#include <vector>

namespace tofgraph::diagnosis {

struct Problem;
struct ModelFit;

class SmoothField {
 public:
  /// @param data one per condition, of grid x grid superpixels
  explicit SmoothField(const std::vector<Observations>& data);
  /// The field of another object with a standard deviation over the image, m.
  SmoothField(const SmoothField& other, double sd);

  double sd() const { return sd_; }
  /// Whitens rows that are divided by their standard deviations: multiplies by the inverse root of their covariance.
  /// @param rows superpixels x columns, of the distance
  void whiten(std::size_t condition, Eigen::Ref<Eigen::MatrixXd> rows) const;
  /// Directions of the field in rows divided by their standard deviations: superpixels x modes, orthonormal.
  const Eigen::MatrixXd& modes(std::size_t condition) const { return (*fields_)[condition].modes; }
  /// Unit matrix minus the inverse covariance of these rows, along each mode.
  Eigen::VectorXd taken(std::size_t condition) const;
  /// A random field, divided by the standard deviations of the superpixels.
  Eigen::VectorXd drawn(std::size_t condition, std::mt19937_64& generator) const;
  /// ln of the determinant of the covariance of the rows.
  double log_determinant(std::size_t condition) const;

 private:
  struct Field {
    Eigen::MatrixXd modes;
    Eigen::VectorXd variance;  ///< along each mode, for a standard deviation of 1 m
  };
  std::shared_ptr<const std::vector<Field>> fields_;
  double sd_ = 0;
};

/// A smooth field for other conditions, with the same standard deviation over the image; null if there is none.
/// @param data see SmoothField
std::shared_ptr<const SmoothField> with_data(const std::shared_ptr<const SmoothField>& smooth_field,
                                             const std::vector<Observations>& data);

// ---- Smooth field of a campaign, estimated from the residuals of a fit ----

/// A smooth field, and the fall of the deviance relative to the field of the fit.
struct SmoothFieldTrial {
  std::shared_ptr<const SmoothField> smooth_field;  ///< null: the fit's is as good
  std::vector<Eigen::Index> runs = {};  ///< of conditions over which it hardly changes; empty: the order is not stated
  double gain = 0;
};
/// Smooth field of least deviance, given a fit. Null if it lasts for nearly half of the campaign or longer: such a
/// field cannot be distinguished from a pattern of the camera.
SmoothFieldTrial smooth_field_of(const Problem& problem, const ModelFit& fit);

}  // namespace tofgraph::diagnosis
