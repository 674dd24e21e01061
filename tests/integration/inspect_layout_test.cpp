// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: InspectLayout.RightHeaders*:InspectLayout.A*HeaderOfAnotherSize*
// Rooms: inspection foreign plugins
// Layouts of files with headers: wrong header sizes are found, and signed 12-bit words are read.
#include <gmock/gmock.h>

#include "tests/integration/inspected_scenes.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <numbers>

using namespace tofgraph::tests;
using nlohmann::json;
using testing::HasSubstr;

namespace {

const InspectedCamera camera{176, 144, 160, 160.5, 83.0, 76.1, {-0.33, 0.13, 0, 0.001, 0}, 45e-6, 40e6};
constexpr std::size_t frame_count = 6;

/// Sizes of the headers in a file, or in a layout, in bytes.
struct Headers {
  std::size_t file = 64, frame = 16, image = 0;
};

class InspectLayout : public testing::Test {
 protected:
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }

  /// Dump of depths in millimetres, uint16; if images have their own headers, each frame has the same image four times.
  std::string dump(const Headers& headers, const InspectedScene& scene, double noise = 0.002) const {
    InspectedRecording recording(camera, scene, noise, 5);
    std::string bytes(headers.file, 'h');
    for (std::size_t frame = 0; frame < frame_count; ++frame) {
      bytes += std::string(headers.frame, static_cast<char>(frame));
      const std::string payload = recording.npy().substr(128);
      if (headers.image == 0) {
        bytes += payload;
        continue;
      }
      for (const char image : {'a', 'b', 'c', 'd'}) bytes += std::string(headers.image, image) + payload;
    }
    return bytes;
  }
  void write_layout(const Headers& headers, const std::string& byte_order = "little") const {
    write_text(path("camera.yaml"), camera.profile(camera.k));
    std::string text = "layout: 1\ncamera: ./camera.yaml\nfile_header: " + std::to_string(headers.file) +
                       "\nframe_header: " + std::to_string(headers.frame) +
                       "\narrays:\n  words: {type: uint16, byte_order: " + byte_order + ", shape: [144, 176]}\n";
    write_text(path("layout.yaml"), text + "channels:\n  depth: {array: words, axes: row column, unit: mm}\n");
  }
  json inspected(const std::string& bytes) const {
    write_text(path("dump.bin"), bytes);
    const Outcome outcome = shell("$TOFGRAPH inspect dump.bin --layout layout.yaml --json", folder_.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return json::parse(outcome.out);
  }
  /// Expects the proposed correction of wrong headers, and none after it has been applied.
  void expect_mend(const std::string& bytes, const Headers& stated, const Headers& right,
                   const std::string& mend) const {
    write_layout(stated);
    const json result = inspected(bytes);
    ASSERT_FALSE(result["findings"].empty()) << mend << result;
    EXPECT_EQ(result["findings"][0]["kind"], "headers") << result;
    EXPECT_EQ(result["findings"][0]["mend"], mend) << result;
    const Outcome converted = shell("$TOFGRAPH convert dump.bin -o a.h5 --layout layout.yaml --force", folder_.path());
    EXPECT_THAT(converted.err, HasSubstr("in the layout: " + mend));
    write_layout(right);
    EXPECT_TRUE(inspected(bytes)["findings"].empty());
  }

  TemporaryFolder folder_;
};

InspectedPlane plane(double x, double y, double z, double distance) {
  const double norm = std::sqrt(x * x + y * y + z * z);
  return {{x / norm, y / norm, z / norm}, distance};
}

const InspectedScene slanted = {plane(0.5, -0.3, 1, 1.4)};
const InspectedScene two_walls = {plane(0.8, 0.2, 1, 1.6), plane(-0.9, 0.1, 1, 1.5)};

TEST_F(InspectLayout, AFrameHeaderOfAnotherSizeIsFoundWithTheOneThatFits) {
  for (const InspectedScene& scene : {slanted, two_walls}) {
    for (const std::size_t frame : {0U, 15U, 17U, 48U, 352U}) {
      const Headers right{64, frame, 0};
      expect_mend(dump(right, scene), {64, 16, 0}, right, "frame_header: " + std::to_string(frame));
    }
  }
}

TEST_F(InspectLayout, AFileHeaderOfAnotherSizeIsFoundWithTheOneThatFits) {
  for (const std::size_t file : {0U, 32U, 63U, 65U, 128U, 400U}) {
    const Headers right{file, 16, 0};
    expect_mend(dump(right, slanted), {64, 16, 0}, right, "file_header: " + std::to_string(file));
  }
}

TEST_F(InspectLayout, BothHeadersOfOtherSizesAreFound) {
  const Headers right{80, 24, 0};
  expect_mend(dump(right, slanted), {64, 16, 0}, right, "frame_header: 24, file_header: 80");
}

TEST_F(InspectLayout, RightHeadersAreNotDoubtedWhereARecordingWasInterrupted) {
  for (const InspectedScene& scene : {slanted, two_walls, InspectedScene{plane(0, 0, 1, 1.5)}}) {
    for (const double noise : {0.001, 0.02}) {
      const Headers right;
      const std::string bytes = dump(right, scene, noise);
      write_layout(right);
      EXPECT_TRUE(inspected(bytes)["findings"].empty());
      for (const std::size_t missing : {1U, 20U, 500U, 30000U, 50600U}) {
        const json result = inspected(bytes.substr(0, bytes.size() - missing));
        EXPECT_TRUE(result["findings"].empty()) << missing << result;
        EXPECT_THAT(result["undecided"].dump(), HasSubstr("does not end with a whole frame")) << missing;
      }
    }
  }
}

/// Too little of a second frame is there to be compared with the first one.
TEST_F(InspectLayout, OneFrameAndSurplusBytesDoNotShowAnotherHeader) {
  const Headers right;
  const std::string bytes = dump(right, slanted);
  const std::size_t frame = right.frame + 2UL * camera.width * camera.height, one = right.file + frame;
  std::mt19937 random(8);
  std::string trailer(100, '\0');
  write_layout(right);
  const auto expect_no_header = [&](const std::string& file, const char* left_over) {
    const json result = inspected(file);
    EXPECT_TRUE(result["findings"].empty()) << left_over << result;
    EXPECT_THAT(result["undecided"].dump(), HasSubstr(left_over));
  };
  for (int n = 0; n < 4; ++n) {
    for (char& byte : trailer) byte = static_cast<char>(random() % 256);
    expect_no_header(bytes.substr(0, one) + trailer, "100 bytes are left over");
  }
  expect_no_header(bytes.substr(0, one + frame / 100), "507 bytes are left over");
}

/// A file of the system, which states more bytes than it has.
TEST_F(InspectLayout, AFileThatCannotBeReadIsNamed) {
  const std::string file = "/sys/kernel/mm/transparent_hugepage/enabled";
  if (!std::filesystem::exists(file) || std::filesystem::file_size(file) != 4096) GTEST_SKIP() << "no such file";
  write_text(path("camera.yaml"), camera.profile(camera.k));
  write_text(path("layout.yaml"),
             "layout: 1\ncamera: ./camera.yaml\narrays:\n  words: {type: uint16, shape: [10, 10]}\n"
             "channels:\n  depth: {array: words, axes: row column, unit: mm}\n");
  const Outcome outcome = shell("$TOFGRAPH convert " + file + " -o a.h5 --layout layout.yaml", folder_.path());
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr(file + ": the file cannot be read"));
}

