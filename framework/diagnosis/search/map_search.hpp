// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Effects with a number for every pixel in a selection: they come last, and may take the place of others.
#pragma once

#include "diagnosis/model/fit.hpp"
#include "diagnosis/search/selection_task.hpp"

namespace tofgraph::diagnosis {

class MapSearch {
 public:
  /// @param task must live on
  explicit MapSearch(SelectionTask& task) : task_(task) {}

  /// When no effect with a few parameters helps any more: maps beside what was found or in its place, if these are
  /// worth their parameters.
  std::optional<ModelFit> best(const SelectedModel& selected);
  /// Maps beside the model as it was, without what was added: those of one effect, and beside them those of others
  /// while these are worth it and more than enough is left. @param enough chi-square over its expectation
  std::optional<MapTrial> alone(const SelectedModel& selected, double enough);
  /// Maps alone where they explain all there is beside the model as it was, or nearly, and what was added to it does
  /// not: that stands for a part of them. @param added with its jacobian
  std::optional<ModelFit> in_place_of(const ModelFit& added, const SelectedModel& selected);

 private:
  std::optional<MapTrial> beside(const ModelFit& base);

  SelectionTask& task_;
};

// ---- The mean of a map of lengths and a constant offset are one and the same ----

/// A state in which the constant has all of it, where the model has one: estimated maps of lengths then have no mean
/// over the pixels. It expects the same as before. @throws simulation::EffectError
State with_means_in_constant(const Problem& problem, State state);

}  // namespace tofgraph::diagnosis
