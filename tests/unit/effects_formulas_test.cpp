// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: AnyExposures.AllEffects*:AnyExposures.EveryEffect*
// Rooms: simulation
// All effects with arbitrary exposures, compared with an independent implementation of the camera.
#include <gtest/gtest.h>

#include <set>
#include <sstream>

#include "tests/unit/effect_exposures.hpp"
#include "tests/unit/effect_fixture.hpp"
#include "tests/unit/effect_formula_rows.hpp"

using namespace tofgraph;
using namespace tofgraph::test;

namespace {

/// Largest difference, relative to the mean of the pixel's two taps; infinite if a value is NaN.
double difference(const std::vector<double>& real, const std::vector<double>& wanted) {
  if (real.size() != wanted.size()) return std::numeric_limits<double>::infinity();
  double most = 0;
  for (std::size_t i = 0; i < real.size(); ++i) {
    const std::size_t a = i / (2 * pixels) * (2 * pixels) + i % pixels;
    const double part = std::abs(real[i] - wanted[i]) / ((wanted[a] + wanted[a + pixels]) / 2);
    if (!(part <= most)) most = std::isnan(part) ? std::numeric_limits<double>::infinity() : part;
  }
  return most;
}

std::set<std::string> catalogue_effects(const graph::PluginRegistry& catalogue) {
  std::set<std::string> names;
  for (const graph::PluginFile& file : catalogue.files()) {
    if (file.kind == "effect") names.insert(file.name);
  }
  return names;
}

/// Parameters of image 3 are rejected if it does not exist.
std::string parameters_of(const Row& row, const Exposures& exposures) {
  std::string parameters = row.parameters;
  for (const char* of_image_3 : {", step3", ", gain3"})
    if (exposures.size() < 4 && parameters.find(of_image_3) != std::string::npos)
      parameters.erase(parameters.find(of_image_3));
  return parameters;
}

TEST(AnyExposures, EveryEffectIsItsFormula) {
  const Files files;
  const std::vector<Row> rows = all_rows(files);
  for (const Exposures& exposures : many()) {
    const ExposedCamera camera(exposures);
    for (const bool physical : {true, false}) {
      SCOPED_TRACE(physics::exposures_text(exposures) + (physical ? ", physical" : ", reference"));
      const View view = view_of(camera, physical);
      const std::vector<double> ideal = by_formula({}, camera, physical);
      EXPECT_LT(difference(expected("", view).taps, ideal), 1e-9);
      for (const Row& row : rows) {
        const Expectation real = expected("{effect: " + row.effect + ", " + parameters_of(row, exposures) + "}", view);
        const std::vector<double> wanted = by_formula(row.formula, camera, physical);
        EXPECT_LT(difference(real.taps, wanted), 1e-9) << row.effect;
        EXPECT_EQ(real.noise_factor, row.formula.noise) << row.effect;
        // A formula without effect would test nothing.
        EXPECT_TRUE(row.formula.noise != 1 || difference(wanted, ideal) > 1e-6) << row.effect;
      }
    }
  }
}

TEST(AnyExposures, NoEffectIsLeftOut) {
  const Files files;
  std::set<std::string> tested;
  for (const Row& row : all_rows(files)) tested.insert(row.effect);
  EXPECT_EQ(tested, catalogue_effects(graph::PluginRegistry(graph::plugin_path({}))));
  EXPECT_EQ(tested.size(), 36);
}

/// All effects with zero amplitudes and typical nonlinear parameters.
std::string all_off() {
  const graph::PluginRegistry catalogue(graph::plugin_path({}));
  std::ostringstream list;
  list.precision(17);
  for (const graph::PluginFile& file : catalogue.files()) {
    if (file.kind != "effect") continue;
    list << (list.tellp() > 0 ? ", " : "") << "{effect: " << file.name;
    const graph::Plugin& plugin = catalogue.load(file);
    for (std::size_t i = 0; i < plugin.parameter_count; ++i) {
      const tofgraph_parameter& p = plugin.own_parameters[i];
      const double value = std::isnan(p.off) ? p.typical : p.off;
      if (p.kind == TOFGRAPH_KIND_NUMBER && !std::isnan(value))
        list << ", " << p.name << ": " << value << " " << (p.unit == nullptr ? "" : p.unit);
    }
    list << "}";
  }
  return list.str();
}

TEST(AnyExposures, AllEffectsOffChangeNoBit) {
  const std::string off = all_off();
  ASSERT_NE(off.find("{effect: wiggling, amplitude: 0 m, phase: 1 rad"), std::string::npos) << off;
  ASSERT_NE(off.find("{effect: temporal_noise, factor: 1"), std::string::npos) << off;
  for (const Exposures& exposures : many()) {
    const ExposedCamera camera(exposures);
    for (const bool physical : {true, false}) {
      SCOPED_TRACE(physics::exposures_text(exposures) + (physical ? ", physical" : ", reference"));
      View view = view_of(camera, physical);
      view.pixels = whole_image(camera.view());  // with the edge's rays
      view.acquisition.condition.velocity = 0.1;
      const Expectation without = expected("", view), with = expected(off, view);
      EXPECT_EQ(with.noise_factor, 1);
      ASSERT_EQ(without.taps.size(), 2 * exposures.size() * view.pixels.size());
      EXPECT_TRUE(with.taps == without.taps);
    }
  }
}

}  // namespace
