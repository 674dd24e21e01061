// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/clutter.hpp"

#include "io/condition.hpp"
#include "tests/hidden_effects/plain_camera.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>

namespace tofgraph::hidden {
namespace {

/// Seeds that differ from the campaign's other draws.
enum Purpose : std::uint64_t { warp_draw = 1'000'000, session_draw, residue_draw, misplaced_draw };

std::mt19937_64 generator(std::uint64_t seed, std::uint64_t purpose) {
  std::seed_seq sequence{seed, seed >> 32, purpose};
  return std::mt19937_64(sequence);
}

double angle(std::mt19937_64& random) { return std::uniform_real_distribution<double>(0, 2 * M_PI)(random); }

/// Waves of 0.7 to 2 m in all directions: a slope of a few mrad per mm.
Smooth draw_warp(double size, std::mt19937_64 random) {
  std::vector<Smooth::Wave> waves(8);
  for (Smooth::Wave& wave : waves) {
    const double direction = angle(random), number = 2 * M_PI / std::uniform_real_distribution<double>(0.7, 2)(random);
    wave = {number * std::cos(direction), number * std::sin(direction), angle(random)};
  }
  return {size, std::move(waves)};
}

/// Adds a board warp to each view: one smooth field per target, whose seed depends on the target's name.
void warp_boards(double size, std::uint64_t seed, const std::vector<io::Condition>& conditions,
                 std::vector<View>& views) {
  std::map<std::string, Smooth> warps;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string& target = conditions[i].target;
    if (!warps.contains(target)) {
      std::uint64_t mixed = seed;
      for (const char letter : target) mixed = mixed * 1099511628211ULL + static_cast<unsigned char>(letter);
      warps[target] = draw_warp(size, generator(mixed, warp_draw));
    }
    views[i].warp = warps[target];
  }
}

/// The same waves in all conditions, with phases that vary with the order: correlated over some 40 px and 3 conditions.
void leave_residue(double size, std::mt19937_64 random, std::vector<View>& views) {
  constexpr double pixels = 40, conditions = 3;
  std::normal_distribution<double> normal;
  std::vector<Smooth::Wave> waves(30);
  std::vector<double> turns(waves.size());
  for (std::size_t w = 0; w < waves.size(); ++w) {
    const double x = normal(random) / pixels, y = normal(random) / pixels;
    waves[w] = {x, y, angle(random)};
    turns[w] = normal(random) / conditions;
  }
  for (View& view : views) {
    view.residue = {size, waves};
    for (std::size_t w = 0; w < waves.size(); ++w) waves[w].phase += turns[w];
  }
}

}  // namespace

Smooth::Smooth(double size, std::vector<Wave> waves)
    : each_(size * std::sqrt(2 / static_cast<double>(waves.size()))), waves_(std::move(waves)) {}

double Smooth::operator()(double x, double y) const {
  double sum = 0;
  for (const Wave& wave : waves_) sum += std::cos(wave.x * x + wave.y * y + wave.phase);
  return each_ * sum;
}

std::size_t session_of(std::size_t order, std::size_t conditions, std::size_t sessions) {
  return order * sessions / conditions;
}

void warm_up_first(std::vector<io::Condition>& conditions, std::size_t sessions) {
  const auto session = [&](const io::Condition& condition) {
    return session_of(static_cast<std::size_t>(&condition - conditions.data()), conditions.size(), sessions);
  };
  for (auto first = conditions.begin(); sessions > 0 && first != conditions.end();) {
    const auto last =
        std::find_if(first, conditions.end(), [&](const auto& c) { return session(c) != session(*first); });
    std::ranges::stable_sort(first, last, {}, &io::Condition::time_since_power_on);
    first = last;
  }
}

DrawnClutter add_clutter(const Clutter& clutter, std::uint64_t seed, std::uint64_t boards_seed,
                         const std::vector<io::Condition>& conditions, std::vector<View>& views) {
  DrawnClutter drawn;
  if (clutter.warp != 0) warp_boards(clutter.warp, boards_seed, conditions, views);
  if (clutter.residue != 0) leave_residue(clutter.residue, generator(seed, residue_draw), views);
  std::mt19937_64 random = generator(seed, session_draw);
  std::normal_distribution<double> normal;
  for (std::size_t s = 0; s < clutter.sessions; ++s) {
    const double offset = session_offset * normal(random);
    drawn.sessions.push_back({offset, 1 + session_light * normal(random)});
  }
  for (View& view : views) {
    if (drawn.sessions.empty()) break;
    const DrawnClutter::Session& session = drawn.sessions[session_of(view.order, views.size(), drawn.sessions.size())];
    view.drift_distance += session.offset;
    view.drift_amplitude *= session.light;
  }
  if (clutter.misplaced != 0) {
    drawn.misplaced = generator(seed, misplaced_draw)() % views.size();
    while (conditions[drawn.misplaced].is_capped()) drawn.misplaced = (drawn.misplaced + 1) % views.size();
    views[drawn.misplaced].distance += clutter.misplaced;
  }
  return drawn;
}

}  // namespace tofgraph::hidden
