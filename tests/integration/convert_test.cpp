// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Convert.NumPys*
// Rooms: foreign plugins
// Files written by NumPy and OpenCV, converted to captures.
#include <gmock/gmock.h>
#include <hdf5.h>

#include "tests/small_capture.hpp"
#include "tests/small_conversion.hpp"

#include <opencv2/imgcodecs.hpp>

#include <array>
#include <bit>
#include <cmath>
#include <fstream>
#include <limits>

using namespace tofgraph::tests;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

namespace {

constexpr std::size_t count = 5;  // number of frames written by Python

using Convert = SmallConversion;

/// 5 frames of 6 x 8 px, stored as `a` in every type, byte order and axis order; the expected result.
constexpr const char* arrays = R"(
import itertools, sys
rng = np.random.default_rng(3)
whole = rng.integers(1, 100, (5, 6, 8))
n = 0
for kind in ["f4", "f8", "u1", "u2", "u4", "u8", "i1", "i2", "i4", "i8"]:
    for order in "<>":
        for axes in itertools.permutations(range(3)):
            for layout in "CF":
                np.save(f"a{n}.npy", np.asarray(whole.transpose(axes), dtype=order + kind, order=layout))
                n += 1
whole.astype("<f4").tofile("expected.bin")
print(n)
)";

TEST_F(Convert, NumPysArraysOfAnyTypeAndOrderAreReadBitForBit) {
  if (!python(arrays)) GTEST_SKIP() << "NumPy is not installed";
  const std::vector<float> expected = stored<float>("expected.bin");
  // All permutations of (5, 6, 8) differ, so the camera of 8 x 6 px makes the axes unique. Testing every seventh keeps
  // it short and covers each type, byte order and axis order.
  for (int n = 0; n < 240; n += 7) {
    const Outcome outcome = convert("a" + std::to_string(n) + ".npy --as amplitude");
    ASSERT_EQ(outcome.exit_code, 0) << n << outcome.err;
    EXPECT_EQ(frames<float>("amplitude"), expected) << n;
  }
}

TEST_F(Convert, ArchivesStoredAndCompressedGiveAllTheirChannels) {
  if (!python(R"(
rng = np.random.default_rng(4)
z = rng.integers(300, 2000, (5, 6, 8)).astype("<u2")
z[1, 2, 3] = 0
z[2, 0, 0] = 65535
a = rng.random((5, 6, 8)).astype(">f8")
t = np.arange(5) * 33000 + 17
np.savez("stored.npz", z=z, conf=a, t=t)
np.savez_compressed("compressed.npz", z=z, conf=a, t=t)
d = z.astype("f4") * np.float32(1e-3)
(z.astype("f8") * 1e-3).astype("<f4").tofile("z.bin")
a.astype("<f4").tofile("a.bin")
)"))
    GTEST_SKIP() << "NumPy is not installed";
  write_text(path("layout.yaml"),
             "layout: 1\ncamera: ./tiny.yaml\nchannels:\n  depth: {array: z, unit: mm, invalid: [65535]}\n"
             "  amplitude: {array: conf}\ntimestamp: {array: t, unit: us}\nintegration_time: 2 ms\n");
  for (const std::string name : {"stored", "compressed"}) {
    const Outcome outcome = tofgraph("convert " + name + ".npz -o out.h5 --layout layout.yaml --force");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    std::vector<float> depth = frames<float>("depth"), expected = stored<float>("z.bin");
    const std::vector<std::uint16_t> flags = frames<std::uint16_t>("flags");
    const std::size_t zero = 48 + 2 * 8 + 3, code = 2 * 48;
    for (std::size_t i = 0; i < count * small_pixels; ++i) {
      const bool invalid = i == zero || i == code;
      EXPECT_EQ(flags[i], invalid ? 1 : 0) << i;
      EXPECT_EQ(std::isnan(depth[i]), invalid) << i;
      EXPECT_TRUE(invalid || depth[i] == expected[i]) << i;
    }
    EXPECT_EQ(frames<float>("amplitude"), stored<float>("a.bin"));
    EXPECT_EQ(frames<std::int64_t>("timestamp_ns")[4], (4 * 33000 + 17) * 1000);
    EXPECT_EQ(frames<double>("integration_time_s")[3], 2e-3);
  }
}

TEST_F(Convert, ASeriesOfPicturesIsInTheOrderOfItsNumbersAndItsGapsAreLostFrames) {
  for (const int number : {2, 9, 10, 11, 13}) {
    cv::Mat picture(6, 8, CV_16U, cv::Scalar(1000 + number));
    picture.at<std::uint16_t>(0, 0) = 0;
    cv::imwrite(path("depth_" + std::to_string(number) + ".png").string(), picture);
  }
  const Outcome outcome = convert("depth_9.png depth_1?.png --as depth --unit mm --frame-rate '10 Hz'");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("gaps: 1 number between 9 and 13 missing"));
  const std::vector<float> depth = frames<float>("depth");
  ASSERT_EQ(depth.size(), 4 * small_pixels);
  const double expected[] = {1.009, 1.010, 1.011, 1.013};
  for (std::size_t f = 0; f < 4; ++f) {
    EXPECT_TRUE(std::isnan(depth[f * small_pixels]));
    EXPECT_FLOAT_EQ(depth[f * small_pixels + 1], static_cast<float>(expected[f]));
  }
  EXPECT_EQ(frames<std::int64_t>("timestamp_ns")[3], 400'000'000);
  EXPECT_THAT(frames<std::uint64_t>("frame_number"), testing::ElementsAre(0, 1, 2, 4)) << "the gap is a lost frame";
  EXPECT_THAT(tofgraph("info out.h5 --json").out, HasSubstr("\"duration_s\": 0.4")) << "the clock starts at 0";
}

