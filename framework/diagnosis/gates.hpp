// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What an effect must pass to be named: beyond chance under sign flips of whole conditions (G1), and also where a
/// camera wanders while the conditions are measured; as good as any pattern without physics in its place (G2), of a
/// size that matters, and a gap that shrinks on conditions that were put aside (G5).
#pragma once

#include "diagnosis/contribution.hpp"
#include "diagnosis/patterns.hpp"
#include "diagnosis/search.hpp"
#include "diagnosis/trials.hpp"

namespace tofgraph::diagnosis {

/// As long as it lives the problem answers to light as a base does.
class InLightOf {
 public:
  InLightOf(Problem& problem, const Base& base);
  ~InLightOf() { problem_.brightening = std::move(before_); }
  InLightOf(const InLightOf&) = delete;
  InLightOf& operator=(const InLightOf&) = delete;

 private:
  Problem& problem_;
  std::vector<std::vector<double>> before_;
};

class Gates {
 public:
  static constexpr const char* too_small = "what it changes is too small to matter";

  /// @param weight of each condition; all of these must live on
  Gates(Problem& problem, const PatternFinder& finder, std::span<const double> weight, std::size_t flips,
        std::uint64_t seed);

  /// Gain of a signature over that of the best generic pattern, in a model without it.
  double capture(const Base& less, const Group& group) const;
  /// The model without a piece. The derivatives are those of the model with it. @throws simulation::EffectError
  Base without(const Base& best, const Piece& piece) const;
  /// A piece of the best model against the model without it; its refutation is empty when it passes.
  Found examined(const Base& best, const Piece& piece);

 private:
  /// Whether a change is more than what a camera may do that wanders in the order measured, where one does.
  /// @param less the model without it
  bool beyond_wandering(const Fit& best, const Base& less, const Group& change) const;

  Problem& problem_;
  const PatternFinder& finder_;
  std::span<const double> weight_;
  std::size_t flips_;
  std::uint64_t seed_;
  std::vector<bool> held_;
  std::vector<std::vector<double>> waves_;  ///< over the conditions, the constant first; none where no order is told
};

}  // namespace tofgraph::diagnosis
