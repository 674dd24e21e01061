// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Tests the filter as in a run: my_plugin_test FOLDER_OF_THE_PLUGIN
#include <tofgraph/harness.hpp>

#include <cmath>
#include <cstdio>

int main(int, char** argv) {
  try {
    tofgraph::Harness stage("my_plugin factor=2", {argv[1]});
    stage.put<float>("depth", {1, 3}, {1, 2.5, NAN});
    stage.run();
    const std::vector<float> depth = stage.get<float>("depth");
    if (depth[0] == 2 && depth[1] == 5 && std::isnan(depth[2])) return 0;
    std::fprintf(stderr, "got %g %g %g, expected 2 5 nan\n", depth[0], depth[1], depth[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
  }
  return 1;
}
