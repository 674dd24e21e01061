// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/score_cases.hpp"

#include "tests/hidden_effects/effects.hpp"
#include "tests/hidden_effects/patterns.hpp"
#include "tests/hidden_effects/truth.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <random>
#include <stdexcept>

namespace tofgraph::hidden {
namespace {

constexpr std::array noises = {NoiseKind::gaussian, NoiseKind::heavy, NoiseKind::drift};

std::vector<std::string> effects_that_show() {
  std::vector<std::string> names;
  for (const Effect& effect : catalogue()) {
    if (!is_hidden_from_boards(effect.name)) names.push_back(effect.name);
  }
  return names;
}

/// Each effect alone, in designs B and C, at half, once and twice its typical size.
std::vector<Case> single(std::uint64_t seed, std::size_t draws) {
  std::vector<Case> cases;
  for (std::size_t draw = 0; draw < draws; ++draw) {
    for (const char* design : {"C", "B"}) {
      for (const double size : {1.0, 0.5, 2.0}) {
        for (const std::string& effect : effects_that_show())
          cases.push_back({.suite = "single", .design = design, .effects = {effect}, .size = size, .seed = ++seed});
      }
    }
  }
  return cases;
}

/// All noise models and all clutter in turn, the latter alone, with drift, and with outliers.
std::vector<Case> nothing(std::uint64_t seed, std::size_t draws) {
  struct Surroundings {
    NoiseKind noise;
    std::vector<std::string> clutter;
  };
  using enum NoiseKind;
  static const std::vector<Surroundings> all = {{gaussian, {}},
                                                {heavy, {}},
                                                {drift, {}},
                                                {gaussian, {"warp"}},
                                                {gaussian, {"sessions"}},
                                                {gaussian, {"residue"}},
                                                {gaussian, {"misplaced"}},
                                                {drift, {"sessions", "residue"}},
                                                {heavy, {"warp", "misplaced"}},
                                                {drift, {"warp", "sessions", "residue", "misplaced"}}};
  constexpr std::array designs = {"A", "B", "C"};
  std::vector<Case> cases;
  for (std::size_t i = 0; i < 90 * draws; ++i) {
    const Surroundings& here = all[i / designs.size() % all.size()];
    cases.push_back({.suite = "nothing",
                     .design = designs[i % designs.size()],
                     .noise = here.noise,
                     .clutter = here.clutter,
                     .seed = ++seed});
  }
  return cases;
}

/// Several effects at once, no two equivalent.
std::vector<Case> several(const std::string& suite, std::size_t effects, std::size_t count, std::uint64_t seed) {
  std::vector<Case> cases;
  std::mt19937_64 random(seed);
  const std::vector<std::string> all = effects_that_show();
  while (cases.size() < count) {
    std::vector<std::string> chosen;
    std::ranges::sample(all, std::back_inserter(chosen), static_cast<std::ptrdiff_t>(effects), random);
    bool alike = false;
    for (const std::string& a : chosen)
      for (const std::string& b : chosen) alike = alike || (a < b && are_alike(a, b));
    if (!alike) cases.push_back({.suite = suite, .effects = chosen, .seed = ++seed});
  }
  return cases;
}

/// A constant of 2 to 20 mm and an integration-time offset of 2 to 12 mm, for each grid of distances, times and
/// targets; its law, whether the order is stated, and further hidden effects are drawn at random.
std::vector<Case> lab(std::uint64_t seed, std::size_t draws) {
  constexpr std::array<const char*, 3> laws = {"slope={0}mm", "slope=0mm,linear={0}m/s", "slope={0}mm,exponent=0.5"};
  constexpr std::array<const char*, 3> beside = {"", "wiggling", "crosstalk"};
  std::vector<Case> cases;
  std::mt19937_64 random(seed);
  const auto size = [&](double least, double most) {
    const double value = std::uniform_real_distribution<double>(least, most)(random);
    return random() % 2 == 0 ? value : -value;
  };
  for (std::size_t draw = 0; draw < draws; ++draw) {
    for (const char* times : {"2", "3", "4", "8"}) {
      for (const char* targets : {"1", "2", "3"}) {
        Case& one = cases.emplace_back(Case{.suite = "lab",
                                            .design = fmt::format("lab{}x{}", times, targets),
                                            .effects = {"zero_offset", "integration_time_offset"},
                                            .drawn = Drawn::plain,
                                            .seed = ++seed});
        one.jitter = 0.8;  // 0.4 mm
        one.frames = 1;
        one.order = std::array{Order::unstated, Order::shuffled, Order::designed}[cases.size() % 3];
        one.given["zero_offset"] = fmt::format("offset={:.2f}mm", size(2, 20));
        one.given["integration_time_offset"] =
            fmt::format(fmt::runtime(laws[random() % laws.size()]), fmt::format("{:.2f}", size(2, 12)));
        if (const std::string more = beside[(cases.size() / 3 + draw) % beside.size()]; !more.empty())
          one.effects.push_back(more);
      }
    }
  }
  return cases;
}

std::vector<Case> pairs(std::uint64_t seed, std::size_t draws) { return several("pairs", 2, 20 * draws, seed); }
std::vector<Case> triples(std::uint64_t seed, std::size_t draws) { return several("triples", 3, 10 * draws, seed); }

/// The hidden effect is unknown to the search.
std::vector<Case> without(std::uint64_t seed, std::size_t draws) {
  std::vector<Case> cases;
  for (std::size_t draw = 0; draw < draws; ++draw) {
    for (const std::string& effect : effects_that_show())
      cases.push_back({.suite = "without", .effects = {effect}, .without = effect, .seed = ++seed});
  }
  return cases;
}

std::vector<Case> patterns(std::uint64_t seed, std::size_t draws) {
  std::vector<Case> cases;
  for (std::size_t draw = 0; draw < draws; ++draw) {
    for (const PatternKind& pattern : pattern_catalogue()) {
      for (const double size : {1.0, 2.0})
        cases.push_back({.suite = "patterns", .size = size, .pattern = pattern.name, .seed = ++seed});
    }
  }
  return cases;
}

/// Equivalent pairs, without and with the data of the experiment that distinguishes them.
std::vector<Case> ties(std::uint64_t seed, std::size_t draws) {
  struct Tie {
    const char *design, *effect, *experiment;
  };
  constexpr std::array all = {Tie{"C", "modulation_frequency", "reference"},
                              Tie{"C", "rail_scale", "reference"},
                              Tie{"C", "principal_point", "roll"},
                              Tie{"C", "board_tilt", "roll"},
                              Tie{"C", "phase_step_error", "velocity"},
                              Tie{"C", "motion", "velocity"},
                              Tie{"B", "source_amplitude", "single_sources"},
                              Tie{"B", "source_position", "single_sources"}};
  std::vector<Case> cases;
  for (std::size_t draw = 0; draw < draws; ++draw) {
    for (const Tie& tie : all) {
      cases.push_back({.suite = "ties", .design = tie.design, .effects = {tie.effect}, .seed = ++seed});
      cases.push_back({.suite = "ties",
                       .design = tie.design,
                       .experiments = {tie.experiment},
                       .effects = {tie.effect},
                       .seed = seed});
    }
  }
  return cases;
}

/// Cases to run after every change of the search: a small design, some of everything.
std::vector<Case> quick(std::uint64_t seed, std::size_t) {
  std::vector<Case> cases;
  for (const char* effect : {"wiggling", "tap_mismatch", "crosstalk", "amplitude_walk", "integration_time_offset",
                             "source_amplitude", "modulation_frequency", "fixed_pattern"})
    cases.push_back({.suite = "quick", .design = "small", .effects = {effect}, .seed = ++seed});
  for (const NoiseKind noise : noises)
    cases.push_back({.suite = "quick", .design = "small", .noise = noise, .seed = ++seed});
  for (const char* other : {"crosstalk", "fixed_pattern"})
    cases.push_back({.suite = "quick", .design = "small", .effects = {"wiggling", other}, .seed = ++seed});
  cases.push_back(
      {.suite = "quick", .design = "small", .effects = {"wiggling"}, .without = "wiggling", .seed = ++seed});
  cases.push_back({.suite = "quick", .design = "small", .pattern = pattern_catalogue().front().name, .seed = ++seed});
  return cases;
}

}  // namespace

std::string Case::key() const {
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}", suite, design, fmt::join(experiments, "+"),
                     fmt::join(effects, "+"), size, drawn == Drawn::all ? "all" : "plain", pattern, without,
                     name_of(noise), fmt::join(clutter, "+"), name_of(output), seed);
}