TEST_F(InspectLayout, AFlatSceneCannotDecideOnTheHeaders) {
  const Headers right{64, 48, 0};
  write_layout({64, 16, 0});
  const json result = inspected(dump(right, {plane(0, 0, 1, 1.5)}, 0.02));
  EXPECT_THAT(result["undecided"].dump(), HasSubstr("does not end with a whole frame")) << result;
}

/// Phase images, line by line, of two walls at 40 MHz; column 7 is dead: 2047 in all images.
std::string phase_dump(std::size_t file_header) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 6);
  std::string bytes(file_header, 'h');
  for (std::size_t frame = 0; frame < frame_count; ++frame) {
    for (int v = 0; v < 144; ++v) {
      for (int k = 0; k < 4; ++k) {
        for (int u = 0; u < 176; ++u) {
          const double x = (u - 83.0) / 160, y = (v - 76.1) / 160.5,
                       depth = std::min(1.9 / (1 + 0.35 * y), -0.55 / std::min(x, -1e-9));
          const double phase = 4 * std::numbers::pi * 40e6 * depth * std::sqrt(x * x + y * y + 1) / 299792458.0;
          const double sample = u == 7 ? 2047 : 900 * std::cos(phase + k * std::numbers::pi / 2) + noise(random);
          const auto word = static_cast<unsigned>(static_cast<int>(std::lround(sample)));
          bytes += static_cast<char>(word & 0xffU);
          bytes += static_cast<char>(word >> 8U & 0xffU);
        }
      }
    }
  }
  return bytes;
}

