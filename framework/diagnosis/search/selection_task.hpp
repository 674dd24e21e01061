// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Task of a selection and the model that it has reached, which all its steps share.
#pragma once

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/maps.hpp"

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tofgraph::diagnosis {

// ---- Steps of a search, so that a reader can follow why an effect was accepted or rejected ----

struct Step {
  std::string what;  ///< ranked, fitted, fitted again, maps, taken out, allowed, questioned, valued, exchanged, proved
  std::vector<std::string> effects;                     ///< that it was done with, "effect.parameter" for refinements
  std::vector<std::pair<std::string, double>> numbers;  ///< NaN: there is none
  std::string outcome;
};

// ---- Task of a selection and the model that it has reached, which all its steps share ----

struct SearchOptions {
  std::size_t max_effects = settings.max_effects;
  std::uint64_t seed = 1;
  std::size_t flips = settings.sign_flips;
  std::function<void(const std::string& what)> progress;             ///< may be empty
  std::function<void(std::size_t done, std::size_t all)> fold_done;  ///< may be empty; from any thread
  Deadline deadline = {};  ///< of the search; what it has established by then is verified
  /// Refits a model with those of the given values held that the data do not determine; nothing where all are
  /// determined. May be empty.
  std::function<std::optional<ModelFit>(const Problem& problem, const ModelFit& fit)> hold_given;
  Deadline verification = {};  ///< of that; where it passes, the model stays as it was given
  Deadline comparison = {};    ///< of what is written with what else could stand in its place
};

/// The model that a selection has reached. Undoing a step is assigning a copy.
struct SelectedModel {
  ModelFit original, best;               ///< the model as it is, and with what was added
  std::vector<const Candidate*> barred;  ///< roots that are not tried: exchanged, or they gave no number
  /// The best model with its effects as they were while the drift had a mean, where that has just been taken away: it
  /// stood for a constant, and in the fit without either other effects may bend to make up for that.
  std::optional<ModelFit> about_drift_mean = {};

  /// The model as it is, with the nuisances of the best one and at its grid bias, so that both can be compared.
  ModelFit original_beside_best() const {
    ModelFit given = original;
    given.state.nuisances = best.state.nuisances;
    given.state.linearisation.grid_bias = best.state.linearisation.grid_bias;
    return given;
  }
};

/// Data, candidates and options of a selection, with its log.
struct SelectionTask {
  const Problem problem;
  const std::vector<Term>& model;  ///< as it is
  const std::vector<std::unique_ptr<Candidate>>& candidates;
  const SearchOptions& options;
  std::map<std::string, std::string> refused;  ///< effects that are not tried, and why
  std::vector<double> weight;                  ///< of each condition
  std::vector<Step> trace = {};

  double bic(const ModelFit& fit) const { return fit.bic(problem.data.size()); }
  std::size_t added(const ModelFit& fit) const { return fit.state.terms.size() - model.size(); }
  bool may_add(const ModelFit& fit) const { return fit.state.terms.size() < model.size() + options.max_effects; }
  void report_progress(const std::string& what) const {
    if (options.progress) options.progress(what);
  }
  void note(Step step) { trace.push_back(std::move(step)); }
};

}  // namespace tofgraph::diagnosis