Clutter clutter_of(const std::vector<std::string>& names) {
  Clutter clutter;
  for (const std::string& name : names) {
    if (name == "warp")
      clutter.warp = 1e-3;
    else if (name == "sessions")
      clutter.sessions = 3;
    else if (name == "residue")
      clutter.residue = 0.3e-3;
    else if (name == "misplaced")
      clutter.misplaced = 20e-3;
    else
      throw std::invalid_argument(
          fmt::format("there is no clutter '{}'; there are warp, sessions, residue, misplaced", name));
  }
  return clutter;
}

std::vector<Case> cases_of(const Suite& suite, std::uint64_t seed, std::size_t draws, std::size_t count) {
  std::vector<Case> cases = suite.make(seed, draws);
  while (cases.size() < count) {  // earlier draws stay first, and some suites cannot be redrawn
    std::vector<Case> more = suite.make(seed, ++draws);
    if (more.size() == cases.size()) break;
    cases = std::move(more);
  }
  return cases;
}

const std::vector<Suite>& suites() {
  static const std::vector<Suite> all = {
      {"quick", "a small design, some of everything", quick},
      {"single", "each effect alone, designs B and C, half, once and twice its typical size", single},
      {"nothing", "90 campaigns without an effect, designs A, B, C, all noise models and clutter", nothing},
      {"pairs", "two effects", pairs},
      {"lab", "a constant and an offset with integration time, small grids; some with a wiggle or crosstalk beside",
       lab},
      {"triples", "three effects", triples},
      {"without", "an effect that the search does not know", without},
      {"patterns", "errors that are in no catalogue", patterns},
      {"ties", "effects that are alike, without and with the experiment that separates them", ties}};
  return all;
}

