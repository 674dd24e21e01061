// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Example program that runs a pipeline and examines each cloud: embed PIPELINE NODE
#include <tofgraph/pcl.hpp>
#include <tofgraph/pipeline.hpp>

#include <cmath>
#include <cstdio>
#include <exception>

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: embed PIPELINE NODE\n");
    return 2;
  }
  try {
    tofgraph::Pipeline pipeline(argv[1]);
    pipeline.overwrite(true);
    pipeline.on_frame(argv[2], [](const tofgraph::Frame& frame) {
      const auto cloud = tofgraph::to_pcl(frame);
      double sum = 0;
      int valid = 0;
      for (const auto& point : *cloud) {
        if (!std::isfinite(point.z)) continue;
        sum += point.z;
        ++valid;
      }
      std::printf("frame %llu: %u x %u points, %d valid, mean depth %.4f m\n",
                  static_cast<unsigned long long>(frame.metadata().number), cloud->width, cloud->height, valid,
                  sum / valid);
    });
    const auto result = pipeline.run();
    std::printf("%llu frames in %.3f s\n", static_cast<unsigned long long>(result.frames), result.seconds);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
