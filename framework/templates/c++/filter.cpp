// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/stage.hpp>

/// A stage is a class whose members define the channels it reads and changes, and its parameters.
struct MyPlugin final : tofgraph::Filter {
  InOut<float> depth{this, "depth", {.text = "what is scaled"}};
  Param<double> factor{this, "factor", {.default_value = "1.01", .min = 0.5, .max = 2, .text = "multiplier"}};

  /// Called once per frame. const, so several frames may be processed at the same time.
  void process(Frame& frame) const {
    for (float& z : depth(frame)) z *= static_cast<float>(*factor);
  }
};
TOFGRAPH_STAGE(MyPlugin, "Multiplies the depth by a factor")
