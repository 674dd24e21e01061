// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Tests that an effect must pass to be named: significant under sign flips of whole conditions (G1), also where a
/// camera wanders while the conditions are measured; as good as any pattern without physics in its place (G2), of a
/// size that matters. Whether the gap shrinks out of sample (G5) is asked by cross_fit().
#pragma once

#include "diagnosis/search/search_result.hpp"
#include "diagnosis/search/selection.hpp"

namespace tofgraph::diagnosis {

class Gates {
 public:
  static constexpr const char* too_small = "what it changes is too small to matter";

  /// @param candidates what could have been found instead; all of these must live on
  Gates(const Problem& problem, const PatternFinder& finder, const Alternatives& candidates, std::size_t flips,
        std::uint64_t seed);

  /// Gain of a signature over that of the best generic pattern, in a model without it.
  double explained_fraction(const ModelFit& less, const Group& group) const;
  /// A piece of the best model against the model without it; its refutation is empty when it passes.
  /// @param less the best model without the piece @param left the patterns of the best model
  EffectFinding evaluate_term(const ModelFit& best, const ModelFit& less, const PatternScan& left,
                              const ModelTerm& addition, bool proved);

 private:
  double explained(const ModelFit& less, const PatternScan& left, double gain) const;
  double chance(const ModelFit& best, const ModelFit& less, const Score& score) const;

  const Problem& problem_;
  const PatternFinder& finder_;
  const Alternatives& candidates_;
  std::size_t flips_;
  std::uint64_t seed_;
};

}  // namespace tofgraph::diagnosis
