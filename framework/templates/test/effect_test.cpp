// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Tests the effect in a simulation: my_plugin_test FOLDER_OF_THE_PLUGIN
#include <tofgraph/pipeline.hpp>

#include <cmath>
#include <cstdio>
#include <fstream>

/// Distance of the central pixel of a board, m, simulated with these effects.
static double distance_with(const std::string& effects, const char* folder) {
  std::ofstream("my_plugin_model.yaml") << "model: 1\neffects: [" << effects << "]\n";
  tofgraph::Pipeline pipeline(
      "simulator model=my_plugin_model.yaml distance='1 m' frames=1 noise=none ! four_phase_decoder ! null",
      "camcube2");
  pipeline.plugin_path({folder});
  double distance = 0;
  pipeline.on_frame("four_phase_decoder", [&](const tofgraph::Frame& frame) {
    const tofgraph::Array<const float> image(frame.find("distance"));
    distance = image(image.rows() / 2, image.columns() / 2);
  });
  pipeline.run();
  return distance;
}

int main(int, char** argv) {
  try {
    const double change = distance_with("{effect: my_plugin, size: 20 mm}", argv[1]) - distance_with("", argv[1]);
    if (std::abs(change - 0.02) < 1e-5) return 0;
    std::fprintf(stderr, "the distance changed by %g m, expected 0.02 m\n", change);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
  }
  return 1;
}
