// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/audit.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

constexpr double blind_below = 5;       ///< standard deviations
constexpr double determined_above = 3;  ///< singular value of a signature
constexpr double found_at = 8;          ///< standard deviations at which a search finds an effect
constexpr double alike_above = 0.9;

/// Columns e of the unit ball: an orthonormal frame of the determined part of a block of the information.
Eigen::MatrixXd frame(const Eigen::MatrixXd& block, Visibility& seen) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(block);
  const Eigen::ArrayXd values = solver.eigenvalues().array().max(0).sqrt();
  seen.norm = values.maxCoeff();
  seen.rank = static_cast<std::size_t>((values > determined_above).count());
  const auto kept = static_cast<Eigen::Index>(seen.rank);
  return solver.eigenvectors().rightCols(kept) * values.tail(kept).inverse().matrix().asDiagonal();
}

}  // namespace

Audit audit(const Problem& problem, const std::vector<Term>& model,
            const std::vector<std::unique_ptr<Candidate>>& candidates) {
  Fit fit;
  fit.state = {model, std::vector<double>(problem.targets.size(), 0), {}};
  const auto rows = expected(problem, fit.state);
  std::vector<Group> groups;
  Audit result;
  std::vector<std::size_t> with_columns;
  for (const auto& candidate : candidates) {
    if (std::ranges::any_of(model, [&](const Term& t) { return t.candidate->name() == candidate->name(); })) continue;
    Group group{candidate->name(), {}};
    try {
      for (const std::vector<double>& values : candidate->probes()) {
        State with = fit.state;
        with.terms.push_back({candidate.get(), values});
        for (std::size_t k = 0; k < candidate->free().size(); ++k) {
          if (!candidate->free()[k].shape)
            group.columns.push_back(derivative(problem, with, rows, with.terms.size() - 1, k));
        }
      }
    } catch (const simulation::EffectError&) {
      continue;  // the search says so
    }
    result.effects.push_back({candidate.get(), 0, 0, std::numeric_limits<double>::infinity(), true});
    if (group.columns.empty()) continue;
    with_columns.push_back(result.effects.size() - 1);
    groups.push_back(std::move(group));
  }
  Group together{"all", {}};
  for (const Group& group : groups)
    together.columns.insert(together.columns.end(), group.columns.begin(), group.columns.end());
  if (groups.empty()) return result;
  const Eigen::MatrixXd information = scan(problem, fit, std::span(&together, 1), 0, 0).scores[0].information;
  std::vector<Eigen::MatrixXd> frames;
  std::vector<Eigen::Index> first;
  Eigen::Index at = 0;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto count = static_cast<Eigen::Index>(groups[g].columns.size());
    Visibility& seen = result.effects[with_columns[g]];
    frames.push_back(frame(information.block(at, at, count, count), seen));
    first.push_back(at);
    at += count;
    seen.blind = seen.norm < blind_below;
    seen.smallest = found_at / std::max(seen.norm, 1e-12);
  }
  for (std::size_t a = 0; a < groups.size(); ++a) {
    for (std::size_t b = a + 1; b < groups.size(); ++b) {
      if (frames[a].cols() == 0 || frames[b].cols() == 0) continue;
      const Eigen::MatrixXd cross =
          frames[a].transpose() * information.block(first[a], first[b], frames[a].rows(), frames[b].rows()) * frames[b];
      const double cosine = std::min(cross.jacobiSvd().singularValues()(0), 1.0);
      if (cosine > alike_above)
        result.alike.push_back(
            {result.effects[with_columns[a]].candidate, result.effects[with_columns[b]].candidate, cosine});
    }
  }
  return result;
}

}  // namespace tofgraph::diagnosis