TEST_F(Convert, NamesAreSortedNaturally) {
  const std::vector<std::string> names = {"9.5.png",     "9.25.png",     "10.1.png",
                                          "take2_1.png", "take10_1.png", "take10_2.png"};
  int number = 0;
  for (const std::string& name : names)
    cv::imwrite(path(name).string(), cv::Mat(6, 8, CV_16U, cv::Scalar(1000 + number++)));
  ASSERT_EQ(convert("take10_2.png take2_1.png take10_1.png 10.1.png 9.25.png 9.5.png --as depth --unit mm").exit_code,
            0);
  const std::vector<float> depth = frames<float>("depth");
  const double expected[] = {1.000, 1.001, 1.002, 1.003, 1.004, 1.005};
  for (std::size_t f = 0; f < 6; ++f) EXPECT_FLOAT_EQ(depth[f * small_pixels], static_cast<float>(expected[f])) << f;
}

TEST_F(Convert, CountsLengthsThatCannotBeAndDoubtsAUnitThatCannotBe) {
  std::string text;
  for (std::size_t i = 0; i < small_pixels; ++i)
    text += (i % 8 == 0 ? "" : ",") + std::string(i == 3 ? "0" : i == 9 ? "-20" : "1500") + (i % 8 == 7 ? "\n" : "");
  write_text(path("z.csv"), text);
  const Outcome right = convert("z.csv --as depth --unit mm");
  ASSERT_EQ(right.exit_code, 0) << right.err;
  EXPECT_THAT(right.err, HasSubstr("2 of 48 values of depth in 1 frame are 0 m, negative or greater than"));
  EXPECT_THAT(right.err, testing::Not(HasSubstr("median")));
  EXPECT_EQ(frames<std::uint16_t>("flags")[9], 1);
  EXPECT_THAT(convert("z.csv --as depth --unit mm --invalid -20,1234").err,
              HasSubstr("state it, e.g. --invalid 0,-20,1234 (in a layout or a pipeline: invalid: [0, -20, 1234])"))
      << "the option replaces the stated codes";
  EXPECT_THAT(convert("z.csv --as depth --unit mm --invalid 0,-20").err, testing::Not(HasSubstr("taken as invalid")));
  EXPECT_THAT(convert("z.csv --as depth --unit m").err,
              testing::AllOf(HasSubstr("the median of depth is 1500 m"), HasSubstr("in mm (1500 mm = 1.5 m)")));
}

TEST_F(Convert, FlagsOfTheFileAndThoseOfItsValuesAreJoinedAndSigmaBelongsToItsLength) {
  if (!python(R"(
z = np.full((6, 8), 1.5, "f4"); z[2, 3] = np.nan
f = np.zeros((6, 8), "u2"); f[1, 1] = 2
np.savez("m.npz", z=z, f=f, s=np.full((6, 8), 0.004, "f4"))
np.save("t.npy", np.where(np.arange(8 * 48).reshape(4, 2, 6, 8) == 5, np.nan, 100.0))
)"))
    GTEST_SKIP() << "NumPy is not installed";
  const Outcome outcome = convert("m.npz --as flags=f,depth=z,sigma=s --unit m");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<std::uint16_t> flags = frames<std::uint16_t>("flags");
  EXPECT_EQ(flags[2 * 8 + 3], 1);
  EXPECT_EQ(flags[8 + 1], 2);
  EXPECT_EQ(flags[0], 0);
  EXPECT_THAT(tofgraph("run \"capture_reader file=out.h5 ! median ! null\"").err,
              testing::Not(HasSubstr("sigma is that of")));
  ASSERT_EQ(convert("t.npy --as taps").exit_code, 0);
  EXPECT_EQ(frames<std::uint16_t>("flags")[5], 1) << "no number is no tap of 0 counts";
  EXPECT_THAT(convert("m.npz --as sigma=s --unit m").err, HasSubstr("the deviation of a length"));
}

TEST_F(Convert, PagesOfATiffAndAPgmAreFrames) {
  std::vector<cv::Mat> pages;
  for (int page = 0; page < 3; ++page) pages.emplace_back(6, 8, CV_32F, cv::Scalar(0.5 + page));
  cv::imwritemulti(path("p.tiff").string(), pages);
  ASSERT_EQ(convert("p.tiff --as range --unit m").exit_code, 0);
  EXPECT_FLOAT_EQ(frames<float>("range")[2 * small_pixels + 5], 2.5F);
  cv::imwrite(path("p.pgm").string(), cv::Mat(6, 8, CV_16U, cv::Scalar(700)));
  ASSERT_EQ(convert("p.pgm --as amplitude").exit_code, 0);
  EXPECT_FLOAT_EQ(frames<float>("amplitude")[5], 700);
}

TEST_F(Convert, ATableOfNumbersIsAnImage) {
  std::string text = "# millimetres\n";
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 8; ++column)
      text += (column > 0 ? ";" : "") +
              (row == 1 && column == 2 ? std::string() : std::to_string(1000 + 10 * row + column));
    text += "\r\n";
  }
  write_text(path("t.csv"), text);
  ASSERT_EQ(convert("t.csv --as depth --unit mm").exit_code, 0);
  const std::vector<float> depth = frames<float>("depth");
  EXPECT_FLOAT_EQ(depth[5 * 8 + 7], 1.057F);
  EXPECT_TRUE(std::isnan(depth[8 + 2]));
  write_text(path("t.csv"), "1,2,3\n4,5\n");
  EXPECT_THAT(convert("t.csv --as depth --unit mm").err, HasSubstr("has 2 values in line 2, but 3 in the first"));
}

