// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An error of the distances that is smooth over the image and another one in each condition: boards that are not
/// flat, reflections that come and go. Cosines over the image with random heights, the finer the smaller.
#pragma once

#include "diagnosis/data/observables.hpp"

#include <Eigen/Dense>

#include <memory>
#include <random>
#include <vector>

namespace tofgraph::diagnosis {

class SmoothField {
 public:
  /// @param data one a condition, of grid x grid superpixels
  explicit SmoothField(const std::vector<Observations>& data);
  /// The same with a standard deviation over the image, m.
  SmoothField(const SmoothField& other, double sd);

  double sd() const { return sd_; }
  /// Takes from rows over their standard deviations what makes their covariance differ from the unit matrix: its
  /// inverse root. @param rows superpixels x columns, of the distance
  void whiten(std::size_t condition, Eigen::Ref<Eigen::MatrixXd> rows) const;
  /// The directions in which rows over their standard deviations vary, superpixels x modes, orthonormal.
  const Eigen::MatrixXd& modes(std::size_t condition) const { return (*fields_)[condition].modes; }
  /// Difference of the unit matrix and the inverse of their covariance along each mode.
  Eigen::VectorXd taken(std::size_t condition) const;
  /// A residue as chance makes it, over the standard deviations of the superpixels.
  Eigen::VectorXd drawn(std::size_t condition, std::mt19937_64& generator) const;
  /// ln of the determinant of their covariance.
  double log_determinant(std::size_t condition) const;

 private:
  struct Field {
    Eigen::MatrixXd modes;
    Eigen::VectorXd variance;  ///< along each, for a standard deviation of 1 m
  };
  std::shared_ptr<const std::vector<Field>> fields_;
  double sd_ = 0;
};

struct Problem;
struct ModelFit;
struct State;
/// A residue, and how much the deviance is less with it than with what the fit has.
struct SmoothFieldTrial {
  std::shared_ptr<const SmoothField> smooth_field;  ///< nothing where the fit's is as good
  std::vector<Eigen::Index> runs = {};              ///< see runs_of()
  double gain = 0;
};
/// The smooth field with the least deviance beside a fit. Nothing where it stays for nearly half of the campaign or
/// more: such a field cannot be distinguished from one of the camera.
SmoothFieldTrial smooth_field_of(const Problem& problem, const ModelFit& fit);

/// Runs of conditions, in the order measured, that are as long as a residue stays nearly the same: chance may change
/// the signs of these, not of single conditions. @returns of each condition its run, or nothing where no order is told
std::vector<Eigen::Index> runs_of(const Problem& problem, const State& state, const SmoothField& smooth_field);

}  // namespace tofgraph::diagnosis
