// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Frames of a condition: within the capture, and of a single integration time.
#include "io/captures/condition_statistics.hpp"

#include <gmock/gmock.h>

#include "tests/small_capture.hpp"

namespace tofgraph::tests {
namespace {

TEST(ConditionStatistics, FramesOfSeveralIntegrationTimesAreRejected) {
  const TemporaryFolder folder;
  SmallCapture capture{.channels = {{"distance", std::vector(4, plane_ranges(1))}},
                       .flags = {},
                       .timestamps = {},
                       .times = {1e-3, 1e-3, 2e-3, 2e-3},
                       .power_on = {}};
  capture.write(folder.path() / "a.h5");
  const io::CaptureReader reader(folder.path() / "a.h5");
  EXPECT_NO_THROW(io::check_one_integration_time(reader, {0, 1}));
  EXPECT_NO_THROW(io::check_one_integration_time(reader, {2, 3}));
  EXPECT_THAT(
      [&] {
        io::check_one_integration_time(reader, {1, 2});
      },
      testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("1 ms and 2 ms")));
}

TEST(ConditionStatistics, AFrameBeyondTheCaptureIsRejected) {
  io::Condition condition;
  EXPECT_EQ(io::used_frames(condition, 4), (std::array<std::uint64_t, 2>{0, 3}));
  condition.frames = {1, 4};
  EXPECT_THAT([&] { io::used_frames(condition, 4); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("has 4 frames")));
  EXPECT_THAT([&] { io::used_frames({}, 0); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("has no frames")));
  EXPECT_EQ(io::used_frames(condition, 5), (std::array<std::uint64_t, 2>{1, 4}));
}

}  // namespace
}  // namespace tofgraph::tests
