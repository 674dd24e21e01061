// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: SearchInTime.*:FoldAgreement.AllFolds*
// Rooms: diagnosis
// A written model is compared with the given one on all data and on held-out data; a set on which folds agree is found;
// a search that runs out of time returns the given model unchanged.
#include "diagnosis/search/given_model.hpp"

#include "diagnosis/search/crossfit.hpp"
#include "diagnosis/search/findings.hpp"
#include "diagnosis/search/selection.hpp"
#include "tests/unit/rail.hpp"

#include <chrono>
#include <set>
#include <thread>

namespace tofgraph::diagnosis {
namespace {

class NotWorse : public Rail {
 protected:
  Term zero_offset(double metres) const { return {&effect("zero_offset"), {metres}}; }
  Verification compared(const std::vector<Observations>& data, const std::vector<Term>& given,
                        const std::vector<Term>& model) const {
    const Problem problem = make_problem(*design, data);
    return compared_with_given({}, problem, given,
                               {model, std::vector<double>(problem.targets.size(), 0.1), {.offset = 0}});
  }
};

TEST_F(NotWorse, TheRightEffectPredictsBetterOnAllDataAndHeldOut) {
  const Verification seen = compared(data_with({zero_offset(0.02)}, 3), {}, {zero_offset(0.02)});
  EXPECT_EQ(seen.why_worse(), "");
  EXPECT_NEAR(seen.all.given, 0.02, 1e-3);
  EXPECT_LT(seen.all.model, 2e-3);
  EXPECT_NEAR(seen.held_out.given, 0.02, 1e-3);
  EXPECT_LT(seen.held_out.model, 2e-3);
}

TEST_F(NotWorse, AWrongValueIsWorseOnAllData) {
  const Verification seen = compared(data_with({}, 3), {}, {zero_offset(0.03)});
  EXPECT_NEAR(seen.all.model, 0.03, 1e-3);
  EXPECT_NE(seen.why_worse().find("on all data"), std::string::npos) << seen.why_worse();
  EXPECT_NE(seen.why_worse().find("mm of the given model to "), std::string::npos) << seen.why_worse();
}

/// On held-out data the effects of the model are refitted: overfitting to all data is exposed there.
TEST_F(NotWorse, HeldOutTheEffectsAreFittedWithoutWhatIsPutAside) {
  const std::vector<Observations> data = data_with({zero_offset(0.02)}, 4);
  const Problem problem = make_problem(*design, data);
  const State off{{zero_offset(0.05)}, std::vector<double>(problem.targets.size(), 0), {.offset = 0}};
  const GapComparison aside = on_held_out_data(folds_of(*design), {}, problem, {}, off);
  EXPECT_LT(aside.model, 2e-3) << "the start is 30 mm off, the fit is not";
  const GapComparison refitted = on_held_out_data(folds_of(*design), {}, problem, {zero_offset(0.02)}, off);
  EXPECT_LT(refitted.given, 2e-3);
}

TEST(GapComparison, NothingKnownIsNotWorse) {
  EXPECT_FALSE((GapComparison{NAN, NAN}).is_worse());
  EXPECT_FALSE((GapComparison{1e-3, 1.01e-3}).is_worse());
  EXPECT_TRUE((GapComparison{1e-3, 1.1e-3}).is_worse());
  EXPECT_TRUE((GapComparison{38.6e-3, 64e-3}).is_worse());
}

/// Also with a drift whose mean could compensate a wrong constant.
TEST_F(NotWorse, TheGivenValuesComeBackAsTheyWere) {
  const std::vector<Observations> data = data_with({zero_offset(0.02)}, 5);
  const Problem problem = make_problem(*design, data);
  const std::vector<Term> given = {zero_offset(0.05)};
  const SearchOptions options;
  Selection selection(problem, given, candidates, options, {});
  selection.begin();
  EXPECT_NEAR(selection.best().state.terms[0].values[0], 0.02, 1e-3) << "fitted before";
  selection.return_to_given();
  EXPECT_EQ(selection.best().state.terms[0].values, given[0].values);
}

class FoldAgreement : public NotWorse {
 protected:
  FoldResult fold(const std::vector<std::string>& names) const {
    FoldResult result;
    result.chosen = names;
    for (const std::string& name : names) result.state.terms.push_back(random_term(effect(name), 1, 1));
    return result;
  }
  static std::vector<std::string> names_of(const State& state) {
    std::vector<std::string> names;
    for (const Term& term : state.terms) names.push_back(term.candidate->name());
    return names;
  }
};

TEST_F(FoldAgreement, TheSetOfMostFoldsComesFirst) {
  CrossFit folds;
  for (int k = 0; k < 3; ++k) folds.folds.push_back(fold({"wiggling", "crosstalk"}));
  folds.folds.push_back(fold({"wiggling", "zero_offset", "crosstalk"}));
  folds.folds.push_back(fold({"wiggling"}));
  const State model{{random_term(effect("wiggling"), 1, 1)}, {}, {}};
  const std::vector<State> agreed = models_with_agreed_effects(folds, model, 0);
  ASSERT_EQ(agreed.size(), 2U);
  EXPECT_EQ(names_of(agreed[0]), (std::vector<std::string>{"wiggling", "crosstalk"}));
  EXPECT_EQ(names_of(agreed[1]), (std::vector<std::string>{"wiggling", "zero_offset", "crosstalk"}));
}

TEST_F(FoldAgreement, NothingWhereTheModelHasWhatMostFoldsChose) {
  CrossFit folds;
  for (int k = 0; k < 3; ++k) folds.folds.push_back(fold({"wiggling"}));
  for (int k = 0; k < 2; ++k) folds.folds.push_back(fold({"wiggling", "crosstalk"}));
  EXPECT_TRUE(models_with_agreed_effects(folds, {{random_term(effect("wiggling"), 1, 1)}, {}, {}}, 0).empty());
  folds.folds.resize(2);
  EXPECT_TRUE(models_with_agreed_effects(folds, {}, 0).empty()) << "two folds are no majority";
}

/// A constant and an offset with the integration time are hidden; all data have led to a warm-up of a camera that was
/// always warm, whose time exponent explains nearly as much as they do: no single effect does so in its place.
TEST_F(FoldAgreement, AllFoldsAreSearchedWhereTheFirstAgreeOnMore) {
  for (std::size_t i = 0; i < 20; i += 2) {
    io::Condition longest = conditions[i];
    longest.integration_time = 16e-3;
    longest.id += "long";
    conditions.push_back(longest);
  }
  measure();
  const std::set<std::string> kept = {"zero_offset", "integration_time_offset", "warm_up"};
  std::erase_if(candidates, [&](const auto& c) { return !kept.contains(c->name()); });
  const Candidate& warm_up = effect("warm_up");
  const std::vector<Observations> data =
      data_with({zero_offset(8e-3), {&effect("integration_time_offset"), {3e-3, 0}}}, 5);
  const std::vector<Term> given;
  const SearchOptions options;
  Findings findings(make_problem(*design, data), given, candidates, options, {});
  Selection& selection = findings.selection;
  selection.begin();
  selection.linearise_candidates();
  findings.trials.prepare(selection.best().state, {});
  State wrong = selection.best().state;
  const auto exponent = std::ranges::find(warm_up.refinements(), "exponent", &Refinement::name);
  wrong.terms.push_back(refined({&warm_up, {10e-3, 720, 0}},
                                static_cast<std::size_t>(exponent - warm_up.refinements().begin()),
                                std::vector<double>{0.2}));
  ASSERT_TRUE(selection.try_accept(wrong));
  findings.result.found = {{.candidate = selection.terms()[0].candidate, .name = "warm_up"}};
  EffectTests tests(findings);
  tests.cross_fit();
  EXPECT_TRUE(findings.result.cross_fit.complete);
  EXPECT_TRUE(tests.follow_folds());
  const std::vector<std::string> names = names_of(findings.best().state);
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()),
            (std::set<std::string>{"integration_time_offset", "zero_offset"}));
}

