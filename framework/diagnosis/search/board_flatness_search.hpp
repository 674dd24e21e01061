// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Boards that are not flat, in a selection: their shapes are found with the model, anew for another one.
#pragma once

#include "diagnosis/model/board_flatness.hpp"
#include "diagnosis/search/selection_task.hpp"

namespace tofgraph::diagnosis {

class BoardFlatnessSearch {
 public:
  /// @param task must live on
  explicit BoardFlatnessSearch(const SelectionTask& task) : task_(task) {}

  /// Shapes beside a model; nothing if it has some already, or none are worth it.
  BoardTrial beside(const State& state);
  /// Boards and effects in turn, until neither changes. Effects that have a part in the shapes of boards take that back
  /// when they are found anew beside them. A model without boards stays as it is.
  /// @throws simulation::EffectError, but where the values went too far
  ModelFit refit(ModelFit fit);
  /// Shapes need not be the boards' by themselves, see BoardTrial::sure.
  void accept_unsure(bool accepted) { accept_unsure_ = accepted; }

 private:
  bool refit_once(ModelFit& fit) const;

  const SelectionTask& task_;
  std::unique_ptr<const BoardFlatness> shapes_;  ///< when they are asked for
  bool accept_unsure_ = false;
};

}  // namespace tofgraph::diagnosis
