// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/gates.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/residual_structure.hpp"
#include "diagnosis/search/maps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tofgraph::diagnosis {

Gates::Gates(const Problem& problem, const PatternFinder& finder, const Alternatives& candidates, std::size_t flips,
             std::uint64_t seed)
    : problem_(problem), finder_(finder), candidates_(candidates), flips_(flips), seed_(seed) {}

double Gates::explained_fraction(const ModelFit& less, const Group& group) const {
  const double gain = score_of(problem_, less, group, 0, 0).gain;
  const double most = finder_.find(problem_, less, 0, 0).most;
  return most > 0 ? gain / most : std::numeric_limits<double>::infinity();
}

/// Gain of an effect over that of the best generic pattern that it lowers: whatever else is left, in its observables or
/// in others, says nothing of it. Where nothing is left, the share of that pattern that is gone with the effect, if
/// that is more: then the pattern has gained by what is fitted anew beside the effect. NaN where it lowers none.
/// @param less the model without it @param left the patterns of the model with it
double Gates::explained(const ModelFit& less, const PatternScan& left, double gain) const {
  const PatternScan before = finder_.find(problem_, less, 0, 0);
  double most = 0, gone = 0;
  for (std::size_t p = 0; p < before.gains.size(); ++p) {
    const double fall = before.gains[p] - std::max(left.gains[p], 0.0);
    if (fall > settings.related_pattern_fall * before.gains[p] && before.gains[p] > most)
      most = before.gains[p], gone = fall;
  }
  if (!(most > 0)) return std::numeric_limits<double>::quiet_NaN();
  const bool nothing_left = left.square <= settings.explained * left.freedom;
  return (nothing_left ? std::max(gain, gone) : gain) / most;
}

/// Probability that any candidate gains as much as one direction does in a model without it. Chance is what the best
/// model leaves: where something else is unexplained, that is in it.
double Gates::chance(const ModelFit& best, const ModelFit& less, const Score& score) const {
  ModelFit remaining = best;
  remaining.state.linearisation = less.state.linearisation;
  remaining.jacobian = less.jacobian;
  const Score all = score_of(problem_, remaining, candidates_.group, 0, 0);
  std::vector<std::vector<Eigen::Index>> groups;
  for (const Choice& choice : candidates_.choices) groups.push_back(choice.columns);
  return chance_of(score, all, groups, flips_, seed_);
}

EffectFinding Gates::evaluate_term(const ModelFit& best, const ModelFit& less, const PatternScan& left,
                                   const ModelTerm& addition, bool proved) {
  const Term& term = best.state.terms[addition.term];
  EffectFinding found;
  found.candidate = term.candidate;
  found.name = name_of(term, addition);
  found.gain = less.deviance - best.deviance;
  const Group group{found.name, signature(problem_, less.state, best.state, addition)};
  // The one direction that was fitted; among all directions of all candidates it has been chosen when it was added.
  const Group direction{group.name, {group.columns[0]}};
  Score score = term.maps ? score_of_maps(problem_, less, term, flips_, seed_)
                          : score_of(problem_, less, direction, flips_, seed_);
  const bool nothing_left = left.square <= settings.explained * left.freedom;
  if (!term.maps) {
    // Its own flips turn a wander, too, which grows where the piece is missing. Where nothing is left with it, the
    // likelihood compares the two; not beside shapes of boards, which stay as they are without the piece.
    const double parameters = static_cast<double>(values_of(term, addition).size());
    const bool sure =
        nothing_left && !best.state.nuisances.boards && found.gain - parameters > settings.certain_gain * score.stays;
    score.p_value = std::max(chance(best, less, score), sure ? 0.0 : score.p_value);
  }
  found.p_value = score.p_value;
  found.explained_fraction = explained(less, left, score_of(problem_, less, group, 0, 0).gain);
  const double conditions = run_length(problem_, less.state);
  if (!(found.gain > 0)) {
    found.refutation = "without it the data are explained as well";
  } else if (conditions > 1 && found.gain < settings.min_bic_gain * conditions) {
    found.refutation = fmt::format("a residue that stays for {:.0f} conditions may do as much", conditions);
  } else if (!proved && !significant(score)) {
    found.refutation = fmt::format("chance may do as much (p = {:.3f})", found.p_value);
  } else if (max_normalised_rms(problem_, group.columns[0]) <= 1 &&
             !(nothing_left && lack_of_fit(problem_, less) >= settings.explained)) {
    found.refutation = too_small;  // unless the data ask for it: without it something is left, with it nothing
  } else if (found.explained_fraction <
             (proved ? settings.min_explained_fraction_confirmed : settings.min_explained_fraction)) {
    found.refutation =
        fmt::format("it explains {:.0f} % of what a pattern without physics does", 100 * found.explained_fraction);
  } else if (std::isnan(found.explained_fraction) && !nothing_left) {
    found.refutation = "beside what is left it cannot be tested: it lowers no pattern";
  }
  return found;
}

}  // namespace tofgraph::diagnosis
