// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Tests of selected effects, on the data that they were selected on and on held-out data. A new test of an effect is
/// one more condition in EffectTests::test_on_all_data (all data) or in held_out_failure() (held-out data).
#pragma once

#include "diagnosis/search/findings.hpp"

namespace tofgraph::diagnosis {

class EffectTests {
 public:
  /// @param findings must outlive this object
  explicit EffectTests(Findings& findings) : findings_(findings) {}

  /// Tests every addition on all data and drops the worst failing one, repeatedly until all pass; then drops effects
  /// whose values are not identifiable.
  void run();

  /// Cross-fits. If nothing is named, the model stays unchanged and predicts held-out conditions as it is. The
  /// selection in a fold does not depend on the tested effects, so folds are never searched twice. All folds are
  /// searched if they agree on an effect that the model lacks, see follow_folds().
  void cross_fit();
  /// Fits to all data the sets of folds that contain an effect which most folds chose and the model lacks, until one is
  /// better. @returns true if one was accepted
  bool follow_folds();
  /// Drops effects that held-out data do not confirm, each alone; those that pass alone must also pass together, in the
  /// folds that chose nothing else if these are the majority; if they fail together, all are dropped.
  /// @returns true if an effect was dropped
  bool drop_unconfirmed();
  /// Sets a finding's share of folds and improvement on held-out data, from all its names.
  void set_held_out_results(EffectFinding& finding) const;

 private:
  EffectFinding test_on_all_data(const ModelTerm& addition, const PatternScan& with_it, bool confirmed) const;
  double explained_fraction(const ModelFit& less, const PatternScan& with_it, double gain) const;
  double chance(const ModelFit& less, const Score& score) const;
  bool drop_worst_failing();
  bool drop_unidentifiable();
  bool is_confirmed(const ModelTerm& addition) const;
  bool all_confirmed() const;
  void compare_unconfirmed();
  std::string why_not_together() const;

  Findings& findings_;
  std::vector<FoldResult> searched_folds_;
};

}  // namespace tofgraph::diagnosis
