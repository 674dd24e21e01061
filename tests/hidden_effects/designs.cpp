// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/designs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

namespace tofgraph::hidden {
namespace {

using Conditions = std::vector<io::Condition>;

struct Target {
  const char* name;
  double reflectivity;
};
constexpr Target white{"white", 0.85}, light_grey{"light grey", 0.5}, grey{"grey", 0.3}, black{"black", 0.12};
constexpr std::array targets = {white, light_grey, grey, black};
constexpr std::array times = {0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3};  // s

io::Condition board(double distance, Target target, double integration_time) {
  io::Condition condition;
  condition.board_distance = distance;
  condition.board_tilt_x = condition.board_tilt_y = 0;
  condition.target = target.name;
  condition.reflectivity = target.reflectivity;
  condition.integration_time = integration_time;
  condition.time_since_power_on = 3600;
  return condition;
}

/// Nominal amplitude: enough light for a measurement, and no tap near the full well.
bool usable(const io::Condition& condition) {
  const double path = 2 * condition.board_distance;
  const double amplitude = 7.0e6 * condition.reflectivity * condition.integration_time / (path * path);
  return amplitude > 60 && amplitude < 9000;
}

/// Integration time that gives a white board a few hundred to a few thousand counts.
double time_for(double distance) {
  return distance < 1.2 ? 1e-3 : distance < 2.5 ? 2e-3 : distance < 4.5 ? 4e-3 : 8e-3;
}

Conditions usable_at(double distance) {
  Conditions all;
  for (const Target target : targets)
    for (const double time : times)
      if (const io::Condition condition = board(distance, target, time); usable(condition)) all.push_back(condition);
  return all;
}

/// A rail with `each` pairs of target and integration time at every distance, different pairs at each stop, all pairs
/// at one distance, and a few repeated conditions.
Conditions rail(double first, double last, double step, std::size_t each, double full_at, std::size_t again) {
  Conditions all;
  std::size_t stop = 0;
  for (double z = first; z < last + step / 2; z += step, ++stop) {
    const Conditions here = usable_at(z);
    for (std::size_t i = 0; i < std::min(each, here.size()); ++i)
      all.push_back(here[(3 * stop + i * here.size() / each) % here.size()]);
  }
  if (full_at > 0)
    for (const io::Condition& condition : usable_at(full_at)) all.push_back(condition);
  for (std::size_t i = 0; i < again; ++i) all.push_back(all[(2 * i + 1) * all.size() / (2 * again)]);
  return all;
}

Conditions joined(std::initializer_list<Conditions> parts) {
  Conditions all;
  for (const Conditions& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

Conditions roll_experiment() {
  Conditions all;
  for (const double z : {0.7, 1.5, 3.0, 5.0})
    for (const double roll : {M_PI / 2, M_PI}) {
      all.push_back(board(z, white, time_for(z)));
      all.back().roll = roll;
    }
  return all;
}

Conditions velocity_experiment() {
  Conditions all;
  for (const double z : {0.8, 1.5, 2.2, 3.6})
    for (const double velocity : {-0.1, 0.0, 0.1}) {
      all.push_back(board(z, white, time_for(z)));
      all.back().velocity = velocity;
    }
  return all;
}

Conditions reference_experiment() {
  Conditions all;
  for (double z = 0.75; z < 6.8; z += 0.75) {
    all.push_back(board(z, white, time_for(z)));
    all.back().reference = "laser";
  }
  return all;
}

/// Long enough that no tap with crosstalk comes close to zero, the lower limit of the converter.
Conditions capped_experiment() {
  Conditions all;
  for (const double time : {20e-3, 30e-3, 40e-3, 50e-3}) {
    all.push_back(board(2.0, white, time));
    all.back().lens = "capped";
  }
  return all;
}

Conditions rail_experiment() {
  Conditions all;
  for (const double z : {0.6, 0.9, 1.3, 1.9, 2.8, 4.2}) {
    all.push_back(board(z, white, time_for(z)));
    all.back().rail = "covered";
  }
  return all;
}

Conditions single_sources() {
  Conditions all;
  for (const double z : {0.6, 1.0, 1.7, 3.0})
    for (const char* source : {"left", "right"}) {
      all.push_back(board(z, white, time_for(z)));
      all.back().sources = {source};
    }
  return all;
}

Conditions tilts() {
  Conditions all;
  for (const double degrees : {-30.0, -15.0, 15.0, 30.0})
    for (const bool about_x : {true, false}) {
      all.push_back(board(1.5, white, 2e-3));
      (about_x ? all.back().board_tilt_x : all.back().board_tilt_y) = degrees * M_PI / 180;
    }
  return all;
}

Conditions warm_up() {
  Conditions all;
  for (const double minutes : {0.5, 2.0, 4.0, 7.0, 11.0, 16.0, 23.0, 32.0, 45.0}) {
    all.push_back(board(2.0, white, 2e-3));
    all.back().time_since_power_on = 60 * minutes;
  }
  return all;
}

Conditions ambient() {
  Conditions all;
  for (const double z : {1.0, 2.5})
    for (const double time : {1e-3, 4e-3, 8e-3}) {
      all.push_back(board(z, grey, time));
      all.back().ambient = "lamp";
    }
  return all;
}

Conditions design_small() { return rail(0.75, 4.0, 0.25, 2, 0, 8); }

Conditions design_a() {
  Conditions all;
  for (double z = 0.6; z < 6.9; z += 0.23) all.push_back(board(z, white, 2e-3));
  all.push_back(all[7]);
  all.push_back(all[20]);
  return all;
}

Conditions design_b() { return rail(0.6, 6.9, 0.24, 2, 2.0, 4); }

/// 13 distances with all measurable pairs of integration time and target.
Conditions lab_grid(std::size_t time_count, std::size_t target_count) {
  static const std::map<std::size_t, std::vector<double>> times_of = {
      {2, {1e-3, 4e-3}},
      {3, {1e-3, 2e-3, 4e-3}},
      {4, {0.5e-3, 1e-3, 2e-3, 4e-3}},
      {8, {0.5e-3, 0.7e-3, 1e-3, 1.4e-3, 2e-3, 2.8e-3, 4e-3, 5.6e-3}}};
  Conditions all;
  for (std::size_t stop = 0; stop < 13; ++stop) {
    for (std::size_t target = 0; target < target_count; ++target) {
      for (const double time : times_of.at(time_count)) {
        const io::Condition condition = board(0.8 + 0.2 * static_cast<double>(stop), targets[target], time);
        if (usable(condition)) all.push_back(condition);
      }
    }
  }
  return all;
}

Conditions design_c() {
  return joined({rail(0.6, 6.9, 0.24, 2, 1.6, 4), tilts(), warm_up(), single_sources(), ambient()});
}

const NamedConditions& named(const std::vector<NamedConditions>& all, const std::string& name, const char* what) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const NamedConditions& one) { return one.name == name; });
  if (found == all.end()) throw std::invalid_argument(fmt::format("there is no {} '{}'; --list shows all", what, name));
  return *found;
}

}  // namespace

