// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// hidden_effects_expected: pairs of effects in noise-free campaigns: determines if the selected set is the hidden one,
// and if not, whether the hidden one would have explained more.
#include "diagnosis/data/ingest.hpp"
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/selection.hpp"
#include "tests/hidden_effects/candidates.hpp"
#include "tests/hidden_effects/effects.hpp"
#include "tests/hidden_effects/score_cases.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <random>

namespace {

using namespace tofgraph;
using namespace tofgraph::diagnosis;

struct Asked {
  std::string design = "B";
  std::vector<std::string> effects;  ///< a pair
  double size = 1;
  std::uint64_t seed = 1;
  std::size_t first = 0, from = 0, every = 1;
  std::filesystem::path scratch = std::filesystem::temp_directory_path() / "hidden_effects_expected";
};

enum class Outcome { best, as_good, not_shown, better, missed, failed };

constexpr std::array<std::pair<const char*, const char*>, 6> outcomes = {{
    {"best", "the hidden pair is what is selected"},
    {"as_good", "another set, which explains as much (within 10 of deviance or BIC)"},
    {"not_shown", "one of the pair or none: what is missing would not lower BIC by 10"},
    {"better", "another set, which explains more than the hidden pair"},
    {"missed", "another set, and the hidden pair explains more"},
    {"failed", "another set; of the hidden pair there is no fit, as it has a map or gives no number"},
}};

using Names = std::vector<std::string>;

/// All pairs in a random order, so that any number of the first is a fair sample.
std::vector<Names> all_pairs(std::uint64_t seed) {
  Names names;
  for (const hidden::Effect& effect : hidden::catalogue())
    if (!hidden::is_hidden_from_boards(effect.name)) names.push_back(effect.name);
  std::vector<Names> pairs;
  for (std::size_t a = 0; a < names.size(); ++a)
    for (std::size_t b = a + 1; b < names.size(); ++b) pairs.push_back({names[a], names[b]});
  std::ranges::shuffle(pairs, std::mt19937_64(seed));
  return pairs;
}

/// Hidden effects with their true values; nullopt if one has a map.
std::optional<std::vector<Term>> terms_of(const hidden::Effects& effects, const Candidates& candidates) {
  std::vector<Term> terms;
  for (const auto& [name, values] : effects.all()) {
    const auto found = std::ranges::find(candidates, name, [](const auto& candidate) { return candidate->name(); });
    if (found == candidates.end() || !(*found)->maps().empty()) return std::nullopt;
    const Candidate* one = found->get();
    for (std::size_t r = 0; r < (*found)->refinements().size(); ++r) {
      const FreeParameter& size = (*found)->refinements()[r].parameters.front();
      if (values.contains(size.name) && values.at(size.name) != size.off) one = &one->with(r);
    }
    Term term{one, one->start()};
    for (std::size_t k = 0; k < term.values.size(); ++k)
      if (const auto at = values.find(one->free()[k].name); at != values.end()) term.values[k] = at->second;
    terms.push_back(std::move(term));
  }
  return terms;
}

struct Result {
  Outcome outcome = Outcome::failed;
  Names selected;
  double behind = NAN;  ///< deviance of the selected set minus that of the hidden pair
};

Result select(const Problem& problem, const hidden::Effects& effects, const Candidates& candidates) {
  const SearchOptions options;
  const std::vector<Term> none;
  Selection selection(problem, none, candidates, options, {});
  selection.begin();
  selection.forward_select();
  selection.refit();
  Result result;
  Names hidden;
  for (const auto& [name, values] : effects.all()) hidden.push_back(name);
  for (const Term& term : selection.terms()) result.selected.push_back(term.candidate->name());
  std::ranges::sort(result.selected);
  if (result.selected == hidden) {
    result.outcome = Outcome::best;
    return result;
  }
  const std::optional<std::vector<Term>> truth = terms_of(effects, candidates);
  if (!truth) return result;
  State state = selection.refitted_given().state;
  state.random_sd = selection.best().state.random_sd;
  state.terms = *truth;
  const ModelFit fit = selection.fit_at_every_pixel(state);
  result.behind = selection.best().deviance - fit.deviance;
  const double bic = selection.bic(selection.best()) - selection.bic(fit);
  const bool part = std::ranges::includes(hidden, result.selected);
  constexpr double tie = 10;
  result.outcome = part && bic < settings.min_bic_gain   ? Outcome::not_shown
                   : std::min(result.behind, bic) > tie  ? Outcome::missed
                   : std::max(result.behind, bic) < -tie ? Outcome::better
                                                         : Outcome::as_good;
  return result;
}

Result try_pair(const Asked& asked, const Names& pair, std::uint64_t seed, const Candidates& candidates) {
  hidden::CampaignOptions options;
  options.design = asked.design;
  for (const std::string& name : pair) options.effects.add_typical(name, asked.size, seed);
  options.noise = hidden::NoiseKind::none;
  options.jitter = options.light_jitter = 0;
  options.frames = 1;
  options.seed = seed;
  options.folder = asked.scratch / fmt::format("{}_{}", asked.design, seed);
  std::filesystem::remove_all(options.folder);
  make_campaign(options);
  config::Diagnostics diagnostics;
  const io::Campaign campaign = io::read_campaign(options.folder / "campaign.yaml", diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  const Measurements measurements = measure(campaign, {});
  std::filesystem::remove_all(options.folder);
  try {
    return select(make_problem(*measurements.design, measurements.observations), options.effects, candidates);
  } catch (const simulation::EffectError&) {
    return {};
  }
}

void run(const Asked& asked) {
  const auto candidates = hidden::candidates_but("");
  const std::vector<Names> pairs = asked.effects.empty() ? all_pairs(asked.seed) : std::vector<Names>{asked.effects};
  std::array<int, outcomes.size()> counts{};
  std::size_t tried = 0;
  fmt::print("design,pair,outcome,selected,deviance_behind,seconds\n");
  for (std::size_t i = asked.from; i < pairs.size() && (asked.first == 0 || tried < asked.first); i += asked.every) {
    ++tried;
    const auto begun = std::chrono::steady_clock::now();
    const Result result = try_pair(asked, pairs[i], asked.seed + i, candidates);
    ++counts.at(static_cast<std::size_t>(result.outcome));
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begun;
    fmt::print("{},{},{},{},{:.1f},{:.1f}\n", asked.design, fmt::join(pairs[i], "+"),
               outcomes.at(static_cast<std::size_t>(result.outcome)).first, fmt::join(result.selected, "+"),
               result.behind, took.count());
    std::fflush(stdout);
  }
  fmt::print("\n| pairs | outcome |\n| --- | --- |\n");
  for (std::size_t o = 0; o < outcomes.size(); ++o)
    fmt::print("| {} of {} | {} |\n", counts.at(o), tried, outcomes.at(o).second);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Hides pairs of effects in campaigns without noise, and compares the set that is selected with them."};
  Asked asked;
  app.add_option("EFFECT", asked.effects, "this pair only")->expected(2);
  app.add_option("--design", asked.design, "small, A, B or C")->capture_default_str();
  app.add_option("--size", asked.size, "as a factor on the typical one")->capture_default_str();
  app.add_option("--seed", asked.seed, "of the order of the pairs and of their values")->capture_default_str();
  app.add_option("--first", asked.first, "so many pairs; default: all");
  app.add_option("--from", asked.from, "leaves out so many pairs")->capture_default_str();
  app.add_option("--every", asked.every, "only each n-th pair")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--scratch", asked.scratch, "a folder for the campaigns")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    run(asked);
  } catch (const std::exception& failure) {
    fmt::print(stderr, "hidden_effects_expected: {}\n", failure.what());
    return 1;
  }
  return 0;
}
