// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/stage.hpp>

/// A stage is a class whose members define the channels it creates and its parameters.
struct MyPlugin final : tofgraph::Source {
  Out<float> depth{this, "depth"};
  Param<double> speed{this, "speed", {.unit = "m", .default_value = "10 mm", .text = "farther away in each frame"}};
  Param<std::int64_t> frames{this, "frames", {.default_value = "10", .min = 1, .text = "how many"}};

  /// Called before the first frame: announces the number of frames and the metadata that each of them has.
  void prepare(tofgraph::Setup& setup) {
    rows_ = setup.camera().height;
    columns_ = setup.camera().width;
    setup.set_frames(static_cast<std::uint64_t>(*frames), TOFGRAPH_KNOWS_TIMESTAMP);
  }

  /// Fills one frame. Returns false after the last one.
  bool process(Frame& frame) {
    if (next_ == *frames) return false;
    frame.metadata().timestamp_ns = next_ * 10'000'000;
    for (float& z : depth(frame, rows_, columns_)) z = static_cast<float>(1 + static_cast<double>(next_) * *speed);
    ++next_;
    return true;
  }

 private:
  std::size_t rows_ = 0, columns_ = 0;
  std::int64_t next_ = 0;
};
TOFGRAPH_STAGE(MyPlugin, "A wall that moves away")
