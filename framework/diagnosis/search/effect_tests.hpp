// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Tests of selected effects, on the data that they were selected on and on held-out data. A new test of an effect is
/// one more condition in EffectTests::evaluate_term (all data) or in held_out_failure() (held-out data).
#pragma once

#include "diagnosis/search/findings.hpp"

namespace tofgraph::diagnosis {

class EffectTests {
 public:
  /// @param findings must live on
  explicit EffectTests(Findings& findings) : findings_(findings) {}

  /// Puts the gates to every addition, drops the one that does worst, and again until all pass; then drops effects
  /// whose values are not identifiable.
  void run();

  /// Cross-fits. Where nothing is named the model stays as it is, and predicts held-out conditions so. Folds search for
  /// themselves, whatever is asked of them: what they found once they would find again. All are searched where they
  /// agree on an effect that the model lacks, see follow_folds().
  void cross_fit();
  /// Fits a model on which most folds agree to all data. @returns whether it is better, and taken
  bool follow_folds();
  /// Drops what does not prove itself on held-out data, each alone; what passes alone has to pass together, too: in the
  /// folds that have nothing else beside it, where most are such. @returns whether there was such a one
  bool drop_unconfirmed();
  /// Shares and improvements on held-out data of a finding, by all its names.
  void weigh(EffectFinding& finding) const;
  /// Gain of a signature over that of the best generic pattern, in a model without it.
  double explained_fraction(const ModelFit& less, const Group& group) const;

 private:
  EffectFinding evaluate_term(const ModelTerm& addition, const PatternScan& left, bool proved) const;
  double explained(const ModelFit& less, const PatternScan& left, double gain) const;
  double chance(const ModelFit& less, const Score& score) const;
  bool gate_once();
  bool drop_unidentifiable();
  bool is_confirmed(const ModelTerm& addition) const;
  bool all_confirmed();
  std::string why_not_together() const;

  Findings& findings_;
  std::vector<FoldResult> searched_folds_;
};

}  // namespace tofgraph::diagnosis
