// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: GivenValues.ACalibrated*:GivenValues.AWrong*:GivenValues.AnotherContrast*
// Rooms: diagnosis
// Values of the given model that the data do not determine are kept; a contrast other than the profile's is no effect.
#include "diagnosis/model/nuisances.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/given_model.hpp"
#include "tests/program.hpp"
#include "tests/unit/rail.hpp"

#include <fstream>

namespace tofgraph::diagnosis {
namespace {

class GivenValues : public Rail {
 protected:
  /// Reads the model from a file with these effects.
  const simulation::Model& given(const std::string& effects) {
    const std::filesystem::path file = folder_.path() / "model.yaml";
    std::ofstream(file) << "model: 1\ncamera: camcube2\nlight: physical\neffects:\n" << effects;
    config::Diagnostics diagnostics;
    model_ = simulation::load_model(file, catalogue_, diagnostics);
    EXPECT_TRUE(diagnostics.ok()) << diagnostics.text();
    return model_;
  }
  void keep(const std::set<std::string>& names) {
    std::erase_if(candidates, [&](const auto& c) { return !names.contains(c->name()); });
  }

  tests::TemporaryFolder folder_;
  graph::PluginRegistry catalogue_{graph::plugin_path({})};
  simulation::Model model_;
};

/// All data were taken an hour after power-on: the drift is constant, and the missing constant is the simpler model.
TEST_F(GivenValues, ACalibratedDriftDoesNotTakeThePlaceOfAConstant) {
  const std::vector<Observations> data =
      data_with({{&effect("zero_offset"), {0.028}}, {&effect("warm_up"), {-0.0107, 720, 0}}}, 11);
  GivenModel model(given("  - {effect: warm_up, drift: -10.7 mm, time_constant: 720 s, droop: 0}\n").effects);
  const Problem problem = make_problem(*design, data);
  model.hold_undetermined(problem, candidates);
  const Candidate& warm_up = *model.terms().front().candidate;
  EXPECT_TRUE(std::ranges::none_of(warm_up.free(), [](const FreeParameter& p) { return p.name == "drift"; }));
  ASSERT_FALSE(model.notes().empty());
  EXPECT_NE(model.notes().front().find("warm_up drift stays at -10.7 mm"), std::string::npos) << model.notes().front();
  EXPECT_NE(warm_up.yaml(model.terms().front().values).find("drift: \"-10.7 mm\""), std::string::npos)
      << warm_up.yaml(model.terms().front().values);
  keep({"zero_offset", "wiggling"});
  const std::vector<Term> terms = model.terms();
  const SearchResult result = search(problem, terms, candidates, {});
  ASSERT_EQ(names(result), std::vector<std::string>{"zero_offset"});
  EXPECT_NEAR(result.after.state.terms.back().values.front(), 0.028, 5e-4);
}

/// Values that the data determine are refitted as before.
TEST_F(GivenValues, AWrongValueThatTheDataDetermineIsRefitted) {
  const std::vector<Observations> data = data_with({{&effect("wiggling"), {0.006, 1}}}, 12);
  GivenModel model(given("  - {effect: wiggling, amplitude: 3 mm, phase: 1 rad}\n").effects);
  const Problem problem = make_problem(*design, data);
  model.hold_undetermined(problem, candidates);
  EXPECT_TRUE(model.notes().empty());
  keep({"zero_offset"});
  const std::vector<Term> terms = model.terms();
  const SearchResult result = search(problem, terms, candidates, {});
  ASSERT_EQ(result.after.state.terms.size(), 1U);
  EXPECT_NEAR(result.after.state.terms[0].values[0], 0.006, 3e-4);
}

std::vector<Observations> with_contrast(const Design& design, std::vector<Observations> data, double factor) {
  const std::size_t n = design.superpixels();
  for (Observations& one : data)
    for (std::size_t row = intensity * n; row < (intensity + 1) * n; ++row) one.value[row] -= std::log(factor);
  return data;
}

TEST_F(GivenValues, AnotherContrastIsMeasuredAndIsNoEffect) {
  const Term hidden = random_term(effect("wiggling"), 1, 13);
  const std::vector<Observations> data = with_contrast(*design, data_with({hidden}, 13), 0.94);
  const Problem problem = make_problem(*design, data);
  keep({"wiggling", "multipath", "ambient_light", "static_reflection", "pixel_response", "saturation"});
  const SearchResult result = search(problem, {}, candidates, {});
  EXPECT_EQ(names(result), std::vector<std::string>{"wiggling"});
  EXPECT_FALSE(result.something_left());
  const std::optional<MeasuredContrast> contrast = contrast_of(problem, result.after.state, result.lack_of_fit);
  ASSERT_TRUE(contrast);
  const double profile = design->camera().contrast;
  EXPECT_EQ(contrast->profile, profile);
  EXPECT_NEAR(contrast->value, 0.94 * profile, 0.002 * profile);
  EXPECT_LT(contrast->low, 0.94 * profile);
  EXPECT_GT(contrast->high, 0.94 * profile);
  EXPECT_TRUE(contrast->profile_is_off());
}

/// Without the contrast the intensities of this camera would differ from the simulated ones by 6 %, of which no effect
/// is the cause.
TEST_F(GivenValues, TheContrastIsNoGapOfTheIntensities) {
  const std::vector<Observations> data = with_contrast(*design, data_with({}, 13), 0.94);
  const Problem problem = make_problem(*design, data);
  const State none{{}, std::vector<double>(problem.targets.size(), 0.1), {.offset = 0}};
  const double shift = contrast_shift(problem, none, intensity);
  EXPECT_NEAR(shift, -std::log(0.94), 0.002);
  EXPECT_EQ(contrast_shift(problem, none, distance), 0);
  EXPECT_NEAR(gap(problem, none, intensity, 0), -std::log(0.94), 0.01);
  EXPECT_LT(gap(problem, none, intensity, shift), 0.02);
  const Evidence shown = evidence({problem, none}, {problem, none}, intensity);
  for (const Evidence::Mean& mean : shown.means) {
    EXPECT_NEAR(mean.measured - mean.extended, 0, 0.01);
    EXPECT_NEAR(mean.extended - mean.simulated, shift, 1e-9);
  }
}

TEST_F(GivenValues, TheProfilesContrastIsNotOffWhereItIsRight) {
  const std::vector<Observations> data = data_with({}, 14);
  const Problem problem = make_problem(*design, data);
  const std::optional<MeasuredContrast> contrast =
      contrast_of(problem, {{}, std::vector<double>(problem.targets.size(), 0.1), {.offset = 0}}, 1);
  ASSERT_TRUE(contrast);
  EXPECT_FALSE(contrast->profile_is_off());
  EXPECT_FALSE(has_contrast(problem.nuisances));
}

/// An effect on intensities alone decreases with the brightness of a condition: it is not a contrast.
TEST_F(GivenValues, TheContrastIsAnUnknownWhereTapsContradictTheProfileAlone) {
  const std::vector<Observations> lit = data_with({random_term(effect("ambient_light"), 1, 15)}, 15);
  EXPECT_FALSE(has_contrast(make_problem(*design, lit).nuisances));
  const std::vector<Observations> lower = with_contrast(*design, data_with({}, 15), 0.94),
                                  higher = with_contrast(*design, data_with({}, 15), 1.02),
                                  hardly = with_contrast(*design, data_with({}, 15), 0.995);
  EXPECT_TRUE(has_contrast(make_problem(*design, lower).nuisances));
  EXPECT_TRUE(has_contrast(make_problem(*design, higher).nuisances));
  EXPECT_FALSE(has_contrast(make_problem(*design, hardly).nuisances));
}

TEST_F(GivenValues, NothingIsSaidOfContrastWithoutIntensities) {
  std::vector<Observations> data = data_with({}, 14);
  const std::size_t n = design->superpixels();
  for (Observations& one : data)
    std::fill_n(one.variance.begin() + static_cast<std::ptrdiff_t>(intensity * n), n, HUGE_VAL);
  EXPECT_FALSE(contrast_of(make_problem(*design, data), {}, 1));
}

/// A dark level cancels in differences of taps: without intensities its map contains only rounding errors.
TEST_F(GivenValues, MapsStayWithinWhatAPixelMayHave) {
  const MapParameter dark{0, "dark_map", "counts"}, rate{0, "dark_rate_map", "counts/s"}, offset{0, "map", "m"},
      gain{0, "map", ""};
  const tofgraph_camera& camera = design->camera();
  EXPECT_EQ(dark.bound(*design), camera.full_well);
  EXPECT_NEAR(rate.bound(*design), camera.full_well / 4e-3, 1);
  EXPECT_NEAR(offset.bound(*design), 299792458 / (4 * camera.modulation_frequency), 1e-9);
  EXPECT_EQ(gain.bound(*design), 1);
}

}  // namespace
}  // namespace tofgraph::diagnosis
