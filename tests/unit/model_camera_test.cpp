// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A model whose camera is a path to a profile: the camera it refers to, and its path in the extended model.
#include <gtest/gtest.h>

#include "diagnosis/data/superpixels.hpp"
#include "diagnosis/diagnose.hpp"
#include "io/profile.hpp"
#include "tests/program.hpp"

namespace tofgraph::diagnosis {
namespace {

namespace fs = std::filesystem;
using tests::write_text;

class ModelCamera : public testing::Test {
 protected:
  ModelCamera() {
    fs::create_directory(folder.path() / "models");
    fs::copy_file(TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml", folder.path() / "mine.yaml");
    write_text(folder.path() / "table.csv", "depth,seen,time\n0.8,0.801,2\n1.3,1.302,2\n1.9,1.898,2\n2.6,2.601,2\n");
    write_text(folder.path() / "table.yaml",
               "campaign: 1\ncamera: camcube2\ntable:\n  file: table.csv\n  distance: {column: depth, unit: m}\n"
               "  integration_time: {column: time, unit: ms}\n  measured_depth: {column: seen, unit: m}\n");
  }
  std::unique_ptr<Diagnosis> diagnosed(const std::string& camera) const {
    write_text(folder.path() / "models/model.yaml", "model: 1\ncamera: " + camera + "\neffects: []\n");
    return diagnose(catalogue, {.model = folder.path() / "models/model.yaml", .data = folder.path() / "table.yaml"});
  }
  const graph::PluginRegistry catalogue{graph::plugin_path({})};
  tests::TemporaryFolder folder;
};

TEST_F(ModelCamera, ByItsPathIsTheOneOfThatName) {
  EXPECT_NO_THROW(diagnosed("../mine.yaml"));
  EXPECT_THROW(diagnosed("camcube3"), config::ConfigurationError);
}

TEST_F(ModelCamera, IsFoundFromTheExtendedModelsFolder) {
  Diagnosis found;
  found.model.camera = "../mine.yaml";
  const auto source = std::make_shared<config::SourceText>();
  source->base = folder.path() / "models";
  found.model.camera_at.source = source;
  EXPECT_EQ(model_yaml(found),
            "model: 1\ncamera: \"" + (folder.path() / "mine.yaml").string() + "\"\nlight: reference\neffects: []\n");
  found.model.camera = "camcube2";
  EXPECT_EQ(model_yaml(found), "model: 1\ncamera: camcube2\nlight: reference\neffects: []\n");
}

/// Advice must not suggest the noise values of another camera, since users would adopt them.
TEST(OneFrame, WithoutNoiseInTheProfileIsRefusedWithoutNumbers) {
  FrameSums sums(FrameSums::Kind::taps, 1, 1);
  sums.add_taps(std::vector<std::uint16_t>(8, 100), 1000);
  ReductionCounts counts;
  try {
    reduce(sums, {}, 1, {}, 1, {0, 0, 0, 0}, counts);
    FAIL();
  } catch (const std::invalid_argument& error) {
    const std::string said = error.what();
    EXPECT_NE(said.find("read_noise and shot_noise"), std::string::npos) << said;
    EXPECT_EQ(said.find_first_of("0123456789"), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace tofgraph::diagnosis
