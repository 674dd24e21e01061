// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Candidates scored against the residual of a fit, and joint fits of the most promising ones.
#pragma once

#include "diagnosis/model/scan.hpp"

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

namespace tofgraph::diagnosis {

// ---- Changes that each candidate would make, before any is fitted ----

/// A candidate with nonlinear values at which its amplitudes are scored.
struct Probe {
  const Candidate* candidate = nullptr;
  std::vector<double> values;

  /// State with the candidate added. @param chosen values of its parameters
  State placed(State state, std::span<const double> chosen) const;
};

/// Probes and their columns: the change by a typical step of each amplitude, FreeParameter::step(), in the order of the
/// parameters. A whole step instead of a derivative, because the change by some effects is quadratic in their
/// amplitude.
struct Probes {
  std::vector<Probe> list;
  std::vector<Group> groups;
  std::map<std::string, std::string> refused;  ///< candidates that cannot be used, with reasons
};

/// @param state to which the changes are made; candidates that it has are skipped
Probes probes_of(const Problem& problem, const State& state, const Candidates& candidates,
                 NonlinearRange range = NonlinearRange::any);

/// Change of the rows by one step of a parameter, or if the effect fails there, by one in the opposite direction.
/// @param rows without the step @param placed makes the state with given values of the parameters
/// @throws simulation::EffectError if both fail
Column change_by_step(const Problem& problem, const Rows& rows, std::vector<double> values, std::size_t parameter,
                      double step, const std::function<State(std::span<const double>)>& placed);

// ---- Scores of the candidates, and joint fits ----

/// A candidate in a model, with its score before the fit.
struct Trial {
  const Candidate* candidate = nullptr;
  ModelFit fit;
  Score score;
};

class Trials {
 public:
  Trials(const Problem& problem, const Candidates& candidates) : problem_(problem), candidates_(candidates) {}

  /// Probes the candidates; to be called first.
  /// @param state to which the changes are made @param refused candidates that are not tried, with reasons
  void prepare(const State& state, const std::map<std::string, std::string>& refused) {
    probes_ = probes_of(problem_, state, candidates_);
    probes_.refused.insert(refused.begin(), refused.end());
  }
  const std::map<std::string, std::string>& refused() const { return probes_.refused; }

  /// Fits of the best candidates, best first by BIC.
  /// @param except a candidate that is scored but not fitted, or nullptr
  /// @param promising fraction of the best score below which none is fitted
  /// @param always names of those that are fitted regardless of their score
  std::vector<Trial> best(const ModelFit& base, const Candidate* except, double promising,
                          std::span<const std::string> always = {}) const;

 private:
  std::vector<State> starts(const State& state, const Probe& probe, const Score& score) const;
  Trial fitted(const ModelFit& base, const Probe& probe, const Score& score) const;

  const Problem& problem_;
  const Candidates& candidates_;
  Probes probes_;
};

// ---- Effects that a design can reveal, determined without any residual ----

struct Visibility {
  const Candidate* candidate = nullptr;
  double norm = 0;  ///< norm of the signature at the typical value, in standard deviations
  /// Smallest detectable size over the typical value: enough standard deviations, and in some condition at least
  /// practical_threshold. For an effect with several amplitudes the most visible one counts.
  double smallest = 0;
  bool blind = false;  ///< at its typical value too few standard deviations, or too small a change
};

/// Two effects whose signatures this design hardly distinguishes.
struct Alike {
  const Candidate *first = nullptr, *second = nullptr;
  double cosine = 0;  ///< largest principal cosine
};

struct Audit {
  std::vector<Visibility> effects;
  std::vector<Alike> alike;
};

/// @param model terms of the model; their candidates are skipped
Audit audit(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates);

}  // namespace tofgraph::diagnosis