/// Two frames of taps as dumped by a camera driver: headers, big-endian, pixels with both taps, flags in high bits.
TEST_F(Convert, AFileWithoutAHeaderIsReadAsItsLayoutSays) {
  std::string dump(64, 'h');
  const auto value = [](std::size_t frame, std::size_t k, std::size_t pixel, std::size_t tap) {
    return static_cast<std::uint16_t>(100 + 1000 * frame + 200 * k + 2 * pixel + tap);
  };
  for (std::size_t frame = 0; frame < 2; ++frame) {
    dump += std::string(16, 'f');
    for (std::size_t k = 0; k < 4; ++k) {
      dump += std::string(32, 'i');
      for (std::size_t p = 0; p < small_pixels; ++p) {
        for (std::size_t tap = 0; tap < 2; ++tap) {
          const auto word = static_cast<std::uint16_t>(value(frame, k, p, tap) | (p % 3 == 0 ? 0xc000U : 0U));
          dump += static_cast<char>(word >> 8U);
          dump += static_cast<char>(word & 0xffU);
        }
      }
    }
  }
  write_text(path("dump.bin"), dump + "half a frame");
  write_text(path("layout.yaml"),
             "layout: 1\ncamera: ./tiny.yaml\nfile_header: 64\nframe_header: 16\narrays:\n"
             "  raw: {type: uint16, byte_order: big, shape: [4, 6, 8, 2], image_header: 32}\nchannels:\n"
             "  taps: {array: raw, axes: exposure row column tap, mask: 0x3fff}\n");
  const Outcome outcome = tofgraph("convert dump.bin -o out.h5 --layout layout.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("its last 12 bytes are not read"));
  const std::vector<std::uint16_t> taps = frames<std::uint16_t>("taps");
  ASSERT_EQ(taps.size(), 2 * 4 * 2 * small_pixels);
  for (std::size_t i = 0; i < taps.size(); ++i) {
    const std::size_t p = i % small_pixels, tap = i / small_pixels % 2, k = i / small_pixels / 2 % 4;
    ASSERT_EQ(taps[i], value(i / small_pixels / 8, k, p, tap)) << i;
  }
}

/// Two frames of depths, each followed by a number of eight bytes.
TEST_F(Convert, ImpossibleTimesAreRefusedAndAnOptionReplacesAnArrayOfTheLayout) {
  const auto converted = [this](const std::array<double, 2>& numbers, const std::string& type, const std::string& use,
                                const std::string& options = "") {
    std::string dump;
    for (const double number : numbers) {
      for (std::size_t i = 0; i < small_pixels; ++i) dump += "\xdc\x05";  // 1500
      dump.append(reinterpret_cast<const char*>(&number), sizeof number);
    }
    write_text(path("dump.bin"), dump);
    write_text(path("layout.yaml"),
               "layout: 1\ncamera: ./tiny.yaml\narrays:\n  raw: {type: uint16, shape: [6, 8]}\n"
               "  t: {type: " +
                   type +
                   ", shape: [1]}\nchannels:\n"
                   "  depth: {array: raw, axes: row column, unit: mm}\n" +
                   use + ": {array: t, unit: s}\n");
    return tofgraph("convert dump.bin -o out.h5 --layout layout.yaml --force " + options);
  };
  const Outcome unknown = converted({0.5, std::numeric_limits<double>::quiet_NaN()}, "float64", "timestamp");
  EXPECT_EQ(unknown.exit_code, 2) << unknown.err;
  EXPECT_THAT(unknown.err, HasSubstr("'t' has nan s for frame 1: time stamps must lie within 290 years of 1970"));
  const auto microseconds = std::bit_cast<double>(std::int64_t{1'700'000'000'000'000});
  const Outcome large = converted({microseconds, microseconds}, "int64", "timestamp");
  EXPECT_EQ(large.exit_code, 2) << large.err;
  EXPECT_THAT(large.err, HasSubstr("'t' has 1.7e+15 s for frame 0: time stamps must"));
  ASSERT_EQ(converted({0.5, 0.75}, "float64", "timestamp").exit_code, 0);
  EXPECT_THAT(frames<std::int64_t>("timestamp_ns"), testing::ElementsAre(500'000'000, 750'000'000));
  ASSERT_EQ(converted({1e-3, 4e-3}, "float64", "integration_time").exit_code, 0);
  EXPECT_THAT(frames<double>("integration_time_s"), testing::ElementsAre(1e-3, 4e-3));
  ASSERT_EQ(converted({1e-3, 4e-3}, "float64", "integration_time", "--integration-time '2 ms'").exit_code, 0);
  EXPECT_THAT(frames<double>("integration_time_s"), testing::ElementsAre(2e-3, 2e-3));
}

/// Twelve bits in two's complement below four status bits, and an amplitude image rotated by 180 degrees.
TEST_F(Convert, SignedBitsAndReversedAxesAreReadAsALayoutSays) {
  const auto sample = [](std::size_t k, std::size_t pixel) {
    return static_cast<int>(pixel * 85 % 4096) - 2048 + (pixel == 0 ? static_cast<int>(k) : 0);
  };
  std::string dump;
  const auto add = [&dump](unsigned word) {
    dump += static_cast<char>(word & 0xffU);
    dump += static_cast<char>(word >> 8U);
  };
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t p = 0; p < small_pixels; ++p) add((static_cast<unsigned>(sample(k, p)) & 0xfffU) | p % 16 << 12U);
  for (std::size_t p = 0; p < small_pixels; ++p) add(static_cast<unsigned>(100 + p));
  write_text(path("dump.bin"), dump);
  const auto layout = [&](const std::string& phases, const std::string& intensity) {
    write_text(path("layout.yaml"),
               "layout: 1\ncamera: ./tiny.yaml\narrays:\n  raw: {type: uint16, shape: [4, 6, 8]}\n"
               "  grey: {type: uint16, shape: [6, 8]}\nchannels:\n  phases: {array: raw, axes: exposure row column" +
                   phases + "}\n  intensity: {array: grey, " + intensity + "}\n");
    return tofgraph("convert dump.bin -o out.h5 --layout layout.yaml --force");
  };
  const Outcome outcome = layout(", signed_bits: 12", "axes: row column, reversed: row column");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<std::int32_t> phases = frames<std::int32_t>("phases");
  for (std::size_t i = 0; i < phases.size(); ++i) ASSERT_EQ(phases[i], sample(i / small_pixels, i % small_pixels)) << i;
  std::vector<float> grey = frames<float>("intensity");
  for (std::size_t p = 0; p < small_pixels; ++p)
    EXPECT_EQ(grey[p], static_cast<float>(100 + small_pixels - 1 - p)) << p;
  ASSERT_EQ(layout(", signed_bits: 12", "axes: row column, reversed: column").exit_code, 0);
  grey = frames<float>("intensity");
  for (std::size_t p = 0; p < small_pixels; ++p)
    EXPECT_EQ(grey[p], static_cast<float>(100 + p / 8 * 8 + 7 - p % 8)) << p;
  ASSERT_EQ(layout(", signed_bits: 12, invalid: -2048", "axes: row column").exit_code, 0);
  EXPECT_EQ(frames<std::int32_t>("phases")[0], 0) << "the code of no measurement is the signed number";
  EXPECT_EQ(frames<std::int32_t>("phases")[1], sample(0, 1));
  for (std::size_t p = 0; p < small_pixels; ++p) EXPECT_EQ(frames<std::uint16_t>("flags")[p], p == 0 ? 1 : 0) << p;
  EXPECT_THAT(layout(", signed_bits: 12, invalid: 2048", "axes: row column").err,
              HasSubstr("has invalid: 2048, but its values are the lowest 12 bits of uint16, -2048 to 2047"));
  for (const std::string code : {"-1", "65536", "0.5"})
    EXPECT_THAT(layout(", invalid: " + code, "axes: row column").err,
                HasSubstr("has invalid: " + code + ", but its values are uint16, 0 to 65535"));
  EXPECT_THAT(layout(", signed_bits: 12, mask: 0x0fff", "axes: row column").err,
              HasSubstr("has 'mask' and 'signed_bits'"));
  EXPECT_THAT(layout(", signed_bits: 20", "axes: row column").err,
              HasSubstr("signed_bits: 20, but its values are uint16"));
  EXPECT_THAT(layout("", "axes: row column, reversed: tap").err, HasSubstr("'reversed' must be axes of the image"));
}

/// Twelve bits of value below a status bit; two dead pixels have the largest value.
TEST_F(Convert, StatusBitsBecomeFlagsAndUnstatedOnesAreReported) {
  std::string dump;
  for (std::size_t i = 0; i < 4 * small_pixels; ++i) {
    const std::size_t p = i % small_pixels;
    const unsigned word = p == 10 || p == 11 ? 4095U : static_cast<unsigned>(1000 + i) | (i == 50 ? 0x8000U : 0U);
    dump += static_cast<char>(word & 0xffU);
    dump += static_cast<char>(word >> 8U);
  }
  write_text(path("dump.bin"), dump);
  const auto layout = [&](const std::string& keys) {
    write_text(path("layout.yaml"),
               "layout: 1\ncamera: ./tiny.yaml\narrays:\n  raw: {type: uint16, shape: [4, 6, 8]}\n"
               "channels:\n  phases: {array: raw, axes: exposure row column" +
                   keys + "}\n");
    return tofgraph("convert dump.bin -o out.h5 --layout layout.yaml --force");
  };
  const Outcome dropped = layout(", mask: 0x0fff");
  ASSERT_EQ(dropped.exit_code, 0) << dropped.err;
  EXPECT_THAT(dropped.err, HasSubstr("bit 15 is set in 1 of 192 words of phases and dropped by mask: 0x0fff"));
  EXPECT_THAT(dropped.err, HasSubstr("e.g. saturated: 0x8000"));
  EXPECT_THAT(dropped.err, HasSubstr("8 of 192 values of phases in 1 frame are 4095"));
  EXPECT_THAT(dropped.err, HasSubstr("--invalid 4095"));
  const Outcome stated = layout(", mask: 0x0fff, saturated: 0x8000, invalid: 4095");
  ASSERT_EQ(stated.exit_code, 0) << stated.err;
  EXPECT_THAT(stated.err, Not(HasSubstr("warning")));
  const auto phases = frames<std::int32_t>("phases");
  EXPECT_EQ(phases[50], 1050) << "the value below the status bit";
  const auto flags = frames<std::uint16_t>("flags");
  for (std::size_t p = 0; p < small_pixels; ++p) EXPECT_EQ(flags[p], p == 2 ? 2 : p == 10 || p == 11 ? 1 : 0) << p;
  EXPECT_EQ(layout(", saturated: 0x8000, invalid: 4095").exit_code, 0);
  EXPECT_EQ(frames<std::int32_t>("phases"), phases) << "status bits are not part of the value";
  ASSERT_EQ(layout(", mask: 0x0fff, invalid_bits: 0x8000, invalid: 4095").exit_code, 0);
  EXPECT_EQ(frames<std::uint16_t>("flags")[2], 1);
  EXPECT_THAT(layout(", mask: 0x0fff, saturated: 0x0800").err,
              HasSubstr("the bits 0x800 in 'mask' and in 'saturated'"));
}

/// Twelve bits below a status bit; saturated pixels have all bits of the value and the status bit.
TEST_F(Convert, ACodeBelowAStatusBitIsExcludedAsTheWarningSays) {
  std::string dump;
  for (std::size_t i = 0; i < small_pixels; ++i) {
    const unsigned word = i % 4 == 0 ? 0x8fffU : i == 5 ? 0x0fffU : static_cast<unsigned>(1500 + i);
    dump += static_cast<char>(word & 0xffU);
    dump += static_cast<char>(word >> 8U);
  }
  write_text(path("dump.bin"), dump);
  const auto layout = [&](const std::string& keys) {
    write_text(path("layout.yaml"),
               "layout: 1\ncamera: ./tiny.yaml\narrays:\n  raw: {type: uint16, shape: [6, 8]}\n"
               "channels:\n  depth: {array: raw, axes: row column, unit: mm, saturated: 0x8000" +
                   keys + "}\n");
    return tofgraph("convert dump.bin -o out.h5 --layout layout.yaml --force");
  };
  EXPECT_THAT(layout(", mask: 0x0fff").err, HasSubstr("13 of 48 values of depth in 1 frame are 4095"));
  for (const std::string keys : {", mask: 0x0fff, invalid: 4095", ", invalid: 4095"}) {
    const Outcome outcome = layout(keys);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, Not(HasSubstr("warning"))) << keys;
    const std::vector<float> depth = frames<float>("depth");
    const std::vector<std::uint16_t> flags = frames<std::uint16_t>("flags");
    for (std::size_t i = 0; i < small_pixels; ++i) {
      EXPECT_EQ(std::isnan(depth[i]), i % 4 == 0 || i == 5) << i;
      EXPECT_EQ(flags[i], i % 4 == 0 ? 3 : i == 5 ? 1 : 0) << "invalid, and saturated where the status bit is set";
    }
  }
  EXPECT_THAT(layout(", mask: 0x0fff, invalid: 0x8fff").err, HasSubstr("1 of 48 values"))
      << "a stored value is excluded as well";
}

/// Millimetres below bits that invalidate a pixel, and one that does not.
TEST_F(Convert, StatusBitsOfLengthsInvalidateTheirPixels) {
  const unsigned status[] = {0, 0x8000, 0x4000, 0x2000, 0x6000};
  constexpr std::uint16_t invalid = 1, saturated = 2, bad_pixel = 1024;
  const int expected[] = {0, invalid, invalid | bad_pixel, saturated, invalid | bad_pixel | saturated};
  std::string dump;
  for (std::size_t i = 0; i < small_pixels; ++i) {
    const unsigned word = static_cast<unsigned>(1500 + i) | status[i % 5];
    dump += static_cast<char>(word & 0xffU);
    dump += static_cast<char>(word >> 8U);
  }
  write_text(path("dump.bin"), dump);
  write_text(path("layout.yaml"),
             "layout: 1\ncamera: ./tiny.yaml\narrays:\n  raw: {type: uint16, shape: [6, 8]}\nchannels:\n  depth: "
             "{array: raw, axes: row column, unit: mm, invalid_bits: 0x8000, bad_pixel: 0x4000, saturated: 0x2000}\n");
  const Outcome outcome = tofgraph("convert dump.bin -o out.h5 --layout layout.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, Not(HasSubstr("warning")));
  const std::vector<float> depth = frames<float>("depth");
  const std::vector<std::uint16_t> flags = frames<std::uint16_t>("flags");
  for (std::size_t i = 0; i < small_pixels; ++i) {
    EXPECT_EQ(flags[i], expected[i % 5]) << i;
    if ((expected[i % 5] & invalid) != 0)
      EXPECT_TRUE(std::isnan(depth[i])) << i;
    else
      EXPECT_FLOAT_EQ(depth[i], static_cast<float>(1.5 + 1e-3 * static_cast<double>(i))) << i;
  }
}

/// Signed words whose highest bit is a status bit, which is no sign; ten of them hold the largest number below it.
TEST_F(Convert, StatusBitsOfSignedWordsAreNoPartOfTheirNumbers) {
  std::string dump;
  for (std::size_t i = 0; i < 4 * small_pixels; ++i) {
    const unsigned word = i >= 182 ? 0x8fffU : static_cast<unsigned>(1100 + 10 * i) | (i % 4 == 0 ? 0x8000U : 0U);
    dump += static_cast<char>(word & 0xffU);
    dump += static_cast<char>(word >> 8U);
  }
  write_text(path("dump.bin"), dump);
  const auto layout = [&](const std::string& type, const std::string& shape, const std::string& keys) {
    write_text(path("layout.yaml"),
               "layout: 1\ncamera: ./tiny.yaml\narrays:\n  raw: {type: " + type + ", shape: " + shape +
                   "}\nchannels:\n  phases: {array: raw, axes: exposure row column, " + keys + "}\n");
    return tofgraph("convert dump.bin -o out.h5 --layout layout.yaml --force");
  };
  const Outcome outcome = layout("int16", "[4, 6, 8]", "saturated: 0x8000");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("10 of 192 values of phases in 1 frame are 4095"), Not(HasSubstr("e+"))));
  const auto phases = frames<std::int16_t>("phases");
  for (std::size_t i = 0; i < 182; ++i) EXPECT_EQ(phases[i], 1100 + 10 * static_cast<int>(i)) << i;
  EXPECT_THAT(layout("float32", "[4, 2, 12]", "saturated: 0x8000").err,
              HasSubstr("has the status bits 0x8000, but its values are float32"));
}