bool is_hidden_from_boards(const std::string& effect) {
  constexpr std::array names = {"temporal_noise", "saturation", "mixed_pixels"};
  return std::ranges::find(names, effect) != names.end();
}

namespace {

/// Effects that are equivalent if one setting is the same in all conditions: a warm camera has an offset, and so has
/// one with a single integration time. If only distances are known, so have phase steps with an error of the second
/// equal to the sum of the first and the third: samples would show it in N2.
bool are_alike_in(const Case& what, const std::string& a, const std::string& b) {
  std::vector<std::string> offsets = {"zero_offset"};
  const bool warms_up = what.design == "C" || std::ranges::find(what.experiments, "warm_up") != what.experiments.end();
  if (!warms_up) offsets.emplace_back("warm_up");
  if (what.design == "A" && what.experiments.empty()) offsets.emplace_back("integration_time_offset");
  const bool steps = std::ranges::find(what.effects, "phase_step_error") != what.effects.end();
  if (what.output == Output::distances && !steps) offsets.emplace_back("phase_step_error");  // hidden ones differ
  return a != b && std::ranges::find(offsets, a) != offsets.end() && std::ranges::find(offsets, b) != offsets.end();
}

}  // namespace

bool are_alike(const Case& what, const std::string& a, const std::string& b) {
  return are_alike(a, b) || are_alike_in(what, a, b);
}

bool are_alike(const std::string& a, const std::string& b) {
  constexpr std::array<std::array<const char*, 2>, 8> ties = {{{"modulation_frequency", "rail_scale"},
                                                               {"crosstalk", "static_reflection"},
                                                               {"principal_point", "board_tilt"},
                                                               {"phase_step_error", "motion"},
                                                               {"source_amplitude", "source_position"},
                                                               {"lens_distortion", "stray_light"},
                                                               {"amplitude_walk", "rail_scale"},
                                                               {"vignetting", "pixel_response"}}};
  return std::ranges::any_of(
      ties, [&](const auto& tie) { return (a == tie[0] && b == tie[1]) || (a == tie[1] && b == tie[0]); });
}

}  // namespace tofgraph::hidden
