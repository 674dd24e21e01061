// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Location of a gap: generic patterns of the observables, with false discoveries controlled.
#pragma once

#include "diagnosis/model/scan.hpp"

#include <optional>

namespace tofgraph::diagnosis {

// ---- Generic patterns of an observable along an axis ----

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

// ---- Location of a gap ----

/// A generic pattern of the gap.
struct Pattern {
  std::size_t observable = 0;
  std::string axis;
  double gain = 0, p_value = 1;  ///< the latter of this pattern alone, false discoveries controlled
  double size = 0;               ///< root mean square, SI
  bool significant = false;      ///< among all patterns together
  double largest = 0;            ///< likewise, in the condition where it is largest
  double share = 0;              ///< of what is beyond noise
};

struct PatternScan {
  std::vector<Pattern> patterns;   ///< beyond chance, by p-value and gain
  std::vector<double> gains;       ///< of each of all, less what noise gives
  double most = 0;                 ///< the largest of these
  double square = 0, freedom = 0;  ///< see Scan
};

/// The axis of what no setting goes with.
inline constexpr const char* no_setting = "from one condition to the next, as no setting does";
/// "distance along tilt about x".
std::string name_of(const Pattern& pattern);

/// The axis of a residue that is smooth over the image.
inline constexpr const char* smooth_over_image = "smooth over the image, from one condition to the next";
/// Pattern of a smooth field that is larger than boards and rooms leave.
std::optional<Pattern> large_smooth_field(const Problem& problem, const ModelFit& fit);

/// A camera whose distances differ from one condition to the next by more than such cameras repeat: that is no
/// nuisance, though no setting goes with it. Only where tilted boards tell it from boards that are misplaced.
std::optional<Pattern> unsteady_camera(const Problem& problem, const ModelFit& fit);

class PatternFinder {
 public:
  explicit PatternFinder(const Problem& problem);
  /// @param flips draws; 0: no patterns, only what noise does not explain
  PatternScan find(const Problem& problem, const ModelFit& fit, std::size_t flips, std::uint64_t seed) const;

 private:
  Bases bases_;
  std::vector<const Group*> groups_;
};

}  // namespace tofgraph::diagnosis
