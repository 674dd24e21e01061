// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Location of a gap: generic patterns of the observables, with a controlled false discovery rate.
#pragma once

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/scan.hpp"

#include <optional>

namespace tofgraph::diagnosis {

// ---- Generic patterns of an observable along an axis ----

/// A pattern of one observable along one axis, and its size in a gap.
struct Pattern {
  std::size_t observable = 0;
  std::string axis;
  double gain = 0, p_value = 1;  ///< p_value: of this pattern alone, for the false discovery rate
  double size = 0;               ///< root mean square, SI
  bool significant = false;      ///< among all patterns together
  double largest = 0;            ///< root mean square in the condition where it is largest
  double share = 0;              ///< fraction of the excess; NaN: unknown
};

inline constexpr const char* everywhere = "everywhere";  ///< axis of a constant

/// Patterns without sizes, and the columns of each in mm (distance) or 0.1 % (other observables).
struct Bases {
  std::vector<Pattern> patterns;
  std::vector<Group> groups;
};

/// Patterns along the axes that this campaign varies.
Bases generic_bases(const Problem& problem);

// ---- Location of a gap ----

struct PatternScan {
  std::vector<Pattern> patterns;   ///< significant ones, by p-value and gain
  std::vector<double> gains;       ///< gain of each basis, minus the expectation of noise
  double most = 0;                 ///< largest of the gains
  double square = 0, freedom = 0;  ///< see Scan

  /// True if the lack of fit is at most that of explained data.
  bool is_explained() const { return square <= settings.explained * freedom; }
};

/// Axis of differences that follow no setting.
inline constexpr const char* no_setting = "from one condition to the next, as no setting does";
/// "distance along tilt about x".
std::string name_of(const Pattern& pattern);

/// Axis of a residual that is smooth over the image.
inline constexpr const char* smooth_over_image = "smooth over the image, from one condition to the next";
/// Pattern of a smooth field larger than usual for boards and rooms.
std::optional<Pattern> large_smooth_field(const Problem& problem, const ModelFit& fit);

/// Pattern of a camera whose distances scatter between conditions more than usual: not a nuisance, although no setting
/// explains it. Only if tilted boards distinguish it from misplaced boards.
std::optional<Pattern> unsteady_camera(const Problem& problem, const ModelFit& fit);

class PatternFinder {
 public:
  /// @param problem must outlive this object
  explicit PatternFinder(const Problem& problem);
  /// @param seed of the sign flips; nullopt: no patterns, only the gains and the chi-square
  PatternScan find(const ModelFit& fit, std::optional<std::uint64_t> seed = {}) const;

 private:
  const Problem& problem_;
  Bases bases_;
  std::vector<const Group*> groups_;
};

}  // namespace tofgraph::diagnosis
