// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A pipeline inside another program: the run ends cleanly, whatever its callbacks do.
#include <gtest/gtest.h>
#include <tofgraph/pipeline.hpp>

#include <atomic>
#include <stdexcept>

#include "tests/program.hpp"

namespace tofgraph::tests {
namespace {

template <class Thrown> std::string error_of(const std::string& node, Thrown thrown) {
  Pipeline pipeline("ramp frames=500 ! make_depth ! null");
  pipeline.plugin_path({TOFGRAPH_BINARY_DIR "/tests/plugins"});
  pipeline.on_frame(node, [&](const Frame& frame) {
    if (frame.metadata().number == 7) throw thrown;
  });
  try {
    pipeline.run(0, 2);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(Embedding, WhatACallbackThrowsEndsTheRun) {
  EXPECT_EQ(error_of("make_depth", std::runtime_error("the window is closed")),
            "node 'make_depth' (make_depth), frame 7: the window is closed");
  EXPECT_EQ(error_of("make_depth", 5),
            "node 'make_depth' (make_depth), frame 7: threw something that is not a std::exception");
  EXPECT_EQ(error_of("ramp", 5), "node 'ramp' (ramp), frame 7: threw something that is not a std::exception");
}

TEST(Embedding, ACallbackHasTheFramesOfAParallelNodeInOrder) {
  constexpr std::uint64_t frames = 40;
  Pipeline pipeline("ramp frames=40 ! make_depth pause='2 ms' ! null");
  pipeline.plugin_path({TOFGRAPH_BINARY_DIR "/tests/plugins"});
  std::uint64_t next = 0;
  pipeline.on_frame("make_depth", [&](const Frame& frame) { EXPECT_EQ(frame.metadata().number, next++); });
  pipeline.run(0, 4);
  EXPECT_EQ(next, frames);
}

TEST(Embedding, StopFromACallbackEndsTheRun) {
  Pipeline pipeline("ramp frames=0 ! make_depth ! null");
  pipeline.plugin_path({TOFGRAPH_BINARY_DIR "/tests/plugins"});
  std::atomic<int> seen{0};
  pipeline.on_frame("make_depth", [&](const Frame&) {
    if (++seen == 20) pipeline.stop();
  });
  const Pipeline::Result result = pipeline.run();
  EXPECT_TRUE(result.interrupted);
  EXPECT_GE(result.frames, 20U);
  EXPECT_EQ(result.frames, static_cast<std::uint64_t>(seen.load())) << "frames under way are finished";
}

}  // namespace
}  // namespace tofgraph::tests