/// 65535 of an overflow, and a repeated 4095 beside millimetres of a wall.
TEST_F(Convert, ValuesThatAreProbablyCodesAreReportedOnce) {
  cv::Mat image(6, 8, CV_16U);
  for (int i = 0; i < 48; ++i) image.at<std::uint16_t>(i / 8, i % 8) = static_cast<std::uint16_t>(1500 + i);
  for (int i = 0; i < 12; ++i) image.at<std::uint16_t>(i / 8, i % 8) = 4095;
  image.at<std::uint16_t>(5, 7) = 65535;
  for (const char* name : {"d_1.png", "d_2.png"}) cv::imwrite(path(name).string(), image);
  const std::string err = convert("d_1.png d_2.png --as depth --unit mm --invalid 0").err;
  EXPECT_THAT(err, HasSubstr("24 of 96 values of depth in 2 frames are 4095"));
  EXPECT_THAT(err, HasSubstr("2 of 96 values of depth in 2 frames are 65535"));
  EXPECT_THAT(err, HasSubstr("--invalid 0,4095,65535 "));
  EXPECT_THAT(convert("d_1.png d_2.png --as depth --unit mm --invalid 65535,0,4095").err, Not(HasSubstr("warning")));
  image.at<std::uint16_t>(5, 6) = 0;
  cv::imwrite(path("d_1.png").string(), image);
  const std::string shown = tofgraph("convert --inspect d_1.png").out;
  EXPECT_THAT(shown,
              HasSubstr(" 0 to 65535, 2.1 % zeros, 12 times 4095: probably a code, 1 times 65535: probably a code, "
                        "--invalid 4095,65535"));
  EXPECT_THAT(shown, HasSubstr("If the array is a length, its values are\n  unit: m    1512 m to 1545 m"));
  write_text(path("words.bin"), std::string("\x10\x0f\x01\x82\x20\x00\x11\x00", 8));
  write_text(path("words.yaml"),
             "layout: 1\narrays:\n  words: {type: uint16, byte_order: big, shape: [2, 2]}\n"
             "channels: {depth: {unit: mm}}\n");
  EXPECT_THAT(tofgraph("convert --inspect words.bin --layout words.yaml").out,
              HasSubstr("386 to 8192, 0 % zeros, bits set 0x318f"));
}

