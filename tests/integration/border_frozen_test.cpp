// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Plugins built only against the headers of version 2.0 behave as they did then. Built twice: with this host, and with
// a host whose structs have additional members.
#include "graph/parameters.hpp"
#include "graph/plugin.hpp"
#include "io/border.hpp"
#include "io/profile.hpp"
#include "simulation/board.hpp"
#include "simulation/forward_model.hpp"

#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>

#include <cmath>
#include <complex>

namespace tofgraph::simulation {
namespace {

const std::string frozen = TOFGRAPH_BINARY_DIR "/tests/frozen";
const std::string profile = TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml";

#ifdef TOFGRAPH_GROWN
TEST(GrownHost, HasMoreFieldsThanThePlugins) {
  EXPECT_GT(sizeof(tofgraph_value), 56U);
  EXPECT_GT(sizeof(tofgraph_light), io::first_size<tofgraph_light>);
}
#endif

TEST(FrozenStage, DoesWhatItDidWithItsDefaults) {
  Harness stage("frozen_stage", {frozen});
  stage.camera(profile);
  stage.put<float>("depth", {2, 3}, {1, 2, 3, 4, 5, 6});
  stage.run();
  EXPECT_EQ(stage.get<float>("depth"), (std::vector<float>{2.25F, 4.25F, 6.25F, 8.25F, 10.25F, 12.25F}));
  EXPECT_FALSE(stage.has("sigma"));
}

TEST(FrozenStage, IsToldWhatItWasToldThen) {
  Harness stage("frozen_stage offset='50 cm' times=3 negative=true mode=told label=abc weights=[1, 2] name=the_stage",
                {frozen});
  stage.camera(profile);
  stage.metadata().integration_time = 2e-3;
  stage.put<float>("depth", {2, 2}, {1, 2, 3, 4});
  stage.put<std::uint16_t>("flags", {2, 2}, {0, 1, 2, 0});
  stage.run();
  EXPECT_EQ(stage.get<float>("depth"), (std::vector<float>{-2.5F, -5.5F, -8.5F, -11.5F}));
  // 2 lights, 3 + 2 + 2 dimensions of rays, depth and flags, 3 letters, 2 ms, 100 (1 + 2)
  EXPECT_EQ(stage.get<float>("sigma"), (std::vector<float>{314, 315, 316, 314}));
  EXPECT_EQ(stage.of("sigma"), "depth");
  EXPECT_EQ(stage.applied("depth"), "frozen_stage");
}

TEST(FrozenPlainC, DoesWhatItDid) {
  Harness stage("frozen_plain add='1.5 m' level=7", {frozen});
  stage.camera(profile);
  stage.put<float>("depth", {2, 2}, {1, 2, 3, 4});
  stage.run();
  EXPECT_EQ(stage.get<float>("depth"), (std::vector<float>{2.5F, 3.5F, 4.5F, 5.5F}));
  EXPECT_EQ(stage.get<float>("amplitude"), (std::vector<float>{7, 7, 7, 7}));
  stage.run();
  EXPECT_EQ(stage.get<float>("amplitude"), (std::vector<float>{8, 8, 8, 8}));
  const auto lights = lights_of(stage.camera_out());
  ASSERT_EQ(lights.size, 2U);
  EXPECT_STREQ(lights[1].name, "east");
  EXPECT_EQ(lights[1].position[0], 0.1);
  EXPECT_EQ(lights[1].amplitude, 0.75);
  const std::string text = stage.camera_out().profile;
  EXPECT_NE(text.find("{name: 'west', position: [-0.1 m, 0 m, 0 m], amplitude: 0.25}"), std::string::npos) << text;
  EXPECT_NE(text.find("{name: 'east', position: [0.1 m, 0 m, 0 m], amplitude: 0.75}"), std::string::npos) << text;
}

class FrozenEffect : public testing::Test {
 protected:
  io::CameraPtr camera = io::load_profile(profile);
  Acquisition acquisition = acquisition_of(camera->view(), 2e-3);
  Pixels pixels = superpixels(camera->view(), 3, 4);

  /// @param written parameters, as in a model file
  EffectPtr effect(const std::string& name, const std::string& written) const {
    const graph::Plugin& plugin = graph::load_plugin(graph::plugin_file(frozen + "/tofgraph_effect_" + name + ".so"));
    config::Diagnostics diagnostics;
    const config::Value document = config::parse_document("test", written);
    std::vector<const config::Entry*> entries;
    for (const config::Entry& entry : document.entries) entries.push_back(&entry);
    const auto values = std::make_shared<const graph::ParameterValues>(plugin, entries, document.at, diagnostics);
    EXPECT_TRUE(diagnostics.ok()) << diagnostics.text();
    return std::make_shared<const Effect>(plugin, values->data(), camera->view(), values);
  }

  std::vector<double> taps(const std::vector<EffectPtr>& effects) const {
    const ForwardModel model(camera->view(), true, effects);
    return model.expect(board_tracer(camera->view().focal_length, {1.3, 0.1, -0.2, 0.6}), acquisition, pixels).taps;
  }
  double c(const std::vector<double>& taps, std::size_t k, std::size_t i) const {
    return taps[2 * k * pixels.size() + i] - taps[(2 * k + 1) * pixels.size() + i];
  }
  double intensity(const std::vector<double>& taps, std::size_t k, std::size_t i) const {
    return (taps[2 * k * pixels.size() + i] + taps[(2 * k + 1) * pixels.size() + i]) / 2;
  }
  std::complex<double> phasor(const std::vector<double>& taps, std::size_t i) const {
    return {(c(taps, 0, i) - c(taps, 2, i)) / 2, (c(taps, 3, i) - c(taps, 1, i)) / 2};
  }
};

TEST_F(FrozenEffect, ScalesEachSourceByItsPlace) {
  const EffectPtr scales = effect("frozen_light", "{gain: 2, turn: 0.25 rad}");
  const double factors[] = {2, 3};
  for (std::size_t source = 0; source < 2; ++source) {
    acquisition.on = {source == 0, source == 1};
    const std::vector<double> before = taps({}), after = taps({scales});
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const std::complex<double> ratio = phasor(after, i) / phasor(before, i);
      EXPECT_NEAR(std::abs(ratio), factors[source], 1e-12);
      EXPECT_NEAR(std::arg(ratio), 0.25, 1e-12);
      EXPECT_NEAR(intensity(after, 0, i) / intensity(before, 0, i), factors[source], 1e-12);
    }
  }
}

TEST_F(FrozenEffect, MovesEachExposureByItsPlace) {
  const std::vector<double> before = taps({}), after = taps({effect("frozen_steps", "{step: 0.1 rad}")});
  const double moved[] = {0.1, M_PI / 2 + 0.2, M_PI + 0.3, 3 * M_PI / 2 + 0.4};
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::complex<double> light = phasor(before, i);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(c(after, k, i), (light * std::polar(1.0, moved[k])).real(), 1e-9 * std::abs(light));
      EXPECT_NEAR(intensity(after, k, i) - intensity(before, k, i), 20, 1e-9);  // 20 MHz
    }
  }
}

}  // namespace
}  // namespace tofgraph::simulation
