// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Campaigns of which the truth is known, for tests of the search: observations drawn from the forward model with noise,
// jitter and light of the tests' own.
#pragma once

#include "diagnosis/search/confidence.hpp"
#include "diagnosis/search/search.hpp"

#include <gtest/gtest.h>

#include "io/profile.hpp"

namespace tofgraph::diagnosis {

inline io::Condition condition(double distance, const std::string& target, double integration_time) {
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

  /// Data with these effects in them.
  std::vector<Observations> data_with(const std::vector<Term>& terms, std::uint64_t seed) const {
    const Problem problem = make_problem(*design, blank);
    const State state{terms,
                      std::vector<double>(problem.targets.size(), 0.1),
                      {.jitter = 5e-4,
                       .offset = 0,
                       .light = 2e-3,
                       .drift = 0,
                       .drift_light = 0,
                       .mean = 0,
                       .session = 0,
                       .session_light = 0}};
    return injected(problem, state, seed);
  }

  /// Searches data with these effects at their typical sizes for all but one.
  SearchResult search_for(const std::vector<std::string>& truth, const std::string& without, std::uint64_t seed) {
    std::vector<Term> terms;
    for (const std::string& name : truth) terms.push_back(random_term(effect(name), 1, seed));
    const std::vector<Observations> data = data_with(terms, seed + 1);
    std::erase_if(candidates, [&](const auto& c) { return c->name() == without; });
    SearchOptions options;
    options.seed = seed;
    return search(make_problem(*design, data), {}, candidates, options);
  }

  static std::vector<std::string> names(const SearchResult& result) {
    std::vector<std::string> all;
    for (const EffectFinding& found : result.found) all.push_back(found.candidate->name());
    std::ranges::sort(all);
    return all;
  }

  std::vector<io::Condition> conditions;
  std::unique_ptr<Design> design;
  std::vector<Observations> blank;
  std::vector<std::unique_ptr<Candidate>> candidates;
};

}  // namespace tofgraph::diagnosis
