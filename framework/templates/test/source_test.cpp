// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Tests the source as in a run: my_plugin_test FOLDER_OF_THE_PLUGIN
#include <tofgraph/harness.hpp>

#include <cstdio>

int main(int, char** argv) {
  try {
    tofgraph::Harness stage("my_plugin frames=2 speed='0.5 m'", {argv[1]});
    stage.camera("camcube2");
    const bool first = stage.run(), second = stage.run();
    const float depth = stage.get<float>("depth").at(0);
    if (first && second && depth == 1.5F && !stage.run()) return 0;
    std::fprintf(stderr, "got %g, expected 1.5 in the second and last frame\n", depth);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
  }
  return 1;
}
