// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: PmdRawReader.HashesA*
// Rooms: graph cli
// Dumps are written here byte by byte, from the documented layout alone.
#include "tests/program.hpp"

#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace tofgraph {
namespace {

constexpr std::size_t size = 204;

/// A value that differs for every frame, phase, tap and pixel.
std::uint16_t value(std::size_t frame, std::size_t k, std::size_t tap, std::size_t pixel) {
  return static_cast<std::uint16_t>(pixel * 7 + k * 11003 + tap * 5501 + frame * 257);
}

std::string dump(std::size_t frames, const std::array<std::size_t, 4>& order, std::size_t frame_header) {
  std::string bytes;
  for (std::size_t f = 0; f < frames; ++f) {
    bytes.append(frame_header, 'F');
    for (const std::size_t k : order) {
      bytes.append(512, static_cast<char>('a' + k));
      for (std::size_t p = 0; p < size * size; ++p) {
        for (std::size_t tap = 0; tap < 2; ++tap) {
          const std::uint16_t v = value(f, k, tap, p);
          bytes.push_back(static_cast<char>(v >> 8U));
          bytes.push_back(static_cast<char>(v & 255U));
        }
      }
    }
  }
  return bytes;
}

void expect_frame(const Harness& stage, std::size_t frame) {
  const auto taps = stage.get<std::uint16_t>("taps");
  const auto headers = stage.get<std::uint8_t>("raw_headers");
  ASSERT_EQ(stage.extent("taps"), (std::vector<std::uint64_t>{4, 2, size, size}));
  std::size_t wrong = 0, i = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(headers[512 * k], 'a' + k);
    for (std::size_t tap = 0; tap < 2; ++tap) {
      for (std::size_t p = 0; p < size * size; ++p) wrong += taps[i++] != value(frame, k, tap, p) ? 1U : 0U;
    }
  }
  EXPECT_EQ(wrong, 0U);
}

TEST(PmdRawReader, ReadsBitForBitInEveryPhaseOrder) {
  const tests::TemporaryFolder folder;
  std::array<std::size_t, 4> order = {0, 1, 2, 3};
  do {
    const auto file = folder.path() / "dump.raw";
    tests::write_text(file, dump(2, order, 0));
    std::string line = "pmd_raw_reader file=" + file.string() + " phase_order=[";
    for (const std::size_t k : order) line += std::to_string(k) + (k == order[3] ? "]" : ", ");
    Harness stage(line);
    stage.camera("camcube2");
    for (std::size_t f = 0; f < 2; ++f) {
      ASSERT_TRUE(stage.run());
      expect_frame(stage, f);
    }
    EXPECT_FALSE(stage.run());
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(PmdRawReader, AFrameIs667904Bytes) { EXPECT_EQ(dump(1, {3, 2, 1, 0}, 0).size(), 667904U); }

TEST(PmdRawReader, PassesOverAFrameHeader) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "dump.raw";
  tests::write_text(file, dump(3, {3, 2, 1, 0}, 512));
  Harness stage("pmd_raw_reader frame_header=512 file=" + file.string());
  stage.camera("camcube2");
  for (std::size_t f = 0; f < 3; ++f) {
    ASSERT_TRUE(stage.run());
    expect_frame(stage, f);
  }
  EXPECT_FALSE(stage.run());
}

TEST(PmdRawReader, ReadsTheWholeFramesAndReportsTheRest) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "dump.raw";
  tests::write_text(file, dump(2, {3, 2, 1, 0}, 0).substr(0, 667904 + 1000));
  Harness stage("pmd_raw_reader file=" + file.string());
  stage.camera("camcube2");
  ASSERT_TRUE(stage.run());
  expect_frame(stage, 0);
  EXPECT_FALSE(stage.run());
  ASSERT_EQ(stage.messages().size(), 1U);
  EXPECT_NE(stage.messages()[0].find("1 frame of 667904 bytes read, the last 1000 bytes are not"), std::string::npos)
      << stage.messages()[0];
}

TEST(PmdRawReader, HashesALongDumpAsWell) {
  const tests::TemporaryFolder folder;
  tests::write_text(folder.path() / "long.raw", dump(1, {3, 2, 1, 0}, 0));
  std::filesystem::resize_file(folder.path() / "long.raw", 500 * 667904);  // 334 MB, mostly a sparse hole
  const tests::Outcome told =
      tests::shell("\"$TOFGRAPH\" explain 'pmd_raw_reader file=long.raw ! null' --camera camcube2", folder.path());
  EXPECT_EQ(told.exit_code, 0) << told.err;
  const std::string path = (folder.path() / "long.raw").string();
  EXPECT_EQ(told.err, "");
  const std::string sum = tests::shell("sha256sum long.raw", folder.path()).out.substr(0, 64);
  EXPECT_NE(told.out.find("uses " + path + " (SHA-256 " + sum + ")"), std::string::npos) << told.out;
}

TEST(PmdRawReader, SaysWhatIsWrong) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "dump.raw";
  tests::write_text(file, "short");
  const auto said = [&](const std::string& line) -> std::string {
    try {
      Harness stage(line);
      stage.camera("camcube2");
      stage.run();
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(
      said("pmd_raw_reader file=" + file.string()).find("has 5 bytes, less than one frame of 667904 (204 x 204 px)"),
      std::string::npos);
  EXPECT_NE(said("pmd_raw_reader file=/nowhere.raw").find("cannot read /nowhere.raw"), std::string::npos);
  EXPECT_NE(said("pmd_raw_reader file=" + file.string() + " phase_order=[0, 1, 2, 2]").find("each of 0, 1, 2, 3 once"),
            std::string::npos);
}

}  // namespace
}  // namespace tofgraph
