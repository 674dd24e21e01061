// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Tests the sink as in a run: my_plugin_test FOLDER_OF_THE_PLUGIN
#include <tofgraph/harness.hpp>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>

int main(int, char** argv) {
  try {
    tofgraph::Harness stage("my_plugin path=means.csv overwrite=true", {argv[1]});
    stage.put<float>("depth", {1, 3}, {1, 2, NAN});
    stage.run();
    stage.finish();
    std::ifstream file("means.csv");
    const std::string table{std::istreambuf_iterator<char>(file), {}};
    if (table == "frame,mean_m\n0,1.5\n") return 0;
    std::fprintf(stderr, "got\n%s", table.c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
  }
  return 1;
}
