// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/pattern_ties.hpp"

#include "diagnosis/maps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

constexpr double widest = 1;  ///< typical sizes that the 95 % interval of an effect spans to either side at most

/// Whether the data leave one of the sizes of a group open, beside the maps of a fit.
bool is_left_open(const Problem& problem, const Fit& fit, const std::vector<Column>& own, const Group& group) {
  const Score score = score_of(problem, fit, own, group, 0, 0, map_columns(problem, fit.state));
  const Eigen::Index n = score.information.rows();
  const Eigen::MatrixXd prior = Eigen::MatrixXd::Identity(n, n) / (prior_width * prior_width);
  const Eigen::VectorXd variance = (score.information + prior).inverse().diagonal();
  return 1.96 * std::sqrt(variance.maxCoeff()) > widest;
}

}  // namespace

std::vector<std::string> notes_on_pattern_ties(const Problem& problem, const Fit& fit,
                                               const std::vector<std::unique_ptr<Candidate>>& candidates) {
  std::vector<std::string> notes;
  const std::vector<Column> own = own_columns(problem, fit.state, expected(problem, fit.state));
  const Probes probes = probes_of(problem, fit.state, candidates, Shapes::usual);
  for (const Term& term : fit.state.terms) {
    if (!term.maps) continue;
    const std::vector<std::string> alike = confused_with(*term.candidate, candidates);
    for (std::size_t p = 0; p < probes.list.size(); ++p) {
      const Candidate& other = *probes.list[p].candidate;
      if (other.border().scope != TOFGRAPH_SCOPE_SETUP || std::ranges::find(alike, other.name()) == alike.end() ||
          !is_left_open(problem, fit, own, probes.groups[p]))
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
