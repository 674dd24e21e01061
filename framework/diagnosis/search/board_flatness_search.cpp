// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/selection.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Calls f(parameter, value) for the values that can be extrapolated: neither maps nor angles, which are periodic.
/// @param state const or not; the values are accordingly
template <class S, class F> void for_each_steady(S& state, F f) {
  for (auto& term : state.terms) {
    for (std::size_t k = 0; !term.maps && k < term.values.size(); ++k) {
      if (!term.candidate->free()[k].is_angle()) f(term.candidate->free()[k], term.values[k]);
    }
  }
}

/// Values in typical values.
Eigen::VectorXd steady_values(const State& state) {
  std::vector<double> values;
  for_each_steady(state, [&](const FreeParameter& p, double value) { values.push_back(value / std::abs(p.typical)); });
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

State with_steady_values(State state, const Eigen::VectorXd& values) {
  Eigen::Index at = 0;
  for_each_steady(state, [&](const FreeParameter& p, double& value) {
    value = std::clamp(values(at++) * std::abs(p.typical), p.minimum, p.maximum);
  });
  return state;
}

/// Deviance of a model including the cost of its board heights: their prior and determinant.
double deviance_with_boards(const ModelFit& fit) {
  return fit.deviance + (fit.state.nuisances.boards ? fit.state.nuisances.boards->cost : 0);
}

}  // namespace

BoardTrial BoardFlatnessSearch::trial_for(const State& state) {
  if (state.nuisances.boards || task_.problem.design.superpixels() < 2) return {};
  if (!shapes_) shapes_ = std::make_unique<const BoardFlatness>(task_.problem);
  return shapes_->trial(task_.problem, state);
}

/// Fits boards and effects once. @returns true if there are boards, and both together fit better
bool BoardFlatnessSearch::refit_once(ModelFit& fit, bool unsure) const {
  const double before = deviance_with_boards(fit);
  if (!fit.state.nuisances.boards) return false;
  BoardTrial boards = shapes_->trial(task_.problem, fit.state);
  fit.state.nuisances.boards = boards.sure || unsure ? std::move(boards.boards) : nullptr;
  fit = with_jacobian(task_.problem, fit_with_maps(task_.problem, fit.state));
  return before - deviance_with_boards(fit) >= settings.board_converged;
}

/// Boards and effects with similar signatures would converge slowly: after two steps the values are extrapolated from
/// the difference of the steps (SQUAREM, R. Varadhan and C. Roland, Scandinavian Journal of Statistics 35, 2008, scheme
/// S3), and restored if the extrapolation went too far.
ModelFit BoardFlatnessSearch::refit(ModelFit fit, bool unsure) const {
  for (int round = 0; round < settings.board_max_rounds; ++round) {
    const Eigen::VectorXd start = steady_values(fit.state);
    if (!refit_once(fit, unsure)) return fit;
    const Eigen::VectorXd first = steady_values(fit.state);
    if (!refit_once(fit, unsure)) return fit;
    const Eigen::VectorXd second = steady_values(fit.state), step = first - start, bend = second - first - step;
    if (!(bend.norm() > 0) || !(step.norm() > bend.norm())) continue;  // converges without extrapolation
    const double length = step.norm() / bend.norm();
    ModelFit farther = fit;
    try {
      farther.state = with_steady_values(fit.state, start + 2 * length * step + length * length * bend);
      refit_once(farther, unsure);
      if (deviance_with_boards(farther) <= deviance_with_boards(fit)) fit = std::move(farther);
    } catch (const simulation::EffectError&) {  // too far: the fit is kept
    }
  }
  return fit;
}

}  // namespace tofgraph::diagnosis