using SearchInTime = NotWorse;

TEST_F(SearchInTime, ASearchWithoutTimeGivesTheModelBack) {
  const std::vector<Observations> data = data_with({random_term(effect("wiggling"), 1, 4)}, 5);
  const std::vector<Term> given = {zero_offset(0.001)};
  const std::set<std::string> kept = {"wiggling", "crosstalk", "zero_offset"};  // the last one is the given model's
  std::erase_if(candidates, [&](const auto& c) { return !kept.contains(c->name()); });
  SearchOptions options;
  options.deadline = options.verification = Deadline(Deadline::Clock::now());
  const SearchResult result = search(make_problem(*design, data), given, candidates, options);
  EXPECT_TRUE(result.time_expired);
  EXPECT_TRUE(result.is_given);
  EXPECT_TRUE(result.found.empty());
  ASSERT_EQ(result.after.state.terms.size(), 1U);
  EXPECT_EQ(result.after.state.terms[0].values, std::vector<double>{0.001}) << "not refitted";
}

/// A selection made at the time limit is verified and written, whether before or after the gates.
TEST_F(SearchInTime, WhatWasSelectedWhenTimeEndsIsWritten) {
  using namespace std::chrono_literals;
  const std::vector<Observations> data = data_with({random_term(effect("wiggling"), 1, 4)}, 5);
  std::erase_if(candidates, [](const auto& c) { return c->name() != "wiggling" && c->name() != "crosstalk"; });
  for (const std::string step : {"checking", "predicting held-out conditions"}) {
    const auto end = Deadline::Clock::now() + 4s;
    SearchOptions options;
    options.deadline = Deadline(end);
    options.progress = [&](const std::string& what) {
      if (what.starts_with(step)) std::this_thread::sleep_until(end);
    };
    const SearchResult result = search(make_problem(*design, data), {}, candidates, options);
    EXPECT_TRUE(result.time_expired) << step;
    EXPECT_FALSE(result.is_given) << step;
    EXPECT_EQ(names(result), std::vector<std::string>{"wiggling"}) << step;
    EXPECT_TRUE(result.cross_fit.empty()) << step;
    EXPECT_LT(result.verified.held_out.model, 0.5 * result.verified.held_out.given) << step;
  }
}

