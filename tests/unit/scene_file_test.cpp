// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Scene files: their content, and the conditions of a sequence. Errors: tests/fixtures/errors/scene_*.
#include "simulation/files/scene_file.hpp"
#include "tests/program.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "simulation/files/objects.hpp"
#include "simulation/scene.hpp"
#include "simulation/scene_text.hpp"

namespace tofgraph::simulation {
namespace {

SceneFile read(const std::string& text) {
  config::Diagnostics diagnostics;
  SceneFile scene = read_scene(config::parse_document("s.yaml", "scene: 1\ncamera: camcube2\n" + text), diagnostics);
  EXPECT_TRUE(diagnostics.ok()) << diagnostics.text();
  return scene;
}

TEST(SceneFile, ReadsWhatTheFormatHas) {
  const SceneFile scene = read(
      "name: all\nmodel: {light: physical, effects: []}\nframes: 7\noutput: [taps, distance]\n"
      "noise: {read_noise: 2 counts, shot_noise: 0.02 counts}\nintegration_time: 3 ms\nseed: 9\nsubpixels: 3\n"
      "sources: right\nambient: lamp\nroll: 90 deg\ntemperature: 25 degC\ntime_since_power_on: 2 h\nvelocity: 12 "
      "mm/ms\n"
      "target: white\nreference: laser\nlens: open\nrail: covered\n"
      "objects: [{type: sphere, position: [10 mm, 20 mm, 3 m], radius: 200 mm, reflectivity: 0.5,\n"
      "           surface: {specular: 0.4, exponent: 20}, velocity: [1 m/s, 2 m/s, 3 m/s]}]\n");
  EXPECT_EQ(scene.name, "all");
  EXPECT_EQ(scene.model->find("light")->value.text, "physical");
  EXPECT_EQ(scene.frames, 7);
  EXPECT_THAT(scene.output, testing::ElementsAre("taps", "distance"));
  EXPECT_EQ(scene.noise.from, SceneNoise::From::scene);
  EXPECT_EQ(scene.noise.read_noise, 2);
  EXPECT_EQ(scene.noise.shot_noise, 0.02);
  EXPECT_EQ(scene.seed, 9);
  EXPECT_EQ(scene.subpixels, 3);
  const auto conditions = expand(scene);
  ASSERT_EQ(conditions.size(), 1U);
  const SceneCondition& c = conditions[0];
  EXPECT_DOUBLE_EQ(c.integration_time, 3e-3);
  EXPECT_THAT(c.sources, testing::ElementsAre("right"));
  EXPECT_EQ(c.ambient, "lamp");
  EXPECT_DOUBLE_EQ(c.roll, M_PI / 2);
  EXPECT_DOUBLE_EQ(c.temperature, 298.15);
  EXPECT_DOUBLE_EQ(c.time_since_power_on, 7200);
  EXPECT_DOUBLE_EQ(c.velocity, 12);
  EXPECT_EQ(c.target + c.reference + c.lens + c.rail, "whitelaseropencovered");
  EXPECT_FALSE(c.has_board());
  const Object& sphere = c.objects->all.at(0);
  EXPECT_EQ(sphere.name, "sphere");
  EXPECT_DOUBLE_EQ(std::get<Sphere>(sphere.form).position.y, 0.02);
  EXPECT_DOUBLE_EQ(std::get<Sphere>(sphere.form).radius, 0.2);
  EXPECT_DOUBLE_EQ(sphere.reflectivity, 0.5);
  EXPECT_DOUBLE_EQ(sphere.surface.specular, 0.4);
  EXPECT_DOUBLE_EQ(sphere.surface.exponent, 20);
  EXPECT_TRUE(sphere.surface.given);
  EXPECT_DOUBLE_EQ(sphere.velocity.z, 3);
}

TEST(SceneFile, DefaultsAreThoseOfTheFormat) {
  const SceneFile scene = read("objects: [{type: board, distance: 500 mm}]\n");
  EXPECT_FALSE(scene.model);
  EXPECT_THAT(scene.output, testing::ElementsAre("phases"));
  EXPECT_EQ(scene.noise.from, SceneNoise::From::profile);
  const SceneCondition c = expand(scene).at(0);
  EXPECT_EQ(c.integration_time, 1e-3);
  EXPECT_TRUE(c.sources.empty());
  EXPECT_EQ(c.ambient, "dark");
  EXPECT_EQ(c.reflectivity, 0.85);
  EXPECT_EQ(c.board_distance, 0.5);
  EXPECT_EQ(c.board_tilt_x, 0);
  EXPECT_FALSE(c.board_size);
}

TEST(Sequence, IsAProductWithTheLastStepFastest) {
  const SceneFile scene = read(
      "objects: [{name: wall, type: board, distance: 500 mm}]\nsequence:\n"
      "  - {keys: [target, wall.reflectivity], values: [[white, 0.8], [black, 0.1]]}\n"
      "  - {key: wall.distance, values: [500 mm, 1 m, 2 m]}\n"
      "  - {key: sources, values: [both, left, [left, right]]}\n"
      "  - {key: integration_time, values: [0.5 ms, 1 ms]}\n");
  const auto conditions = expand(scene);
  ASSERT_EQ(conditions.size(), 36U);
  const double distances[] = {0.5, 1, 2};
  std::set<std::string> ids;
  for (std::size_t i = 0; i < 36; ++i) {
    const SceneCondition& c = conditions[i];
    EXPECT_EQ(c.target, i < 18 ? "white" : "black");
    EXPECT_EQ(c.reflectivity, i < 18 ? 0.8 : 0.1);
    EXPECT_EQ(c.board_distance, distances[i / 6 % 3]);
    EXPECT_EQ(std::get<Board>(c.objects->all[0].form).target.distance, c.board_distance);
    EXPECT_EQ(c.sources.size(), i / 2 % 3);
    EXPECT_DOUBLE_EQ(c.integration_time, i % 2 == 0 ? 0.5e-3 : 1e-3);
    ids.insert(c.id);
  }
  EXPECT_EQ(ids.size(), 36U);
  EXPECT_EQ(conditions[35].id, "0035_black_0.1_2m_1ms");
}

TEST(Sequence, ConditionsWithoutALabelShareOneOnlyWithTheirReflectivity) {
  const auto conditions =
      expand(read("objects: [{type: board, distance: 500 mm}]\nsequence:\n  - {key: board.reflectivity, values: [0.8, "
                  "0.1, 0.8]}\n"));
  EXPECT_NE(conditions[0].target, conditions[1].target);
  EXPECT_EQ(conditions[0].target, conditions[2].target);
}

TEST(SceneFile, AConditionIsWrittenAsASceneOfItsOwn) {
  const tests::TemporaryFolder folder;
  tests::write_text(folder.path() / "in/a b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  tests::write_text(
      folder.path() / "in/scene.yaml",
      "scene: 1\ncamera: camcube2\nintegration_time: 2 ms\nobjects:\n"
      "  - {name: 'a: b', type: board, distance: 500 mm, size: [1 m, 2 m], surface: {roughness: 0.1 rad}}\n"
      "  - {type: mesh, file: a b.obj, position: [-1 mm, 2e-3 m, 1 m]}\nsequence:\n"
      "  - {key: 'a: b.distance', values: [1 m, 2 m]}\n  - {key: mesh.unit, values: [1 m, 1 mm]}\n");
  config::Diagnostics diagnostics;
  const SceneFile scene = read_scene(folder.path() / "in/scene.yaml", diagnostics);
  ASSERT_TRUE(diagnostics.ok()) << diagnostics.text();
  tests::write_text(folder.path() / "out/deep/third.yaml", scene_text(document_of(scene, 3)));
  const SceneFile again = read_scene(folder.path() / "out/deep/third.yaml", diagnostics);
  ASSERT_TRUE(diagnostics.ok()) << diagnostics.text();
  EXPECT_TRUE(again.sequence.empty());
  EXPECT_EQ(again.settings.integration_time, 2e-3);
  const Objects objects = *expand(again).at(0).objects;
  EXPECT_EQ(objects.all.at(0).name, "a: b");
  EXPECT_EQ(std::get<Board>(objects.all[0].form).target.distance, 2);
  EXPECT_EQ(std::get<Board>(objects.all[0].form).height, 2);
  EXPECT_EQ(objects.all[0].surface.roughness, 0.1);
  const MeshObject& mesh = std::get<MeshObject>(objects.all[1].form);
  EXPECT_TRUE(std::filesystem::equivalent(mesh.file, folder.path() / "in/a b.obj"));
  EXPECT_EQ(mesh.unit, 1e-3);
  EXPECT_EQ(mesh.placement.position.x, -1e-3);
  EXPECT_FALSE(expand(again).at(0).has_board()) << "a board is not all there is";
}

TEST(SceneFile, KnowsItsChessboard) {
  const std::string pattern = "{type: chessboard, distance: 600 mm, columns: 8, rows: 6, square: 30 mm}";
  EXPECT_FALSE(pattern_of(read("objects: [{type: board, distance: 1 m}]\n")));
  const auto one = pattern_of(read("objects: [{type: board, distance: 1 m}, " + pattern + "]\n"));
  ASSERT_TRUE(one);
  EXPECT_EQ(one->columns, 8);
  EXPECT_EQ(one->rows, 6);
  EXPECT_DOUBLE_EQ(one->square, 0.03);
  EXPECT_FALSE(pattern_of(read("objects: [" + pattern + ", " + pattern + "]\n")));
}

TEST(SceneFiles, ThoseThatComeWithTheProjectMakeTheirWorlds) {
  const std::filesystem::path folder = TOFGRAPH_SOURCE_DIR "/pipelines";
  std::map<std::string, std::size_t> counts;
  for (const char* sub : {"scenes", "campaigns"}) {
    for (const auto& entry : std::filesystem::directory_iterator(folder / sub)) {
      if (entry.path().extension() != ".yaml") continue;
      if (config::load_document(entry.path()).entries.front().key != "scene") continue;  // tables and their model
      config::Diagnostics diagnostics;
      const SceneFile scene = read_scene(entry.path(), diagnostics);
      ASSERT_TRUE(diagnostics.ok()) << diagnostics.text();
      const auto conditions = expand(scene);
      counts[entry.path().stem().string()] = conditions.size();
      const std::vector<Vector3> axis = {{0, 0, 1}};
      for (const SceneCondition& condition : conditions) {
        std::vector<Hit> hits(1);
        make_world(scene, condition).trace(axis, hits);
        EXPECT_TRUE(std::isfinite(hits[0].return_path)) << condition.id;
      }
    }
  }
  EXPECT_EQ(counts["thesis_protocol"], 6U * 15U * 4U);
  EXPECT_EQ(counts["thesis_protocol_full"], 6U * 15U * 21U);
  EXPECT_EQ(counts["chessboard_views"], 25U);
  EXPECT_EQ(counts["boxes"], 1U);
}

TEST(SceneFiles, EveryChessboardViewIsWholeInTheImage) {
  config::Diagnostics diagnostics;
  const SceneFile scene =
      read_scene(std::filesystem::path(TOFGRAPH_SOURCE_DIR "/pipelines/campaigns/chessboard_views.yaml"), diagnostics);
  ASSERT_TRUE(diagnostics.ok()) << diagnostics.text();
  const double half_view = 0.5 * 204 * 40e-6 / 12.8e-3;  // tangent at the image's border
  double left = 1, right = -1, top = 1, bottom = -1;
  for (const SceneCondition& condition : expand(scene)) {
    const auto& board = std::get<Chessboard>(condition.objects->all.at(1).form);
    const Pose pose = board.target.pose();
    for (const double x : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        const Vector3 p = pose.position + pose.rotation * Vector3{x * board.width(), y * board.height(), 0};
        const double across = p.x / (p.z - 12.8e-3), down = p.y / (p.z - 12.8e-3);
        EXPECT_LT(std::abs(across), half_view) << condition.id;
        EXPECT_LT(std::abs(down), half_view) << condition.id;
        left = std::min(left, across);
        right = std::max(right, across);
        top = std::min(top, down);
        bottom = std::max(bottom, down);
      }
    }
  }
  for (const double reached : {-left, right, -top, bottom}) EXPECT_GT(reached, 0.8 * half_view);
}

TEST(Check, NeedsNoLibraryOfTheSimulator) {
  const tests::Outcome linked = tests::shell("ldd \"$TOFGRAPH\"", ".");
  EXPECT_THAT(linked.out, testing::HasSubstr("libtofgraph"));
  for (const char* library : {"embree", "opencv", "hdf5"})
    EXPECT_THAT(linked.out, testing::Not(testing::HasSubstr(library)));
}

}  // namespace
}  // namespace tofgraph::simulation
