// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Grouping of nodes into tasks: which of them run for several frames at once.
#include "graph/segments.hpp"

#include <gtest/gtest.h>

#include "config/diagnostics.hpp"
#include "graph/pipeline.hpp"
#include "graph/plugin.hpp"

namespace tofgraph::graph {
namespace {

std::vector<Segment> segments_with_receiver(const std::string& receiver) {
  GraphOptions options;
  options.plugin_folders = plugin_path({TOFGRAPH_BINARY_DIR "/tests/plugins"});
  config::Diagnostics diagnostics;
  const auto graph = build_graph(document_of("ramp frames=1 ! make_depth ! null", ""), {}, options, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return segments_of(*graph, [&](const Node& node) { return node.name == receiver; });
}

TEST(Segments, AReceivedNodeWithoutStateStaysParallel) {
  const std::vector<Segment> segments = segments_with_receiver("make_depth");
  ASSERT_GE(segments.size(), 3U);
  EXPECT_FALSE(segments[0].ordered);
  EXPECT_EQ(segments[0].nodes, std::vector<std::size_t>{1});
  EXPECT_FALSE(segments[0].received.has_value());
  EXPECT_TRUE(segments[1].ordered) << "the frames are handed over in order";
  EXPECT_TRUE(segments[1].nodes.empty());
  EXPECT_EQ(segments[1].received, 1U);
  EXPECT_EQ(segments[2].nodes, std::vector<std::size_t>{2});
}

TEST(Segments, TheSourceIsReceivedBeforeTheOtherNodes) {
  const std::vector<Segment> segments = segments_with_receiver("ramp");
  ASSERT_GE(segments.size(), 2U);
  EXPECT_TRUE(segments[0].ordered);
  EXPECT_TRUE(segments[0].nodes.empty());
  EXPECT_EQ(segments[0].received, 0U);
  EXPECT_FALSE(segments[1].ordered);
  EXPECT_EQ(segments[1].nodes.front(), 1U);
}

}  // namespace
}  // namespace tofgraph::graph
