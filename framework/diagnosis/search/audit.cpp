// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/audit.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/trials.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

/// Basis of the determined part of a block, orthonormal in the metric of the information. Sets the norm.
Eigen::MatrixXd frame(const Eigen::MatrixXd& block, Visibility& seen) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(block);
  const Eigen::ArrayXd values = solver.eigenvalues().array().max(0).sqrt();
  seen.norm = values.maxCoeff();
  const Eigen::Index kept = (values > settings.determined_above).count();
  return solver.eigenvectors().rightCols(kept) * values.tail(kept).inverse().matrix().asDiagonal();
}

}  // namespace

Audit audit(const Problem& problem, const std::vector<Term>& model,
            const std::vector<std::unique_ptr<Candidate>>& candidates) {
  ModelFit fit;
  fit.state = {model, std::vector<double>(problem.targets.size(), 0), {}};
  if (std::isfinite(problem.nuisances.jitter)) fit.state.random_sd.jitter = problem.nuisances.jitter;
  Probes probes = probes_of(problem, fit.state, candidates, NonlinearRange::usual);
  Audit result;
  Group together{"all", {}};
  std::vector<Eigen::Index> columns;  // number of columns per effect
  std::vector<double> most;           // largest change per effect, see max_normalised_rms()
  for (const auto& candidate : candidates) {
    if (is_in(fit.state, *candidate) || probes.refused.contains(candidate->name())) continue;
    if (!candidate->maps().empty() && problem.design.superpixels() > 1) continue;  // each pixel of a board shows it
    result.effects.push_back({candidate.get(), 0, std::numeric_limits<double>::infinity(), true});
    const std::size_t before = together.columns.size();
    most.push_back(0);
    for (std::size_t p = 0; p < probes.list.size(); ++p) {
      if (probes.list[p].candidate != candidate.get()) continue;
      for (Column& column : probes.groups[p].columns) {
        most.back() = std::max(most.back(), max_normalised_rms(problem, column));
        together.columns.push_back(std::move(column));
      }
    }
    columns.push_back(static_cast<Eigen::Index>(together.columns.size() - before));
  }
  if (together.columns.empty()) return result;
  fit = with_jacobian(problem, std::move(fit));
  const Eigen::MatrixXd information = score_of(problem, fit, together).information;
  std::vector<Eigen::MatrixXd> frames;
  std::vector<Eigen::Index> first;
  Eigen::Index at = 0;
  for (std::size_t e = 0; e < columns.size(); ++e) {
    const Eigen::Index count = columns[e];
    first.push_back(at);
    if (count == 0) {
      frames.emplace_back();
      continue;
    }
    Visibility& seen = result.effects[e];
    frames.push_back(frame(information.block(at, at, count, count), seen));
    at += count;
    seen.blind = seen.norm < settings.blind_below || most[e] < 1;
    seen.smallest = std::max(settings.found_at / std::max(seen.norm, 1e-12), 1 / std::max(most[e], 1e-12));
  }
  for (std::size_t a = 0; a < frames.size(); ++a) {
    for (std::size_t b = a + 1; b < frames.size(); ++b) {
      if (frames[a].cols() == 0 || frames[b].cols() == 0) continue;
      const Eigen::MatrixXd cross =
          frames[a].transpose() * information.block(first[a], first[b], frames[a].rows(), frames[b].rows()) * frames[b];
      const double cosine = std::min(cross.jacobiSvd().singularValues()(0), 1.0);
      if (cosine > settings.alike_above)
        result.alike.push_back({result.effects[a].candidate, result.effects[b].candidate, cosine});
    }
  }
  return result;
}

}  // namespace tofgraph::diagnosis
