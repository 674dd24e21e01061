// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/pattern_ties.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/maps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

/// True if the data do not determine one of the amplitudes of a group beside the maps of a fit.
bool is_left_open(const Problem& problem, const ModelFit& fit, const Group& group) {
  const Score score = score_of(problem, fit, group, 0, 0, map_columns(problem, fit.state));
  const Eigen::Index n = score.information.rows();
  const Eigen::MatrixXd prior = Eigen::MatrixXd::Identity(n, n) / (settings.prior_width * settings.prior_width);
  const Eigen::VectorXd variance = (score.information + prior).inverse().diagonal();
  return 1.96 * std::sqrt(variance.maxCoeff()) > settings.max_tie_width;
}

}  // namespace

std::vector<std::string> notes_on_pattern_ties(const Problem& problem, const ModelFit& given,
                                               const std::vector<std::unique_ptr<Candidate>>& candidates) {
  std::vector<std::string> notes;
  const ModelFit fit = linearised(problem, given);
  const Probes probes = probes_of(problem, fit.state, candidates, NonlinearRange::usual);
  for (const Term& term : fit.state.terms) {
    if (!term.maps) continue;
    const std::vector<std::string> alike = confused_with(*term.candidate, candidates);
    for (std::size_t p = 0; p < probes.list.size(); ++p) {
      const Candidate& other = *probes.list[p].candidate;
      if (other.border().scope != TOFGRAPH_SCOPE_SETUP || std::ranges::find(alike, other.name()) == alike.end() ||
          !is_left_open(problem, fit, probes.groups[p]))
        continue;
      notes.push_back(fmt::format(
          "These conditions cannot distinguish {} from the map of {}: a slope of the map over the image may be either. "
          "What does: {}.",
          other.name(), term.candidate->name(), other.border().experiment));
    }
  }
  return notes;
}

}  // namespace tofgraph::diagnosis