/// Integration times and distances distinguish the two here, so the rival does not stand for the effect.
TEST_F(SearchInTime, FoldsThatChoseAWorseRivalRefuteAnEffectWhenTimeEnds) {
  const std::vector<Observations> data = data_with({random_term(effect("crosstalk"), 1, 4)}, 5);
  std::erase_if(candidates, [](const auto& c) { return c->name() != "static_reflection" && c->name() != "crosstalk"; });
  const std::vector<Term> given;
  const SearchOptions options;
  const Problem problem = make_problem(*design, data);
  Findings findings(problem, given, candidates, options, {});
  findings.selection.begin();
  findings.selection.linearise_candidates();
  findings.selection.forward_select();
  EffectTests tests(findings);
  tests.run();
  tests.cross_fit();
  ASSERT_EQ(findings.result.found.size(), 1U);
  const std::string found = findings.result.found[0].name;
  const std::string rival = found == "crosstalk" ? "static_reflection" : "crosstalk";
  std::vector<FoldResult>& folds = findings.result.cross_fit.folds;
  ASSERT_GE(folds.size(), 5U);
  for (std::size_t f = 0; f < folds.size() / 2; ++f) {
    folds[f].chosen = {rival};
    for (OutOfFold& c : folds[f].conditions) {
      auto less = c.without.extract(found);
      ASSERT_FALSE(less.empty());
      less.key() = rival;
      c.without.insert(std::move(less));
    }
  }
  findings.result.time_expired = true;
  EXPECT_TRUE(tests.drop_unconfirmed());
  EXPECT_TRUE(findings.result.found.empty());
  ASSERT_EQ(findings.result.dropped.size(), 1U);
  EXPECT_EQ(findings.result.dropped[0].refutation, "57 % of the folds support it");
  ASSERT_EQ(findings.result.dropped[0].rivals.size(), 1U) << "compared with what the folds chose";
  EXPECT_EQ(findings.result.dropped[0].rivals[0].candidate->name(), rival);
}

TEST_F(SearchInTime, ASearchThatHasTimeIsNotTouched) {
  const std::vector<Observations> data = data_with({random_term(effect("wiggling"), 1, 4)}, 5);
  std::erase_if(candidates, [](const auto& c) { return c->name() != "wiggling" && c->name() != "crosstalk"; });
  SearchOptions options;
  const TimeLimit hour{3600};
  options.deadline = hour.at(0.5);
  options.verification = hour.at(0.9);
  const SearchResult result = search(make_problem(*design, data), {}, candidates, options);
  EXPECT_FALSE(result.time_expired);
  EXPECT_EQ(names(result), std::vector<std::string>{"wiggling"});
  EXPECT_EQ(result.verified.why_worse(), "");
  EXPECT_LT(result.verified.held_out.model, 0.5 * result.verified.held_out.given);
}

}  // namespace
}  // namespace tofgraph::diagnosis
