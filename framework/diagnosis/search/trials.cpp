// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/trials.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/scan.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Adds a probe and its group for each combination of nonlinear values at which a candidate is scored.
void probe(const Problem& problem, const State& state, const Rows& rows, const Candidate& candidate,
           NonlinearRange range, Probes& probes) {
  if (candidate.amplitudes() == 0) return;
  Probe one{&candidate, {}};
  const std::vector<FreeParameter>& parameters = candidate.free();
  bool first = true;
  for (std::vector<double>& values : starts_of_nonlinear(parameters, range)) {
    one.values = std::move(values);
    Group group;
    try {
      for (std::size_t k = 0; k < parameters.size(); ++k) {
        if (parameters[k].nonlinear) continue;
        group.columns.push_back(
            change_by_step(problem, rows, one.values, k, parameters[k].step(),
                           [&](std::span<const double> moved) { return one.placed(state, moved); }));
      }
    } catch (const simulation::EffectError&) {
      if (std::exchange(first, false)) throw;  // the effect must be defined at its usual nonlinear values
      continue;
    }
    first = false;
    probes.groups.push_back(std::move(group));
    probes.list.push_back(one);
  }
}

/// Basis of the determined part of a block, orthonormal in the metric of the information. Sets the norm.
Eigen::MatrixXd frame(const Eigen::MatrixXd& block, Visibility& seen) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(block);
  const Eigen::ArrayXd values = solver.eigenvalues().array().max(0).sqrt();
  seen.norm = values.maxCoeff();
  const Eigen::Index kept = (values > settings.determined_above).count();
  return solver.eigenvectors().rightCols(kept) * values.tail(kept).inverse().matrix().asDiagonal();
}

}  // namespace

Column change_by_step(const Problem& problem, const Rows& rows, std::vector<double> values, std::size_t parameter,
                      double step, const std::function<State(std::span<const double>)>& placed) {
  Column column;
  double sign = 1;
  values[parameter] += step;
  try {
    column = expected(problem, placed(values));
  } catch (const simulation::EffectError&) {
    sign = -1;
    values[parameter] -= 2 * step;
    column = expected(problem, placed(values));
  }
  for (std::size_t i = 0; i < column.size(); ++i) {
    for (std::size_t row = 0; row < column[i].size(); ++row) column[i][row] = sign * (column[i][row] - rows[i][row]);
  }
  return column;
}

State Probe::placed(State state, std::span<const double> chosen) const {
  state.terms.push_back({candidate, {chosen.begin(), chosen.end()}});
  return state;
}

Probes probes_of(const Problem& problem, const State& state, const Candidates& candidates, NonlinearRange range) {
  Probes probes;
  const auto rows = expected(problem, state);
  for (const auto& candidate : candidates) {
    if (is_in(state, *candidate) || !candidate->maps().empty()) continue;  // maps are estimated separately
    const std::size_t before = probes.list.size();
    try {
      probe(problem, state, rows, *candidate, range, probes);
    } catch (const simulation::EffectError& error) {
      probes.refused[candidate->name()] = error.what();
      probes.list.resize(before);
      probes.groups.resize(before);
    }
  }
  return probes;
}

/// Starts of a fit: at the amplitudes that the score suggests; with undetermined ones at half their typical value,
/// because an amplitude may show only with another one; and with the effect off.
std::vector<State> Trials::starts(const State& state, const Probe& probe, const Score& score) const {
  std::vector<double> guess = probe.values, other = guess;
  bool unmoved = false;
  Eigen::Index column = 0;
  for (std::size_t k = 0; k < guess.size(); ++k) {
    const FreeParameter& p = probe.candidate->free()[k];
    if (p.nonlinear) continue;
    const double share = score.values(column++);
    guess[k] = other[k] = std::clamp(p.off + share * p.step(), p.minimum, p.maximum);
    if (std::abs(share) > settings.unmoved_amplitude) continue;
    other[k] = p.off + p.step() / 2;
    unmoved = true;
  }
  std::vector<State> result = {probe.placed(state, guess)};
  if (unmoved) result.push_back(probe.placed(state, other));
  result.push_back(probe.placed(state, probe.values));
  return result;
}

