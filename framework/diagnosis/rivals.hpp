// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file What else could stand in the place of effects that were found: of one, or of several at once.
#pragma once

#include "diagnosis/found.hpp"
#include "diagnosis/selection.hpp"
#include "diagnosis/told.hpp"

namespace tofgraph::diagnosis {

class Rivals {
 public:
  /// @param selection and @param problem its own, whose light is that of other models for a while
  Rivals(Selection& selection, Problem& problem, const Trials& trials,
         const std::vector<std::unique_ptr<Candidate>>& candidates, std::uint64_t seed)
      : selection_(selection), problem_(problem), trials_(trials), candidates_(candidates), seed_(seed) {}

  /// In the place of a term that was found, best first.
  std::vector<Rival> of(const Found& found, std::size_t term);
  /// Effects that cannot be told from several that were found together: each becomes a rival of all that it takes the
  /// place of, and no effect that was found has two such rivals. @param first_term of the first one that was found
  void add_of_several(std::vector<Found>& all, std::size_t first_term);

 private:
  std::optional<Rival> compared(const Base& less, const Candidate& candidate, std::vector<std::string> in_place_of,
                                Fit fit);
  std::optional<Rival> in_place_of_all(const Candidate& candidate, const std::vector<std::size_t>& terms);
  Silence silence_of_shape(const Fit& fit, const Candidate& candidate) const;
  std::string limit_reached(const Fit& fit, const Candidate& candidate) const;

  Selection& selection_;
  Problem& problem_;
  const Trials& trials_;
  const std::vector<std::unique_ptr<Candidate>>& candidates_;
  std::uint64_t seed_;
};

}  // namespace tofgraph::diagnosis
