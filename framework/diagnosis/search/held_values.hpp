// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Parameters of the given model that the data do not determine: they keep their values.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// The effects of the given model, with those of their parameters that may be refitted.
class GivenModel {
 public:
  /// @param effects must live on
  explicit GivenModel(const std::vector<simulation::ModelEffect>& effects);
  GivenModel(const GivenModel&) = delete;
  GivenModel& operator=(const GivenModel&) = delete;

  const std::vector<Term>& terms() const { return terms_; }

  /// Holds what the data do not determine in the given model alone, or beside one simpler effect that it lacks: a drift
  /// of a camera that was warm all the time must not take the place of a constant.
  /// @param candidates effects that may be added @throws simulation::EffectError
  void hold_undetermined(const Problem& problem, const std::vector<std::unique_ptr<Candidate>>& candidates);
  /// Holds what the data do not determine in a model whose first terms are these, one parameter after the other.
  /// @returns the model fitted with these held; nothing where all are determined @throws simulation::EffectError
  std::optional<ModelFit> hold_undetermined_in(const Problem& problem, ModelFit fit);

  /// "warm_up drift stays at -0.0107 m: these conditions do not determine it.", for each that is held.
  std::vector<std::string> notes() const;

 private:
  struct Held {
    std::string parameter, why;
  };

  void hold(std::size_t term, const FreeParameter& parameter, const std::string& why);
  bool hold_beside_simpler(const Problem& problem, const State& state,
                           const std::vector<std::unique_ptr<Candidate>>& candidates);

  const std::vector<simulation::ModelEffect>& effects_;
  std::vector<std::unique_ptr<Candidate>> candidates_;  ///< replaced ones stay: states of a search point to them
  std::vector<Term> terms_;
  std::vector<Held> held_;
};

}  // namespace tofgraph::diagnosis
