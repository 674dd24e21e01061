// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/camera_spec.hpp"

#include "graph/pipeline.hpp"

#include <gmock/gmock.h>

namespace tofgraph::graph {
namespace {

/// "stage=camcube backend=usb"
std::string node_of(const std::string& spec) {
  const auto source = std::make_shared<config::SourceText>(config::SourceText{"--camera", spec});
  std::string text;
  for (const config::Entry& entry : camera_node(spec, {source, 1, 1, spec.size()}).entries)
    text += (text.empty() ? "" : " ") + entry.key + "=" + entry.value.text;
  return text;
}

std::string refused(const std::string& spec) {
  try {
    node_of(spec);
  } catch (const config::ConfigurationError& error) {
    return error.what();
  }
  return "";
}

TEST(CameraSpec, IsTheStageCamcubeWithItsBackend) {
  EXPECT_EQ(node_of("camcube"), "stage=camcube");
  EXPECT_EQ(node_of("camcube:usb"), "stage=camcube backend=usb");
  EXPECT_EQ(node_of("camcube:pmdsdk"), "stage=camcube backend=pmdsdk");
  EXPECT_EQ(node_of("replay:a/b.h5"), "stage=camcube backend=replay file=a/b.h5");
  EXPECT_EQ(node_of("simulated:c:d.yaml"), "stage=camcube backend=simulated scene=c:d.yaml");
  EXPECT_EQ(node_of("replay:'a b.h5'"), "stage=camcube backend=replay file=a b.h5");
}

TEST(CameraSpec, IsRefusedWithWhatIsExpected) {
  EXPECT_EQ(refused("camcube:bluetooth"),
            "--camera:1:1: error: a camcube is reached by usb or pmdsdk, not by 'bluetooth'\n"
            "     1 | camcube:bluetooth\n"
            "       | ^~~~~~~~~~~~~~~~~\n"
            "         example: camcube:usb\n");
  EXPECT_THAT(refused("replay"), testing::HasSubstr("'replay' names no file"));
  EXPECT_THAT(refused("simulated:"), testing::HasSubstr("example: simulated:pipelines/scenes/board.yaml"));
  EXPECT_THAT(refused("simulatd:a.yaml"), testing::HasSubstr("did you mean 'simulated'?"));
  EXPECT_THAT(refused(""), testing::HasSubstr("camcube, camcube:usb, camcube:pmdsdk, replay:FILE"));
}

TEST(CameraSpec, StandsInThePlaceOfAStageInOneLine) {
  const config::Value document = pipeline_from_line("simulated:s.yaml frame_rate='20 Hz' ! null", "");
  const config::Value& node = document.find("nodes")->value.items.front();
  EXPECT_EQ(node.find("stage")->value.text, "camcube");
  EXPECT_EQ(node.find("scene")->value.text, "s.yaml");
  EXPECT_EQ(node.find("scene")->value.at.column, 11U);
  EXPECT_EQ(node.find("frame_rate")->value.text, "20 Hz");
}

}  // namespace
}  // namespace tofgraph::graph
