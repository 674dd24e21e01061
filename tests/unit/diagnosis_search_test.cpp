// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// What the search names and what it does not, on campaigns of which the truth is known: observations drawn from the
// forward model with noise, jitter and light of this test's own. The search by another camera: tests/hidden_effects.
#include "diagnosis/injection.hpp"
#include "diagnosis/search.hpp"

#include <gtest/gtest.h>

#include "io/profile.hpp"

namespace tofgraph::diagnosis {
namespace {

io::Condition condition(double distance, const std::string& target, double integration_time) {
  io::Condition c;
  c.id = target + std::to_string(distance) + std::to_string(integration_time);
  c.board_distance = distance;
  c.board_tilt_x = c.board_tilt_y = 0;
  c.target = target;
  c.integration_time = integration_time;
  c.time_since_power_on = 3600;
  c.temperature = 25;
  return c;
}

/// A rail to 4.5 m with two targets and two integration times; noise as from some hundred pixels and four frames.
class Rail : public testing::Test {
 protected:
  void SetUp() override {
    for (int stop = 0; stop < 10; ++stop) {
      for (const double time : {1e-3, 4e-3})
        conditions.push_back(condition(0.6 + 0.43 * stop, stop % 2 == 0 ? "white" : "grey", time));
    }
    measure();
  }

  void measure() {
    blank.clear();
    design = std::make_unique<Design>(io::load_profile(io::find_profile("camcube2", {})), true, conditions);
    for (std::size_t i = 0; i < design->size(); ++i) {
      Observations o{std::vector<double>(design->rows(), 0), {}};
      const double amplitude = std::abs(design->ideal(i)[0].phasor), relative = 2 / amplitude;
      const std::array<double, observables> sd = {1.193 * relative / 20, relative / 20, relative / 30, relative / 40,
                                                  relative / 40};
      for (std::size_t k = 0; k < observables; ++k)
        o.variance.insert(o.variance.end(), design->superpixels(), sd[k] * sd[k]);
      blank.push_back(std::move(o));
    }
    candidates.clear();
    const graph::PluginRegistry catalogue(graph::plugin_path({}));
    for (const graph::PluginFile& file : catalogue.files()) {
      if (file.kind == "effect") candidates.push_back(std::make_unique<Candidate>(catalogue.load(file)));
    }
  }

  const Candidate& effect(const std::string& name) const {
    return **std::ranges::find_if(candidates, [&](const auto& c) { return c->name() == name; });
  }

  /// Searches data with these effects at their typical sizes for all but one.
  SearchResult search_for(const std::vector<std::string>& truth, const std::string& without, std::uint64_t seed) {
    const Problem problem = make_problem(*design, blank);
    State state{{}, std::vector<double>(problem.targets.size(), 0.1), {.jitter = 5e-4, .offset = 0, .light = 2e-3}};
    for (const std::string& name : truth) state.terms.push_back(random_term(effect(name), 1, seed));
    const std::vector<Observations> data = injected(problem, state, seed + 1);
    std::erase_if(candidates, [&](const auto& c) { return c->name() == without; });
    SearchOptions options;
    options.seed = seed;
    return search(make_problem(*design, data), {}, candidates, options);
  }

  static std::vector<std::string> names(const SearchResult& result) {
    std::vector<std::string> all;
    for (const Found& found : result.found) all.push_back(found.candidate->name());
    std::ranges::sort(all);
    return all;
  }

  std::vector<io::Condition> conditions;
  std::unique_ptr<Design> design;
  std::vector<Observations> blank;
  std::vector<std::unique_ptr<Candidate>> candidates;
};

TEST_F(Rail, NothingIsNamedWhereNothingIsHidden) {
  const SearchResult result = search_for({}, "", 3);
  EXPECT_TRUE(result.found.empty());
  EXPECT_TRUE(result.rest.empty());
  EXPECT_EQ(result.patterns_without_axis(), 0u);
}

TEST_F(Rail, TwoEffectsAreNamed) {
  EXPECT_EQ(names(search_for({"wiggling", "tap_mismatch"}, "", 4)),
            (std::vector<std::string>{"tap_mismatch", "wiggling"}));
}

TEST_F(Rail, AnEffectThatIsNoCandidateIsNotReplacedByOthers) {
  // A harmonic of four periods in distance and amplitude; several candidates explain a part of it.
  const SearchResult result = search_for({"wiggling"}, "wiggling", 5);
  EXPECT_EQ(names(result), std::vector<std::string>{});
  ASSERT_FALSE(result.rest.empty());
  EXPECT_EQ(result.rest.front().axis, "period 1.87 m");
}

TEST_F(Rail, TheSameSeedGivesTheSameResult) {
  const SearchResult first = search_for({"wiggling"}, "", 6), second = search_for({"wiggling"}, "", 6);
  ASSERT_EQ(names(first), names(second));
  EXPECT_EQ(first.after.deviance, second.after.deviance);
  EXPECT_EQ(first.after.state.terms[0].values, second.after.state.terms[0].values);
  EXPECT_EQ(first.found[0].held_out.low, second.found[0].held_out.low);
}

/// A camera whose distances wander by 3 mm while the rail is measured, in an order that nothing else follows.
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

/// Four conditions: fewer than a wave over the order needs.
TEST_F(Rail, FewConditionsWithAnOrderAreSearched) {
  conditions.resize(4);
  for (std::size_t i = 0; i < conditions.size(); ++i) conditions[i].order = i;
  measure();
  const SearchResult result = search_for({"crosstalk"}, "", 9);
  ASSERT_EQ(names(result), std::vector<std::string>{"crosstalk"});
  // As great as it was hidden, and nothing is left of the gap.
  const std::vector<double> hidden = random_term(effect("crosstalk"), 1, 9).values;
  const std::vector<double>& seen = result.after.state.terms[0].values;
  ASSERT_EQ(seen.size(), hidden.size());
  for (std::size_t i = 0; i < hidden.size(); ++i) EXPECT_NEAR(seen[i], hidden[i], 0.01 * std::abs(hidden[i]));
  EXPECT_TRUE(result.rest.empty());
  EXPECT_EQ(result.patterns_without_axis(), 0U);
  EXPECT_NEAR(result.lack_of_fit, 1, 4 * std::sqrt(2 / result.freedom));
  // The order is one of the axes that the gap was seen along.
  EXPECT_TRUE(std::ranges::any_of(result.where, [](const Pattern& p) { return p.axis == "order measured"; }));
}

}  // namespace
}  // namespace tofgraph::diagnosis
