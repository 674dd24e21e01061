// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Rivals of effects that were found: other effects that explain as much as one, or as several together.
#pragma once

#include "diagnosis/model/intervals.hpp"
#include "diagnosis/search/selection.hpp"
#include "diagnosis/search/trials.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

struct EffectFinding;

/// Another effect in place of one that was found, or of several.
struct Rival {
  const Candidate* candidate = nullptr;
  std::vector<std::string> in_place_of;          ///< names of the effects that it replaces
  double deviance = 0;                           ///< minus that of the model with the effects found
  double bic = 0;                                ///< minus that of the model with the effects found
  bool tied = false;                             ///< these data cannot distinguish the two
  State state = {};                              ///< fitted model with the rival
  std::optional<std::size_t> undetermined = {};  ///< index of a nonlinear parameter that these data do not determine
  std::string limit = {};  ///< message: a parameter reached a limit, so it is not tied although it does as much; or ""

  /// True if it explains as much as the effects it replaces, tied or not.
  bool does_as_much() const { return tied || !limit.empty(); }
  bool of_several() const { return in_place_of.size() > 1; }
  /// True if it is to be listed with this one of the effects that it replaces: only once.
  bool is_listed_at(const std::string& name) const { return in_place_of.front() == name; }
  /// Experiment that distinguishes it from an effect that it replaces: the advice in the declaration that lists the
  /// other as confusable; its own advice if it replaces several.
  std::string separating_experiment(const Candidate& found) const;
};

/// Sorts rivals: ties without an undetermined value first, then those with fewer parameters.
void sort_ties(std::vector<Rival>& rivals);

/// Names of an effect and of its rivals that explain as much.
std::vector<std::string> names_with_rivals(const std::string& effect, std::span<const Rival> rivals);

/// True if two models differ only by these effects in one and that effect in the other.
bool differ_only_by(const State& one, std::span<const std::string> effects, const State& other, const std::string& its);

class Rivals {
 public:
  /// @param selection this and the other arguments must outlive this object
  Rivals(Selection& selection, const Trials& trials, const Candidates& candidates, std::uint64_t seed)
      : selection_(selection), problem_(selection.problem()), trials_(trials), candidates_(candidates), seed_(seed) {}

  /// Rivals of a term that was found, best first.
  std::vector<Rival> of(const EffectFinding& found, std::size_t term);
  /// Only those of its declared confusable effects that are among these names.
  std::vector<Rival> among(const std::vector<std::string>& names, const EffectFinding& found, std::size_t term);
  /// Adds single effects that cannot be distinguished from several found together: each becomes a rival of all that it
  /// replaces, and no effect has two such rivals. @param first_term index of the first found term
  void add_of_several(std::vector<EffectFinding>& all, std::size_t first_term);

 private:
  std::optional<Rival> compared(const ModelFit& less, const Candidate& candidate, std::vector<std::string> in_place_of,
                                ModelFit fit);
  void put_in_place(const Candidate& candidate, const EffectFinding& found, std::size_t term, const ModelFit& less,
                    std::vector<Rival>& rivals);
  bool is_twin(const Candidate& candidate, const Term& term) const;
  std::vector<ModelFit> fits_in_place_of(std::size_t term, const ModelFit& less, const Candidate& candidate) const;
  std::optional<Rival> in_place_of_all(const Candidate& candidate, const std::vector<std::size_t>& terms);
  Unidentified nonlinear_identifiability(const ModelFit& fit, const Candidate& candidate) const;
  std::string limit_reached(const ModelFit& fit, const Candidate& candidate) const;

  Selection& selection_;
  const Problem& problem_;
  const Trials& trials_;
  const Candidates& candidates_;
  std::uint64_t seed_;
};

}  // namespace tofgraph::diagnosis