Trial Trials::fitted(const ModelFit& base, const Probe& probe, const Score& score) const {
  Trial result{probe.candidate, {}, score};
  const std::vector<State> all = starts(base.state, probe, score);
  for (std::size_t s = 0; s < all.size(); ++s) {
    // The last start is used if the others are outside the effect's domain or end in a poor minimum.
    if (s + 1 == all.size() && result.fit.deviance < base.deviance) break;
    try {
      ModelFit next = fit_roughly(problem_, all[s], base.jacobian);
      if (next.deviance < result.fit.deviance) result.fit = std::move(next);
    } catch (const simulation::EffectError&) {
      continue;
    }
  }
  return result;
}

std::vector<Trial> Trials::best(const ModelFit& base, const Candidate* except, double promising,
                                std::span<const std::string> always) const {
  std::vector<const Probe*> probes;
  std::vector<const Group*> groups;
  for (std::size_t p = 0; p < probes_.list.size(); ++p) {
    const Probe& probe = probes_.list[p];
    if (is_in(base.state, *probe.candidate) || probes_.refused.contains(probe.candidate->name())) continue;
    probes.push_back(&probe);
    groups.push_back(&probes_.groups[p]);
  }
  if (groups.empty()) return {};
  const Scan scanned = scan(problem_, base, groups);
  std::vector<std::size_t> ranked(probes.size());
  for (std::size_t i = 0; i < ranked.size(); ++i) ranked[i] = i;
  const double price = std::log(static_cast<double>(problem_.data.size()));
  const auto merit = [&](std::size_t i) { return scanned.scores[i].gain - scanned.scores[i].dimension * price; };
  std::ranges::stable_sort(ranked, std::greater<>{}, merit);
  const double most = scanned.scores[ranked.front()].gain;
  std::vector<Trial> result;
  std::map<const Candidate*, std::pair<std::size_t, double>> tried;  // number of starts, and the gain of the first
  for (const std::size_t i : ranked) {
    const Probe& probe = *probes[i];
    const Score& score = scanned.scores[i];
    const bool asked = contains(always, probe.candidate->name());
    const bool out = except != nullptr && &probe.candidate->root() == &except->root();
    if (out || (!asked && score.gain < promising * most)) continue;
    if (!asked && !tried.contains(probe.candidate) && tried.size() >= settings.max_fitted_candidates) continue;
    auto& [starts, first_gain] = tried.try_emplace(probe.candidate, 0, score.gain).first->second;
    const bool again = starts > 0 && score.gain > 0.999 * first_gain;  // an angle half a turn further, opposite sign
    if (starts == settings.max_starts || again || score.gain < settings.second_start_gain * first_gain) continue;
    ++starts;
    Trial trial = fitted(base, probe, score);
    if (!std::isfinite(trial.fit.deviance)) continue;
    const auto before = std::ranges::find(result, probe.candidate, &Trial::candidate);
    if (before == result.end())
      result.push_back(std::move(trial));
    else if (trial.fit.deviance < before->fit.deviance)
      before->fit = std::move(trial.fit);
  }
  std::ranges::stable_sort(result, {}, [&](const Trial& t) { return t.fit.bic(problem_.data.size()); });
  return result;
}

Audit audit(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates) {
  ModelFit fit;
  fit.state = {model, std::vector<double>(problem.targets.size(), 0), {}};
  if (std::isfinite(problem.nuisances.jitter)) fit.state.random_sd.jitter = problem.nuisances.jitter;
  Probes probes = probes_of(problem, fit.state, candidates, NonlinearRange::usual);
  Audit result;
  Group together;
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