const std::vector<NamedConditions>& designs() {
  static const std::vector<NamedConditions> all = [] {
    std::vector<NamedConditions> list = {
        {"small", "rail to 4 m, 2 pairs of target and integration time a stop", design_small},
        {"A", "rail to 7 m, one target, one integration time", design_a},
        {"B", "rail to 7 m, 2 pairs of target and integration time a stop, all pairs at 2 m", design_b},
        {"C", "B with tilts, warm-up, single sources and ambient light", design_c}};
    for (const std::size_t time_count : {2, 3, 4, 8}) {
      for (const std::size_t target_count : {1, 2, 3})
        list.push_back({fmt::format("lab{}x{}", time_count, target_count),
                        fmt::format("13 distances, {} integration times, targets: {}", time_count, target_count),
                        [=] { return lab_grid(time_count, target_count); }});
    }
    return list;
  }();
  return all;
}

const std::vector<NamedConditions>& experiments() {
  static const std::vector<NamedConditions> all = {
      {"roll", "camera turned by 90 and 180 deg", roll_experiment},
      {"velocity", "board standing, coming and going with 100 mm/s", velocity_experiment},
      {"reference", "distances read from a laser", reference_experiment},
      {"capped", "lens capped, integration times 20 to 50 ms", capped_experiment},
      {"rail", "rail covered", rail_experiment},
      {"single_sources", "left or right array alone", single_sources},
      {"tilts", "board tilted by 15 and 30 deg about both axes", tilts},
      {"warm_up", "first 45 min after power-on at 2 m", warm_up},
      {"ambient", "a lamp on", ambient}};
  return all;
}

void name_conditions(std::vector<io::Condition>& all) {
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double mm = all[i].board_distance * 1e3;
    all[i].id = fmt::format("{:03}-{}-{:.1f}ms", i, std::isnan(mm) ? "capped" : fmt::format("{:04.0f}mm", mm),
                            all[i].integration_time * 1e3);
  }
}

void append(std::vector<io::Condition>& conditions, const std::vector<io::Condition>& more) {
  for (io::Condition one : more) {
    if (one.is_capped()) {
      conditions.push_back(one);
      continue;
    }
    const auto known = std::ranges::find(conditions, one.target, &io::Condition::target);
    if (known == conditions.end()) throw std::invalid_argument("the design has no target '" + one.target + "'");
    one.reflectivity = known->reflectivity;
    conditions.push_back(one);
  }
  name_conditions(conditions);
}

std::vector<io::Condition> conditions_of(const std::string& design, const std::vector<std::string>& added,
                                         std::size_t every) {
  const Conditions whole = named(designs(), design, "design").make();
  Conditions all;
  for (std::size_t i = 0; i < whole.size(); i += every) all.push_back(whole[i]);
  for (const std::string& name : added)
    for (const io::Condition& condition : named(experiments(), name, "experiment").make()) all.push_back(condition);
  name_conditions(all);
  return all;
}

}  // namespace tofgraph::hidden
