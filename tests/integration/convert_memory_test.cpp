// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: ConvertMemory.*
// Rooms: foreign plugins io
// The memory of a conversion does not grow with the number of frames, however small these are.
#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/resource.h>

#include "tests/small_conversion.hpp"

using namespace tofgraph::tests;

namespace {

class ConvertMemory : public SmallConversion {
 protected:
  /// Converts `frames` frames of 8 x 6 px. @returns peak memory of the largest program started so far, bytes
  std::size_t peak_memory(std::size_t frames) const {
    write_text(path("tiny_layout.yaml"),
               "layout: 1\nframe_rate: 30 Hz\narrays:\n  raw: {type: uint16, shape: [6, 8]}\nchannels:\n"
               "  depth: {array: raw, axes: row column, unit: mm}\n");
    const std::string two = "\xdc\x05";  // 1500
    std::string bytes;
    for (std::size_t i = 0; i < frames * small_pixels; ++i) bytes += two;
    write_text(path("tiny.raw"), bytes);
    const Outcome outcome = convert("tiny.raw --layout tiny_layout.yaml");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(this->frames<std::int64_t>("timestamp_ns").size(), frames);
    rusage used{};
    getrusage(RUSAGE_CHILDREN, &used);
    return static_cast<std::size_t>(used.ru_maxrss) * 1024;
  }
};

TEST_F(ConvertMemory, DoesNotGrowWithTheNumberOfFrames) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer has memory of its own";
#endif
  const std::size_t few = peak_memory(30'000), many = peak_memory(90'000);
  std::printf("peak memory: %.1f MB for 30000 frames, %.1f MB for 90000\n", 1e-6 * static_cast<double>(few),
              1e-6 * static_cast<double>(many));
  // The first may fill the queue of the capture writer, of 16 MB, only partly; 60 000 frames with their views and
  // metadata would take 50 MB.
  EXPECT_LT(many - few, 32'000'000U);
  EXPECT_LT(many, 250'000'000U);
}

}  // namespace
