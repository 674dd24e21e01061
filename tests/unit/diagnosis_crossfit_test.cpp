// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: OutOfSample.WhatIsPutAside*:OutOfSample.FoldsThatAreKnown*
// Rooms: diagnosis simulation
// Held-out tests: held-out data are not used by any step that chooses or fits.
#include "diagnosis/search/crossfit.hpp"
#include "tests/unit/rail.hpp"

#include <numbers>
#include <set>

namespace tofgraph::diagnosis {
namespace {

class OutOfSample : public Rail {
 protected:
  CrossFit folds(const std::vector<Observations>& data) const {
    return cross_fit(folds_of(*design), *design, data, {}, candidates, {});
  }
  /// A few candidates suffice here.
  void SetUp() override {
    Rail::SetUp();
    const std::set<std::string> kept = {"wiggling", "crosstalk", "source_position", "zero_offset"};
    std::erase_if(candidates, [&](const auto& c) { return !kept.contains(c->name()); });
  }
};

TEST_F(OutOfSample, EveryConditionIsPutAsideOnceForEachSetting) {
  std::map<std::string, std::multiset<std::size_t>> seen;
  for (const Fold& fold : folds_of(*design)) {
    seen[fold.setting].insert(fold.held.begin(), fold.held.end());
    EXPECT_LT(fold.held.size(), design->size());
    // Whole levels: no remaining condition has the distance of a held-out one.
    if (fold.setting != "distance") continue;
    std::set<double> held, left;
    for (std::size_t i = 0; i < design->size(); ++i)
      (std::ranges::binary_search(fold.held, i) ? held : left).insert(conditions[i].board_distance);
    for (const double distance : held) EXPECT_FALSE(left.contains(distance));
    EXPECT_EQ(fold.extrapolates, *held.begin() < *left.begin() || *held.rbegin() > *left.rbegin());
  }
  ASSERT_EQ(seen.size(), 2U);
  for (const auto& [setting, held] : seen) {
    EXPECT_EQ(held.size(), design->size()) << setting;
    EXPECT_EQ(std::set<std::size_t>(held.begin(), held.end()).size(), design->size()) << setting;
  }
}

TEST_F(OutOfSample, APassedDeadlineEndsThePredictionOfUnsearchedConditions) {
  const std::vector<Observations> data = data_with({}, 3);
  const std::vector<std::size_t> searched = {0, 1, 2, 3, 4, 5, 6, 7}, rest = left_by({.held = searched}, data.size());
  const FoldProblem part(*design, data, searched);
  const State state = fit_as_written(part.problem, {{}, std::vector<double>(part.problem.targets.size(), 0), {}}).state;
  const auto predicted = [&](const Deadline& deadline) {
    return predict_unsearched(part.problem, *design, data, rest, state, state, deadline).folds.at(0);
  };
  EXPECT_EQ(predicted({}).failed, "");
  EXPECT_EQ(predicted({}).conditions.size(), rest.size());
  const FoldResult late = predicted(Deadline(Deadline::Clock::now()));
  EXPECT_EQ(late.failed, "the time limit ended the prediction");
  EXPECT_TRUE(late.conditions.empty());
}

/// Sixteen of twenty conditions in one session: four cannot predict them; with fifteen, a quarter remains.
TEST_F(OutOfSample, ASessionWithNearlyAllConditionsIsNotPutAside) {
  for (const std::size_t large : {16U, 15U}) {
    for (std::size_t i = 0; i < conditions.size(); ++i) conditions[i].session = i < large ? "large" : "small";
    const Design joined(io::load_profile(io::find_profile("camcube2", {})), true, conditions, single);
    std::set<std::string> sessions;
    for (const Fold& fold : folds_of(joined))
      if (fold.setting == "session") sessions.insert(fold.levels);
    EXPECT_EQ(sessions, large == 16 ? std::set<std::string>{"small"} : (std::set<std::string>{"large", "small"}));
  }
}

TEST_F(OutOfSample, EachLevelIsPutAsideAloneAndHalvesAtRandom) {
  std::map<std::string, std::multiset<std::size_t>> seen;
  for (const Fold& fold : single_levels(*design)) {
    seen[fold.setting].insert(fold.held.begin(), fold.held.end());
    std::set<double> distances;
    std::set<std::string> targets;
    for (const std::size_t i : fold.held) {
      distances.insert(conditions[i].board_distance);
      targets.insert(conditions[i].target);
    }
    EXPECT_EQ(fold.setting == each_distance ? distances.size() : targets.size(), 1U);
  }
  for (const char* setting : {each_distance, each_target}) {
    EXPECT_EQ(seen[setting].size(), design->size()) << setting;
    EXPECT_EQ(std::set<std::size_t>(seen[setting].begin(), seen[setting].end()).size(), design->size()) << setting;
  }
  const std::vector<Fold> halves = random_halves(*design, 6, 3), other = random_halves(*design, 6, 4);
  ASSERT_EQ(halves.size(), 6U);
  std::set<std::vector<std::size_t>> different;
  for (const Fold& half : halves) {
    different.insert(half.held);
    EXPECT_TRUE(std::ranges::is_sorted(half.held));
    std::set<double> held, left;
    for (std::size_t i = 0; i < design->size(); ++i)
      (std::ranges::binary_search(half.held, i) ? held : left).insert(conditions[i].board_distance);
    EXPECT_TRUE(held.size() == left.size() || held.size() + 1 == left.size());
    for (const double distance : held) EXPECT_FALSE(left.contains(distance));
  }
  EXPECT_GT(different.size(), 3U);
  EXPECT_NE(halves.front().held, other.front().held);
}

/// A planted leak: held-out data are replaced by other data. The model that predicts them must not change by a single
/// bit, while every model fitted to them does.
TEST_F(OutOfSample, WhatIsPutAsideIsNotSeen) {
  const std::vector<Observations> data = data_with({random_term(effect("wiggling"), 1, 4)}, 5);
  const CrossFit honest = folds(data);
  std::vector<Observations> planted = data;
  const Fold& aside = honest.folds[1].fold;
  for (const std::size_t i : aside.held) {
    for (std::size_t row = 0; row < planted[i].value.size(); ++row) {
      planted[i].value[row] += row < design->superpixels() ? 0.05 : 0.3;
      planted[i].variance[row] *= 0.01;
    }
  }
  const CrossFit other = folds(planted);
  ASSERT_EQ(honest.folds.size(), other.folds.size());
  for (std::size_t f = 0; f < honest.folds.size(); ++f) {
    SCOPED_TRACE(f);
    const State &one = honest.folds[f].state, &two = other.folds[f].state;
    const bool disjoint = f != 1 && honest.folds[f].fold.setting == aside.setting;
    if (f == 1) {
      EXPECT_EQ(honest.folds[f].chosen, other.folds[f].chosen);
      ASSERT_EQ(one.terms.size(), two.terms.size());
      for (std::size_t t = 0; t < one.terms.size(); ++t) EXPECT_EQ(one.terms[t].values, two.terms[t].values);
      EXPECT_EQ(one.log_reflectivity, two.log_reflectivity);
      EXPECT_GT(other.folds[f].conditions[0].after[distance], 100 * honest.folds[f].conditions[0].after[distance]);
    } else if (disjoint) {
      EXPECT_NE(one.random_sd.jitter, two.random_sd.jitter) << "the others have seen it";
    }
  }
}

/// Known folds are reused unchanged, and requested effects may be evaluated on them alone.
TEST_F(OutOfSample, FoldsThatAreKnownAreNotSearchedAgain) {
  const std::vector<Observations> data = data_with({random_term(effect("wiggling"), 1, 4)}, 5);
  const CrossFit all = folds(data);
  ASSERT_GT(all.folds.size(), 5U);
  std::vector<FoldResult> known(all.folds.begin(), all.folds.begin() + 2);
  known[0].chosen = {"known"};
  const CrossFit more = cross_fit(folds_of(*design), *design, data, {}, candidates, {}, {}, known);
  ASSERT_EQ(more.folds.size(), all.folds.size());
  EXPECT_TRUE(more.complete);
  EXPECT_EQ(more.folds[0].chosen, known[0].chosen);
  for (std::size_t f = 2; f < all.folds.size(); ++f) EXPECT_EQ(more.folds[f].chosen, all.folds[f].chosen) << f;
  const std::vector<std::vector<std::string>> asked = {{"crosstalk"}};
  known.assign(all.folds.begin(), all.folds.begin() + 5);
  const CrossFit answered = cross_fit(folds_of(*design), *design, data, {}, candidates, {}, asked, known);
  EXPECT_EQ(answered.folds.size(), known.size()) << "none of them chose it";
  EXPECT_FALSE(answered.complete);
}

/// Folds in which nothing was searched miss the effect that is there; those that chose it support no worse one. What
/// they chose and predict stays the same bit by bit, because held-out conditions have contributed to the other set.
TEST_F(OutOfSample, AFoldSupportsWhatItMissed) {
  const Term truth = random_term(effect("wiggling"), 1, 4);
  const std::vector<Observations> data = data_with({truth}, 5);
  SearchOptions none;
  none.max_effects = 0;
  CrossFit searched = folds(data), unsearched = cross_fit(folds_of(*design), *design, data, {}, candidates, none);
  const CrossFit before = unsearched;
  const SearchOptions options;
  const auto compare = [&](CrossFit& result, const Term& term) {
    compare_folds(result.folds, *design, data, {}, candidates, options, {{term}, {}, {}});
  };
  compare(searched, random_term(effect("crosstalk"), 1, 4));
  EXPECT_EQ(searched.supporting_fraction({"crosstalk"}), 0);
  EXPECT_EQ(searched.supporting_fraction({"wiggling"}), 1);
  compare(unsearched, truth);
  EXPECT_EQ(unsearched.supporting_fraction({"wiggling"}), 1);
  for (std::size_t f = 0; f < before.folds.size(); ++f) {
    EXPECT_EQ(unsearched.folds[f].missed, std::vector<std::string>{"wiggling"});
    EXPECT_TRUE(unsearched.folds[f].chosen.empty());
    EXPECT_EQ(unsearched.folds[f].gap().after, before.folds[f].gap().after);
  }
}

/// The held-out gap, compared with that of new data of the same camera at the distances in between.
TEST_F(OutOfSample, TheGapIsThatOfNewData) {
  const Term truth = random_term(effect("wiggling"), 1, 6);
  const CrossFit result = folds(data_with({truth}, 7));
  EXPECT_EQ(result.supporting_fraction({"wiggling"}), 1);
  const CrossFit::Gap gap = result.gap(distance, "distance", 1);
  // The predicted effect is a sine of 5 mm; at these distances its mean square is near one half.
  EXPECT_NEAR(std::sqrt(gap.before * gap.before - gap.after * gap.after), 5e-3 / std::numbers::sqrt2, 5e-4);
  EXPECT_LT(gap.low, gap.after);
  EXPECT_GT(gap.high, gap.after);
  // Only jitter of 0.5 mm and pixel noise remain.
  double noise = 0, count = 0;
  for (std::size_t i = 0; i < design->size(); ++i) {
    for (std::size_t s = 0; s < design->superpixels(); ++s) {
      const double depth = 1 / design->shift(i)[s];
      noise += depth * depth * blank[i].variance[s] + 5e-4 * 5e-4;
      ++count;
    }
  }
  EXPECT_NEAR(gap.after, std::sqrt(noise / count), 0.25 * std::sqrt(noise / count));
  const HeldOutImprovement fall = held_out_improvement_of(result, {"wiggling"}, 1);
  EXPECT_GT(fall.low, 100);
  EXPECT_NEAR(fall.gap_with, result.gap(distance, "", 1).after, 1e-12);
}

TEST_F(OutOfSample, NothingIsChosenWhereNothingIsHidden) {
  const CrossFit result = folds(data_with({}, 9));
  for (const FoldResult& fold : result.folds) {
    EXPECT_TRUE(fold.failed.empty());
    EXPECT_TRUE(fold.chosen.empty()) << fold.fold.setting << " " << fold.fold.levels;
  }
}

/// Remaining effects are evaluated in folds that chose no others; if most folds chose others too, in all folds.
TEST(DepthOutOfFold, IsThatOfFoldsWithoutOthers) {
  const auto fold = [](std::vector<std::string> chosen, double before, double after) {
    FoldResult result;
    result.chosen = std::move(chosen);
    OutOfFold& one = result.conditions.emplace_back();
    one.before[distance] = 4 * before * before, one.after[distance] = 4 * after * after, one.count[distance] = 4;
    return result;
  };
  CrossFit result;
  result.folds = {fold({"a", "c"}, 2e-3, 9e-3), fold({"a"}, 3e-3, 1e-3), fold({}, 3e-3, 3e-3),
                  fold({"a", "b"}, 4e-3, 5e-3)};
  const std::vector<std::string> a = {"a"}, both = {"a", "b"};
  EXPECT_FALSE(result.gap_with_only(a).alone) << "one fold of three that chose it says too little";
  result.folds.insert(result.folds.begin(), fold({"a"}, 3e-3, 1e-3));
  EXPECT_TRUE(result.gap_with_only(a).alone);
  EXPECT_NEAR(result.gap_with_only(a).gap.before, 3e-3, 1e-12);
  EXPECT_NEAR(result.gap_with_only(a).gap.after, 1e-3, 1e-12);
  EXPECT_NEAR(result.gap_with_only(both).gap.after, std::sqrt(9.0) * 1e-3, 1e-12);
  // A fold that chose nothing gives no information about them.
  result.folds = {fold({"a", "c"}, 2e-3, 9e-3), fold({}, 2e-3, 2e-3), fold({"a", "b", "c"}, 4e-3, 5e-3)};
  EXPECT_FALSE(result.gap_with_only(both).alone);
  EXPECT_NEAR(result.gap_with_only(both).gap.before, std::sqrt(8.0) * 1e-3, 1e-12);
  EXPECT_NEAR(result.gap_with_only(both).gap.after, std::sqrt(110.0 / 3) * 1e-3, 1e-12);
}

/// Conditions at one distance may share an unmodelled error: the interval of the gap resamples them together.
TEST(GapOutOfFold, IsDrawnByClusters) {
  CrossFit result;
  FoldResult& fold = result.folds.emplace_back();
  for (std::size_t i = 0; i < 80; ++i) {
    OutOfFold& one = fold.conditions.emplace_back();
    one.condition = i;
    one.after[distance] = 1e-6 * static_cast<double>(1 + i % 8), one.count[distance] = 1;
    result.clusters.push_back(i % 8);
  }
  const CrossFit::Gap together = result.gap(distance, "", 1);
  for (std::size_t i = 0; i < 80; ++i) result.clusters[i] = i;
  const CrossFit::Gap single = result.gap(distance, "", 1);
  EXPECT_EQ(together.after, single.after);
  EXPECT_NEAR((together.high - together.low) / (single.high - single.low), std::sqrt(10), 0.3);
}

/// Reflectivities of a held-out target come from its amplitudes: boards at other positions do not change
/// them.
TEST_F(OutOfSample, ATargetThatWasPutAsideIsPredictedFromItsAmplitude) {
  const std::vector<Observations> data = data_with({random_term(effect("crosstalk"), 1, 3)}, 4);
  const CrossFit result = folds(data);
  for (const FoldResult& fold : result.folds) {
    if (fold.fold.setting != "target") continue;
    double sum = 0, count = 0;
    for (const OutOfFold& c : fold.conditions) sum += c.after[amplitude], count += c.count[amplitude];
    EXPECT_LT(std::sqrt(sum / count), 0.02) << "the light is that of the target";
  }
}

/// A condition held out by three folds is a single measurement: its interval is that of a single fold.
TEST(FallOutOfFold, CountsAConditionOnceAndWhatTheEffectStandsFor) {
  const auto fold = [](const std::string& chosen, std::size_t condition, double less, double with) {
    FoldResult result;
    result.chosen = {chosen};
    OutOfFold& one = result.conditions.emplace_back();
    one.condition = condition;
    one.without[chosen] = {less, 100, 0};
    one.chi_after = with;
    return result;
  };
  CrossFit result;
  // The first condition gains 90 in each of three folds, the second loses 60 once: drawn alone it refutes the effect.
  result.folds = {fold("a", 0, 100, 10), fold("a", 0, 100, 10), fold("b", 0, 100, 10), fold("a", 1, 40, 100)};
  const HeldOutImprovement own = held_out_improvement_of(result, {"a"}, 1),
                           both = held_out_improvement_of(result, {"a", "b"}, 1);
  EXPECT_EQ(own.without - own.with, 120);
  EXPECT_EQ(both.without - both.with, 210);
  EXPECT_EQ(both.low, -120) << "both draws are the second condition in a quarter of the cases";
  // An effect that no fold chose, or that no held-out condition can show, is not significant.
  EXPECT_FALSE(held_out_improvement_of(result, {"c"}, 1).is_significant());
  // A fold that failed counts as one that did not choose the effect.
  result.folds.emplace_back().failed = "no number";
  EXPECT_EQ(result.supporting_fraction({"a", "b"}), 0.8);
  // If a fold chose both, omitting either one gives a large error, which is not evidence for it.
  FoldResult twins = fold("a", 1, 1e6, 10);
  twins.chosen = {"a", "b"};
  twins.conditions[0].without["b"] = {1e6, 100, 0};
  result.folds.push_back(twins);
  const HeldOutImprovement beside = held_out_improvement_of(result, {"a", "b"}, 1);
  EXPECT_EQ(beside.without - beside.with, 210);
  EXPECT_EQ(beside.folds_choosing, 5U);
  EXPECT_EQ(beside.folds_alone, 4U);
  // A fold that missed an effect supports it, and predicts nothing with it.
  result.folds.back().chosen = {};
  result.folds.back().missed = {"a"};
  const HeldOutImprovement missed = held_out_improvement_of(result, {"a", "b"}, 1);
  EXPECT_EQ(missed.folds_supporting, 5U);
  EXPECT_EQ(missed.folds_choosing, 4U);
  EXPECT_EQ(missed.without - missed.with, 210);
}

/// In one fold the effect fails without another one: the median over the folds is reported.
TEST(FallOutOfFold, IsToldAsMostFoldsSayIt) {
  CrossFit result;
  for (const double taken_out : {5e-3, 0.8, 4e-3}) {
    FoldResult fold;
    fold.chosen = {"a"};
    OutOfFold& one = fold.conditions.emplace_back();
    one.condition = result.folds.size();
    one.count[distance] = 100;
    one.after[distance] = 100 * 1e-6;
    one.without["a"] = {.taken_out = 100 * taken_out * taken_out};
    result.folds.push_back(fold);
  }
  const HeldOutImprovement fall = held_out_improvement_of(result, {"a"}, 1);
  EXPECT_NEAR(fall.median_taken_out, 5e-3, 1e-12);
  EXPECT_NEAR(fall.median_with, 1e-3, 1e-12);
}

/// Four fifths, to the nearest whole fold. Of nine, two may do without: an effect that one board alone shows is missing
/// where the board's distance is held out and where its target is.
TEST(ChosenInFolds, AreFourFifthsToTheNearestFold) {
  const std::vector<std::size_t> folds = {2, 3, 4, 5, 8, 9, 10, 13}, expected = {2, 2, 3, 4, 6, 7, 8, 10};
  for (std::size_t n = 0; n < folds.size(); ++n) EXPECT_EQ(min_folds_supporting(folds[n]), expected[n]) << folds[n];
}

TEST(Stability, ARunThatAddsAnEffectAndItsTieCountsOnce) {
  const Stability halves{any_half, {{"a", "b"}, {"b"}, {"c"}, {}}, {}};
  EXPECT_EQ(halves.chosen_share(std::vector<std::string>{"a", "b"}), 0.5);
  EXPECT_EQ(halves.chosen_share(std::vector<std::string>{"a"}), 0.25);
  EXPECT_EQ(halves.chosen_share(std::vector<std::string>{"d"}), 0);
  EXPECT_EQ(halves.counts(), (std::map<std::string, std::size_t>{{"a", 1}, {"b", 2}, {"c", 1}}));
}

}  // namespace
}  // namespace tofgraph::diagnosis