/// A layout for the file is heeded: bits of signed words have their width, and stated codes are not suspected.
TEST_F(Convert, InspectionWithALayoutHeedsItsCodesAndBits) {
  std::string dump("\xfb\xff\x05\x00", 4);  // -5 and 5
  for (int i = 0; i < 30; ++i)
    dump += i < 12 ? std::string("\xff\x0f", 2) : std::string(1, static_cast<char>(i)) + '\5';
  write_text(path("dump.bin"), dump);
  const auto shown = [&](const std::string& keys) {
    write_text(path("layout.yaml"),
               "layout: 1\narrays:\n  raw: {type: int16, shape: [2, 16]}\nchannels:\n  phases: "
               "{array: raw, axes: row column" +
                   keys + "}\n");
    return tofgraph("convert --inspect dump.bin --layout layout.yaml").out;
  };
  EXPECT_THAT(shown(""), AllOf(HasSubstr("-5 to 4095"), HasSubstr("12 times 4095: probably a code, --invalid 4095"),
                               HasSubstr("bits set 0xffff  (layout)")));
  EXPECT_THAT(shown(", invalid: 4095"), Not(HasSubstr("probably a code")));
  EXPECT_THAT(shown(", mask: 0x07ff"), HasSubstr("12 times 2047: probably a code, --invalid 2047"));
}

