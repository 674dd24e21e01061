// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Which conditions are put aside together: whole levels of a setting.
#pragma once

#include "diagnosis/data/design.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Conditions that are put aside together.
struct Fold {
  std::string setting;            ///< distance, target, session, integration time; each_distance and so on
  std::string levels;             ///< "1.2 m, 2.4 m", "white"
  std::vector<std::size_t> held;  ///< ascending
  bool extrapolates = false;      ///< beyond all levels that are left
};

/// Every condition is put aside once for each setting that has levels enough: distances in interleaved groups, with the
/// nearest and the farthest apart, integration times likewise where there are not enough distances; each target; each
/// session. None where too few conditions would be left.
std::vector<Fold> folds_of(const Design& design);

inline constexpr const char *each_distance = "each distance", *each_target = "each target", *any_half = "a random half";
/// Each distance by itself, then each target, as far as enough conditions are left.
std::vector<Fold> single_levels(const Design& design);
/// Half of what stands together, at random.
std::vector<Fold> random_halves(const Design& design, std::size_t count, std::uint64_t seed);

/// Cluster of each condition: those at one distance in one session, which may share what no model has.
/// If there are few of these, each condition is its own cluster.
std::vector<std::size_t> clusters_of(const Design& design);

}  // namespace tofgraph::diagnosis
