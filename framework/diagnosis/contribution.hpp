// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What one effect brings to an extended model: the questions that a name must answer before it is told. Each compares
/// the model with the effect and the one that is fitted anew without it.
#pragma once

#include "diagnosis/scan.hpp"

#include <cstdint>
#include <string>

namespace tofgraph::diagnosis {

/// On conditions that neither model was fitted to. Chi-squares are in the covariance of the model with the effect.
struct HeldOutFall {
  double expected = 0;        ///< chi-square of what the two models differ in: what there is to be seen
  double fall = 0, low = 0;   ///< of chi-square by the effect, and the low end of its 95 % interval
  double excess = 0;          ///< chi-square beyond noise without the effect
  double depth_rise = 0;      ///< m, of the root mean square of depth by the effect
  double depth_rise_low = 0;  ///< low end of its 95 % interval
  std::size_t conditions = 0;
  double carriers = 0;  ///< conditions that carry the expected difference
};

/// @param with all terms @param without the same without one
/// @param held conditions that are put aside; their reflectivities are fitted in either case
HeldOutFall held_out_fall(const Problem& problem, const State& with, const State& without,
                          const std::vector<bool>& held, std::uint64_t seed);

/// How what was put aside speaks against the effect, or nothing: also where it could not show the effect.
std::string refuted(const HeldOutFall& fall);

/// Whether two models differ by no more than conditions do from one to the next, and beyond that by less than matters
/// anywhere: however sure that is, it tells nothing apart. @param limit of chi-square for the former
bool hardly_differ(const Problem& problem, const State& one, const State& other, double limit);

/// The change that a piece makes at its values, and its derivatives there: what is scored against generic patterns.
/// @param with a state that has the piece @throws simulation::EffectError
std::vector<Column> signature(const Problem& problem, const State& without, const State& with, const Piece& piece);

}  // namespace tofgraph::diagnosis