/// The range is that of the values below a status bit; the option replaces the stated codes, so it repeats them.
TEST_F(Convert, InspectionWithALayoutShowsTheNumbersBelowStatusBits) {
  std::string dump;
  for (unsigned i = 0; i < 1200; ++i) {
    const unsigned word = (i < 100 ? 4095 : i < 200 ? 3000 : 1500 + i % 50) | (i % 7 == 0 ? 0x8000 : 0);
    dump += static_cast<char>(word & 0xffU);
    dump += static_cast<char>(word >> 8U);
  }
  write_text(path("dump.bin"), dump);
  write_text(path("layout.yaml"),
             "layout: 1\narrays:\n  raw: {type: uint16, shape: [30, 40]}\nchannels:\n  phases: {array: raw, axes: row "
             "column, saturated: 0x8000, invalid: 3000}\n");
  EXPECT_THAT(
      tofgraph("convert --inspect dump.bin --layout layout.yaml").out,
      HasSubstr(" 1500 to 4095, 98 % of the positive within 1500 to 1549, 0 % zeros, 100 times 4095: probably a "
                "code, --invalid 3000,4095"));
}

/// The advice names a value that is stored and not stated yet.
TEST_F(Convert, TheExampleOfARefusedLengthIsOneOfTheFile) {
  const auto advice = [&](const std::string& type, const std::string& word, const std::string& keys) {
    std::string dump;
    for (std::size_t i = 0; i < small_pixels; ++i)
      dump += i == 9 ? word : std::string("\xdc\x05\0\0", 4).substr(0, word.size());  // 1500
    write_text(path("dump.bin"), dump);
    write_text(path("layout.yaml"), "layout: 1\ncamera: ./tiny.yaml\narrays:\n  z: {type: " + type +
                                        ", shape: [6, 8]}\nchannels:\n  depth: {array: z, axes: row column, unit: mm" +
                                        keys + "}\n");
    return tofgraph("convert dump.bin -o out.h5 --layout layout.yaml --force").err;
  };
  EXPECT_THAT(advice("int16", "\xec\xff", ", invalid: -1"), HasSubstr("state it, e.g. --invalid -20,-1 ("));
  EXPECT_THAT(advice("uint32", "\xf0\xff\xff\xff", ""), HasSubstr("state it, e.g. --invalid 4294967280 ("));
  EXPECT_THAT(advice("uint32", "\xf0\xff\xff\xff", ", invalid: 4294967280"), Not(HasSubstr("taken as invalid")));
}

