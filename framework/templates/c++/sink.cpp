// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/stage.hpp>

#include <fstream>
#include <stdexcept>
#include <vector>

/// A stage is a class whose members define the channels it reads and its parameters.
struct MyPlugin final : tofgraph::Sink {
  In<float> depth{this, "depth"};
  Param<tofgraph::OutputFile> path{this, "path", {.required = true, .text = "the table, e.g. out/means.csv"}};

  /// Called once per frame. Not const, so frames are processed one at a time, in order.
  void process(Frame& frame) {
    double sum = 0, count = 0;
    for (const float z : depth(frame)) {
      if (z != z) continue;  // an invalid pixel is NaN
      sum += static_cast<double>(z);
      ++count;
    }
    means_.push_back(sum / count);
  }

  /// Called after the last frame. The file appears complete or not at all.
  void finish() {
    std::ofstream out(path.create());
    out << "frame,mean_m\n";
    for (std::size_t i = 0; i < means_.size(); ++i) out << i << ',' << means_[i] << '\n';
    if (!out.flush()) throw std::runtime_error("the file cannot be written");
  }

 private:
  std::vector<double> means_;
};
TOFGRAPH_STAGE(MyPlugin, "Mean depth of each frame as a table")
