// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Rail.TwoEffects*:Rail.AnEffectThat*:Rail.RefinementsAreVaried*:Rail.ACameraThat*
// Rooms: diagnosis simulation plugins
// Effects that the search names, on campaigns with known truth: observations drawn from the forward model with noise,
// jitter and light of this test's own. The search on another camera: tests/hidden_effects.
#include "diagnosis/search/search.hpp"
#include "tests/unit/rail.hpp"

#include <map>
#include <set>

namespace tofgraph::diagnosis {
namespace {

TEST_F(Rail, NothingIsNamedWhereNothingIsHidden) {
  const SearchResult result = search_for({}, "", 3);
  EXPECT_TRUE(result.found.empty());
  EXPECT_TRUE(result.rest.empty());
  EXPECT_EQ(result.patterns_without_axis(), 0u);
}

TEST_F(Rail, TwoEffectsAreNamedAndTheSameSeedGivesTheSameResult) {
  const SearchResult first = search_for({"wiggling", "tap_mismatch"}, "", 4);
  EXPECT_EQ(names(first), (std::vector<std::string>{"tap_mismatch", "wiggling"}));
  const SearchResult second = search_for({"wiggling", "tap_mismatch"}, "", 4);
  ASSERT_EQ(names(first), names(second));
  EXPECT_EQ(first.after.deviance, second.after.deviance);
  for (std::size_t t = 0; t < first.found.size(); ++t) {
    EXPECT_EQ(first.after.state.terms[t].values, second.after.state.terms[t].values);
    EXPECT_EQ(first.found[t].improvement.low, second.found[t].improvement.low);
  }
}

/// On this rail the camera was always warm, a frame has one frequency, and the lens is never capped.
TEST_F(Rail, EffectsThatRepeatSimplerOnesAreNotTriedBesideThem) {
  const Problem problem = make_problem(*design, blank);
  std::map<std::string, std::string> refused;
  const State state{{}, std::vector<double>(problem.targets.size(), 0.1), {}};
  std::set<std::string> repeated;
  for (const Candidate* one : alternatives_of(problem, state, candidates, refused).repeated)
    repeated.insert(one->name());
  EXPECT_TRUE(repeated.contains("static_reflection")) << "a crosstalk";
  EXPECT_TRUE(repeated.contains("warm_up")) << "a constant";
  for (const char* other : {"crosstalk", "zero_offset", "wiggling", "integration_time_offset", "beam_profile"})
    EXPECT_FALSE(repeated.contains(other)) << other;
}

TEST_F(Rail, AnEffectThatIsNoCandidateIsNotReplacedByOthers) {
  // A harmonic of four periods in distance and amplitude; several candidates explain part of it.
  const SearchResult result = search_for({"wiggling"}, "wiggling", 5);
  EXPECT_EQ(names(result), std::vector<std::string>{});
  ASSERT_FALSE(result.rest.empty());
  EXPECT_EQ(result.rest.front().axis, "period 1.87 m");
  // A refuted effect is not built up and refuted again: nothing is ranked after the held-out test.
  const auto is = [](const std::string& what) { return [what](const Step& step) { return step.what == what; }; };
  const auto proved = std::ranges::find_if(result.trace, is("proved"));
  ASSERT_NE(proved, result.trace.end());
  EXPECT_TRUE(std::none_of(proved, result.trace.end(), is("ranked")));
}

/// A wiggle with a fifth harmonic: refinements are varied where the data require it, and fixed otherwise.
TEST_F(Rail, RefinementsAreVariedWhereTheDataDemandThem) {
  const Candidate& wiggling = effect("wiggling");
  ASSERT_EQ(wiggling.refinements().size(), 2U);
  const std::vector<double> plain = {5e-3, 0.4}, fifth = {2e-3, -1.2};
  const auto searched = [&](const Term& truth) {
    const std::vector<Observations> data = data_with({truth}, 12);
    return search(make_problem(*design, data), {}, candidates, {});
  };
  const SearchResult simple = searched({&wiggling, plain});
  ASSERT_EQ(names(simple), std::vector<std::string>{"wiggling"});
  EXPECT_EQ(simple.after.state.terms[0].candidate, &wiggling);
  EXPECT_TRUE(simple.refinements.empty());

  const SearchResult found = searched(refined({&wiggling, plain}, 0, fifth));
  ASSERT_EQ(names(found), std::vector<std::string>{"wiggling"});
  const Term& term = found.after.state.terms[0];
  EXPECT_EQ(term.candidate, &wiggling.with(0));
  ASSERT_EQ(found.refinements.size(), 1U);
  EXPECT_EQ(found.refinements[0].name, "wiggling.amplitude5");
  const std::vector<double> truth = {5e-3, 0.4, 2e-3, -1.2}, near = {1e-4, 0.02, 1e-4, 0.05};
  ASSERT_EQ(term.values.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) EXPECT_NEAR(term.values[i], truth[i], near[i]) << i;
  EXPECT_FALSE(found.something_left());
}

/// A camera whose distances drift by 3 mm during the rail measurement, in an order that no other setting follows.
TEST_F(Rail, ACameraThatWandersLacksNoEffect) {
  const auto place = [](std::size_t i) { return static_cast<double>(7 * i % 20) / 19; };
  const auto found = [&] {
    const Problem problem = make_problem(*design, blank);
    const State state{
        {}, std::vector<double>(problem.targets.size(), 0.1), {.jitter = 1e-4, .offset = 0, .light = 2e-3}};
    std::vector<Observations> data = injected(problem, state, 8);
    for (std::size_t i = 0; i < data.size(); ++i) {
      for (std::size_t s = 0; s < design->superpixels(); ++s)
        data[i].value[distance * design->superpixels() + s] += 3e-3 * std::cos(1.2 * place(i));
    }
    return search(make_problem(*design, data), {}, candidates, {}).found.size();
  };
  EXPECT_GT(found(), 0u) << "where nobody says in which order, it looks like an offset";
  for (std::size_t i = 0; i < conditions.size(); ++i) conditions[i].order = 1000 + 7 * i % 20;
  measure();
  EXPECT_EQ(found(), 0u);
}

/// A constant offset is not drift.
TEST_F(Rail, ACameraThatIsOffAllTheTimeHasAnOffset) {
  for (std::size_t i = 0; i < conditions.size(); ++i) conditions[i].order = 1000 + 7 * i % 20;
  measure();
  std::vector<Observations> data = data_with({}, 8);
  for (Observations& one : data) {
    for (std::size_t s = 0; s < design->superpixels(); ++s) one.value[distance * design->superpixels() + s] += 9e-3;
  }
  const SearchResult result = search(make_problem(*design, data), {}, candidates, {});
  ASSERT_EQ(result.found.size(), 1U);
  const std::vector<std::string> named = result.found[0].names();
  EXPECT_NE(std::ranges::find(named, "zero_offset"), named.end());
  EXPECT_FALSE(result.something_left());
}

/// Four conditions: fewer than a wave over the order requires.
TEST_F(Rail, FewConditionsWithAnOrderAreSearched) {
  conditions.resize(4);
  for (std::size_t i = 0; i < conditions.size(); ++i) conditions[i].order = i;
  measure();
  const SearchResult result = search_for({"crosstalk"}, "", 9);
  ASSERT_EQ(names(result), std::vector<std::string>{"crosstalk"});
  // As large as the simulated one, and no gap remains.
  const std::vector<double> hidden = random_term(effect("crosstalk"), 1, 9).values;
  const std::vector<double>& seen = result.after.state.terms[0].values;
  ASSERT_EQ(seen.size(), hidden.size());
  for (std::size_t i = 0; i < hidden.size(); ++i) EXPECT_NEAR(seen[i], hidden[i], 0.01 * std::abs(hidden[i]));
  EXPECT_TRUE(result.rest.empty());
  EXPECT_EQ(result.patterns_without_axis(), 0U);
  EXPECT_NEAR(result.lack_of_fit, 1, 4 * std::sqrt(2 / result.freedom));
  // The order is one of the axes along which the gap was found.
  EXPECT_TRUE(std::ranges::any_of(result.where, [](const Pattern& p) { return p.axis == "order measured"; }));
}

}  // namespace
}  // namespace tofgraph::diagnosis