TEST_F(Convert, WhatIsAmbiguousIsListedAndNotGuessed) {
  if (!python("np.save('six.npy', np.full((6, 6, 8), 1500, dtype='u2'))\n"
              "np.save('one.npy', np.full((6, 8), 1500, dtype='u2'))\n"
              "np.save('other.npy', np.full((7, 9), 1500, dtype='u2'))\n"
              "np.save('objects.npy', np.array([[{}]]))\n"))
    GTEST_SKIP() << "NumPy is not installed";
  const Outcome axes = convert("six.npy --as depth --unit mm");
  EXPECT_EQ(axes.exit_code, 2);
  EXPECT_THAT(axes.err, HasSubstr("axes: frame row column"));
  EXPECT_THAT(axes.err, HasSubstr("axes: row frame column"));
  EXPECT_EQ(convert("six.npy --as depth --unit mm --axes 'frame row column'").exit_code, 0);
  const Outcome unit = convert("one.npy --as depth");
  EXPECT_EQ(unit.exit_code, 2);
  EXPECT_THAT(unit.err, HasSubstr("unit: mm   1.5 m to 1.5 m"));
  const Outcome channel = convert("one.npy");
  EXPECT_EQ(channel.exit_code, 2);
  EXPECT_THAT(channel.err, HasSubstr("the meaning of the values is not stated"));
  const Outcome size = convert("other.npy --as depth --unit mm");
  EXPECT_EQ(size.exit_code, 2);
  EXPECT_THAT(size.err, HasSubstr("is 7 x 9"));
  EXPECT_THAT(convert("objects.npy --as depth --unit mm").err, HasSubstr("holds elements of type '|O'"));
  const Outcome inspected = tofgraph("convert --inspect one.npy");
  EXPECT_EQ(inspected.exit_code, 0) << inspected.err;
  EXPECT_THAT(inspected.out, HasSubstr("6 x 8"));
  EXPECT_THAT(inspected.out, HasSubstr("unit: mm   1.5 m to 1.5 m"));
}

