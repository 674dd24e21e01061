// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Generic patterns of an observable along an axis: they say where a gap is without saying what it is.
#pragma once

#include "diagnosis/model/scan.hpp"

namespace tofgraph::diagnosis {

/// A pattern of one observable along one axis.
struct Basis {
  std::size_t observable = 0;
  std::string axis;
};
inline constexpr double basis_unit = 1e-3;

inline constexpr const char* everywhere = "everywhere";  ///< the axis of what does not change

/// Patterns, and the columns of each in mm (distance) or 0.1 % (the others).
struct Bases {
  std::vector<Basis> patterns;
  std::vector<Group> groups;
};

/// Those axes that this campaign varies.
Bases generic_bases(const Problem& problem);

/// Root mean square over the superpixels that are known, SI: of all, and of the condition where it is largest.
struct BasisSize {
  double mean = 0, largest = 0;
};

/// Size of the pattern that a basis makes with these values.
BasisSize size_of(const Basis& basis, const Group& group, const Eigen::VectorXd& values, const Problem& problem);

}  // namespace tofgraph::diagnosis
