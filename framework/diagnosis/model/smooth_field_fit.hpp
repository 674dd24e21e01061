// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Smooth field of a campaign, estimated from the residuals of a fit.
#pragma once

#include "diagnosis/model/fit.hpp"

namespace tofgraph::diagnosis {

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