TEST_F(Convert, ErrorsNameTheOptionAndNotAPipeline) {
  cv::imwrite(path("depth.png").string(), cv::Mat(6, 8, CV_16U, cv::Scalar(1500)));
  write_text(path("camera.yml"), "%YAML:1.0\n");
  const auto error_of = [this](const std::string& options) {
    return tofgraph("convert depth.png -o out.h5 --force " + options).err;
  };
  EXPECT_THAT(error_of("--camera ./tiny.yaml --as rang --unit mm"), StartsWith("--as: error: 'rang' is not a channel"));
  EXPECT_THAT(error_of("--camera ./tiny.yaml --as depth --unit kg"),
              AllOf(StartsWith("error: "),
                    HasSubstr("depth.png: 'kg' is not a unit of m; example: unit: mm, as an option --unit mm")));
  EXPECT_THAT(error_of("--camera ./tiny.yaml --as depth --unit mm --frame-rate soon"),
              StartsWith("--frame-rate: error: "));
  EXPECT_THAT(error_of("--camera camera.yml --as depth --unit mm"),
              AllOf(StartsWith("--camera: error: "), HasSubstr("tofgraph convert camera.yml -o my_camera.yaml")));
  EXPECT_THAT(error_of("--camera ./tiny.yaml --as depth --unit mm --modulation-frequency '20 MHz, 100 MHz'"),
              AllOf(StartsWith("--modulation-frequency: error: "), HasSubstr("greatest common divisor")));
  EXPECT_THAT(error_of("--inspect"), StartsWith("--out: error: --inspect shows the values as they are stored"));
  EXPECT_THAT(tofgraph("convert depth.png --inspect --unit mm").err, StartsWith("--unit: error: --inspect"));
  EXPECT_THAT(tofgraph("convert camera.yml -o profile.yaml --unit mm").err, StartsWith("--unit: error: is for images"));
  write_text(path("there.h5"), "");
  EXPECT_THAT(
      tofgraph("convert depth.png -o there.h5 --camera ./tiny.yaml --as depth --unit mm").err,
      AllOf(StartsWith("error: "), HasSubstr("there.h5 already exists: --force"), Not(HasSubstr("capture_writer"))));
  EXPECT_THAT(tofgraph("convert depth.png -o out{h5 --camera ./tiny.yaml --as depth --unit mm").err,
              AllOf(HasSubstr("out{h5"), Not(HasSubstr("capture_writer"))));
  write_text(path("layout.yaml"), "layout: 1\nchannels: {depht: {unit: mm}}\n");
  EXPECT_THAT(error_of("--camera ./tiny.yaml --layout layout.yaml"),
              HasSubstr("layout.yaml:2:12: error: there is no channel"));
}

TEST_F(Convert, AFileReaderIsAStageLikeAnyOther) {
  cv::imwrite(path("depth_1.png").string(), cv::Mat(6, 8, CV_16U, cv::Scalar(1500)));
  const Outcome outcome = tofgraph(
      "run \"file_reader files='depth_*.png' as=depth unit=mm ! point_cloud ! pcd_writer path=c.pcd encoding=ascii\" "
      "--camera ./tiny.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(read_text(path("c.pcd")), HasSubstr("1.498"));
}

}  // namespace