/// A missing file_header of images whose rows are sent exposure by exposure; pixels that are dead without a stated code
/// are found, and no lens error is invented from them.
TEST_F(InspectLayout, DeadPixelsAndTheHeaderOfInterleavedPhasesAreFound) {
  const std::string profile = camera.profile({});
  write_text(path("camera.yaml"), profile.substr(0, profile.find("sources:")));
  const auto write = [&](const std::string& header) {
    write_text(path("layout.yaml"), "layout: 1\ncamera: ./camera.yaml\n" + header +
                                        "arrays:\n  words: {type: int16, shape: [144, 4, 176]}\n"
                                        "channels:\n  phases: {array: words, axes: row exposure column}\n");
  };
  write("");
  const json shifted = inspected(phase_dump(256));
  EXPECT_EQ(shifted["findings"][0]["mend"], "file_header: 256") << shifted;
  write("file_header: 256\n");
  const json result = inspected(phase_dump(256));
  ASSERT_EQ(result["findings"].size(), 1) << result;
  EXPECT_EQ(result["findings"][0]["kind"], "bad_pixels");
  EXPECT_THAT(result["findings"][0]["evidence"].get<std::string>(), HasSubstr("the first at column 7, row 1)"));
  EXPECT_THAT(result["facts"].dump(), HasSubstr("without a valid length 0.57 %"));
  EXPECT_THAT(result["facts"].dump(), HasSubstr("distance and range are equal"));
}

/// Signed words above a status bit: noise about 0 in the left part, whose sign changes at random, a texture in the
/// right.
TEST_F(InspectLayout, TheHeaderOfSignedWordsWithAStatusBitIsFound) {
  std::mt19937 random(6);
  std::normal_distribution<double> noise(0, 2);
  std::string bytes;
  for (std::size_t frame = 0; frame < frame_count; ++frame) {
    bytes += std::string(48, 'h');
    for (int i = 0; i < 4 * 144 * 176; ++i) {
      const double sample =
          noise(random) + (i % 176 < 120 ? 0 : 500 + 300 * std::sin(i % 176 / 7.0) * std::cos(i / 9e3));
      const auto word = static_cast<unsigned>(2 * static_cast<int>(std::lround(sample)));
      bytes += static_cast<char>(word & 0xffU);
      bytes += static_cast<char>(word >> 8U & 0xffU);
    }
  }
  write_text(path("camera.yaml"), camera.profile(camera.k));
  write_text(path("layout.yaml"),
             "layout: 1\ncamera: ./camera.yaml\nframe_header: 16\narrays:\n  words: {type: int16, shape: [4, 144, "
             "176]}\nchannels:\n  phases: {array: words, axes: exposure row column, saturated: 0x0001}\n");
  write_text(path("dump.bin"), bytes);
  const Outcome outcome = shell("$TOFGRAPH convert dump.bin -o a.h5 --layout layout.yaml", folder_.path());
  EXPECT_THAT(outcome.err, HasSubstr("in the layout: frame_header: 48")) << outcome.err;
}

/// Four images per frame, each with a header: the last image shows whether images or frames have the longer header.
TEST_F(InspectLayout, HeadersOfImagesAreToldFromThoseOfFrames) {
  write_layout({});
  const std::vector<std::pair<Headers, std::string>> cases = {{{64, 16, 24}, "image_header: 24 of 'words'"},
                                                              {{64, 64, 12}, "frame_header: 64"}};
  for (const auto& [headers, mend] : cases) {
    write_text(path("layout.yaml"),
               "layout: 1\ncamera: ./camera.yaml\nfile_header: 64\nframe_header: 16\narrays:\n"
               "  words: {type: uint16, shape: [4, 144, 176], image_header: 12}\n"
               "channels:\n  phases: {array: words, axes: exposure row column}\n");
    write_text(path("dump.bin"), dump(headers, slanted));
    const Outcome outcome = shell("$TOFGRAPH convert dump.bin -o a.h5 --layout layout.yaml --force", folder_.path());
    EXPECT_THAT(outcome.err, HasSubstr("in the layout: " + mend + "\n")) << outcome.err;
  }
}

}  // namespace
