// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Alternatives to effects that were found: to one, or to several at once.
#pragma once

#include "diagnosis/model/identifiability.hpp"
#include "diagnosis/search/search_result.hpp"
#include "diagnosis/search/selection.hpp"

namespace tofgraph::diagnosis {

class Rivals {
 public:
  /// @param selection this and the others must live on
  Rivals(Selection& selection, const Trials& trials, const std::vector<std::unique_ptr<Candidate>>& candidates,
         std::uint64_t seed)
      : selection_(selection), problem_(selection.problem()), trials_(trials), candidates_(candidates), seed_(seed) {}

  /// In the place of a term that was found, best first.
  std::vector<Rival> of(const EffectFinding& found, std::size_t term);
  /// Effects that cannot be told from several that were found together: each becomes a rival of all that it takes the
  /// place of, and no effect that was found has two such rivals. @param first_term of the first one that was found
  void add_of_several(std::vector<EffectFinding>& all, std::size_t first_term);

 private:
  std::optional<Rival> compared(const ModelFit& less, const Candidate& candidate, std::vector<std::string> in_place_of,
                                ModelFit fit);
  std::optional<Rival> in_place_of_all(const Candidate& candidate, const std::vector<std::size_t>& terms);
  Unidentified nonlinear_identifiability(const ModelFit& fit, const Candidate& candidate) const;
  std::string limit_reached(const ModelFit& fit, const Candidate& candidate) const;

  Selection& selection_;
  const Problem& problem_;
  const Trials& trials_;
  const std::vector<std::unique_ptr<Candidate>>& candidates_;
  std::uint64_t seed_;
};

}  // namespace tofgraph::diagnosis
