// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Kinds/DamagedCapture.*
// Rooms: config io cli calibration
// Damaged files given to every command that reads them: one error of this program that names the file, and no message
// of HDF5, OpenCV, libpng, libtiff, yaml-cpp or Ceres.
#include <gmock/gmock.h>
#include <hdf5.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <algorithm>
#include <thread>

#include "config/log.hpp"
#include "config/silence.hpp"
#include "io/picture_decoder.hpp"
#include "tests/unit/capture_fixture.hpp"
#include "tests/unit/raw_capture.hpp"

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;
using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;

/// First words of the libraries' messages.
const char* const words_of_libraries[] = {
    "OpenCV",        "libpng", "libtiff",   "TIFFRead",  "[ WARN", "[ERROR",    "sblock",     "B-tree",
    "object head",   "heap",   "signature", "inflate",   "H5",     "hyperslab", "YAML::",     "bad conversion",
    "ceres",         "glog",   "json.",     "terminate", "std::",  "basic_",    ".cpp:",      "Assertion",
    "bad.h5 bad.h5", "can't",  "fractal",   "errno",     "imread", "illegal",   "not found\n"};

void expect_no_library(const std::string& command, const Outcome& outcome) {
  for (const char* words : words_of_libraries) EXPECT_THAT(outcome.out + outcome.err, Not(HasSubstr(words))) << command;
}

void expect_own_words(const std::string& command, const Outcome& outcome, const std::string& file) {
  EXPECT_THAT(outcome.exit_code, AnyOf(1, 2)) << command << "\n" << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr(file)) << command;
  EXPECT_THAT(outcome.err, HasSubstr("error: ")) << command;
  expect_no_library(command, outcome);
}

class Damaged : public testing::Test {
 protected:
  void SetUp() override {
    write_text(folder.path() / "small.yaml",
               "profile: 1\nname: small\nwidth: 32\nheight: 24\npixel_pitch: 45 um\nfocal_length: 2 mm\n"
               "principal_point: [15.5, 11.5]\nmodulation_frequency: 20 MHz\nsources:\n"
               "  - {name: left, position: [-50 mm, 0 mm, 0 mm], amplitude: 1}\ngain: 7.0e6 counts m^2/s\n"
               "contrast: 0.5\nframe_rate: 40 Hz\nread_noise: 4 counts\nshot_noise: 0.012 counts\n");
  }
  /// Runs each command with FILE replaced by the damaged file.
  void expect_refused(const std::string& file, const std::vector<std::string>& commands) const {
    for (std::string command : commands) {
      for (std::size_t at = 0; (at = command.find("FILE", at)) != std::string::npos;) command.replace(at, 4, file);
      expect_own_words(command, shell("\"$TOFGRAPH\" " + command, folder.path()), file);
    }
  }
  fs::path path(const std::string& name) const { return folder.path() / name; }

  TemporaryFolder folder;
};

void write_capture(const fs::path& file) {
  io::CaptureHeader header;
  header.camera = "small";
  header.width = 32;
  header.height = 24;
  io::CaptureWriter writer(file, header, {{"distance", TOFGRAPH_TYPE_F32, {24, 32}, "m", "", "", ""}},
                           {.compression = 1});
  std::vector<float> values(24 * 32, 1);
  for (std::size_t i = 0; i < 3; ++i) {
    const tofgraph_view view{.size = sizeof view,
                             .type = TOFGRAPH_TYPE_F32,
                             .rank = 2,
                             .data = values.data(),
                             .extent = {24, 32},
                             .stride = {128, 4}};
    writer.append({.size = sizeof(tofgraph_metadata),
                   .timestamp_ns = 1000 + static_cast<std::int64_t>(i),
                   .integration_time = 1e-3,
                   .modulation_frequency = 20e6},
                  {&view, 1});
  }
  writer.finish();
}

struct CaptureDamage {
  const char* name;
  void (*damage)(std::string& bytes);
};

class DamagedCapture : public Damaged, public testing::WithParamInterface<CaptureDamage> {};

TEST_P(DamagedCapture, IsOneErrorOfEachCommand) {
  write_capture(path("whole.h5"));
  std::string bytes = read_text(path("whole.h5"));
  GetParam().damage(bytes);
  write_text(path("bad.h5"), bytes);
  write_text(
      path("campaign.yaml"),
      "campaign: 1\ncamera: small.yaml\nconditions:\n"
      "  - {id: a, capture: bad.h5, board: {distance: 1 m}}\n  - {id: b, capture: whole.h5, board: {distance: 2 m}}\n");
  write_text(path("model.yaml"), "model: 1\ncamera: small.yaml\neffects: []\n");
  write_text(
      path("look.yaml"),
      "pipeline: 1\ncamera: small.yaml\nnodes:\n  - {stage: capture_reader, file: whole.h5}\n  - {stage: 'null'}\n");
  expect_refused(
      "bad.h5",
      {"run 'capture_reader file=FILE ! null' --camera small.yaml", "calibrate offset campaign.yaml -o k.yaml",
       "calibrate fixed-pattern campaign.yaml -o k.yaml", "calibrate noise campaign.yaml -o k.yaml",
       "report campaign.yaml -o r.html", "reduce campaign.yaml -o s",
       "diagnose --model model.yaml --data campaign.yaml -o gap", "run look.yaml --campaign campaign.yaml -o out",
       "run 'capture_reader file=whole.h5 ! mask bad_pixels={file: FILE, dataset: map} ! null' "
       "--camera small.yaml"});
  const std::string evaluation = "evaluate campaign.yaml -o e";  // readable content
  const Outcome outcome = shell("\"$TOFGRAPH\" " + evaluation, folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("a: left out: the capture bad.h5"));
  expect_no_library(evaluation, outcome);
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, DamagedCapture,
    testing::Values(CaptureDamage{"Cut", [](std::string& bytes) { bytes.resize(bytes.size() / 2); }},
                    CaptureDamage{"NoHdf5", [](std::string& bytes) { bytes.replace(0, 8, "nonsense"); }},
                    CaptureDamage{"Superblock",
                                  [](std::string& bytes) { bytes.replace(36, 8, std::string(8, '\x77')); }},
                    CaptureDamage{"Chunks",  // the compressed frames begin with these bytes
                                  [](std::string& bytes) {
                                    for (std::size_t at = 0; (at = bytes.find("\x78\x01", at)) != std::string::npos;
                                         ++at)
                                      bytes.replace(at + 2, 6, std::string(6, '\xff'));
                                  }}),
    [](const auto& kind) { return std::string(kind.param.name); });

class DamagedPicture : public Damaged {
 protected:
  /// Images whose parts are all present but invalid.
  void write(const std::string& name) const {
    cv::Mat picture(24, 32, CV_16U);
    cv::randu(picture, 0, 65535);
    std::vector<int> options;
    if (name.ends_with(".tif")) options = {cv::IMWRITE_TIFF_COMPRESSION, 5};
    cv::imwrite(path(name).string(), picture, options);
    std::string bytes = read_text(path(name));
    bytes.replace(bytes.size() / 2, 40, std::string(40, '\x5a'));
    write_text(path(name), bytes);
  }
};

TEST_F(DamagedPicture, IsOneErrorOfEachCommand) {
  write_capture(path("whole.h5"));
  write_text(path("card.yaml"),
             "scene: 1\ncamera: small.yaml\nframes: 1\noutput: taps\n"
             "objects: [{type: card, distance: 1 m, size: [1 m, 1 m], reflectivity: 0.5, image: bad.png}]\n");
  for (const std::string name : {"bad.png", "bad.tif"}) {
    write(name);
    expect_refused(name, {"convert FILE -o c.h5 --camera ./small.yaml",
                          "run 'capture_reader file=whole.h5 ! mask bad_pixels=FILE ! null' --camera small.yaml"});
  }
  expect_refused("bad.png", {"simulate card.yaml -o s.h5", "inspect FILE"});
}

TEST_F(DamagedPicture, MessagesOfOneThreadAreSeenWhileALibraryIsSilencedInAnother) {
  testing::internal::CaptureStderr();
  {
    const config::SilentLibraries silent;
    std::fputs("a library's", stderr);
    config::print_message("this program's");
    EXPECT_EQ(silent.words(), "a library's");
  }
  std::fputs("afterwards\n", stderr);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "this program's\nafterwards\n");
}

TEST_F(DamagedPicture, NoMessageVanishesWhileAnotherThreadSilencesLibraries) {
  constexpr std::ptrdiff_t messages = 20000;
  testing::internal::CaptureStderr();
  {
    const std::jthread library([](const std::stop_token& stop) {
      while (!stop.stop_requested()) const config::SilentLibraries silent;
    });
    for (std::ptrdiff_t i = 0; i < messages; ++i) config::print_message("this program's");
  }
  EXPECT_EQ(std::ranges::count(testing::internal::GetCapturedStderr(), '\n'), messages);
}

TEST_F(DamagedPicture, PixelsThatADecoderMadeUpAreNotUsed) {
  cv::Mat picture(48, 64, CV_8U);
  cv::randu(picture, 0, 255);
  cv::imwrite(path("good.jpg").string(), picture);
  EXPECT_EQ(io::decode_picture(path("good.jpg"), cv::IMREAD_UNCHANGED).size(), picture.size());
  const std::string whole = read_text(path("good.jpg"));
  const std::string damaged[] = {whole.substr(0, whole.size() / 2), whole.substr(0, whole.size() / 2) + "\xFF\xD9",
                                 whole.substr(0, whole.size() / 2) + whole.substr(whole.size() / 2 + 100)};
  for (const std::string& bytes : damaged) {
    write_text(path("bad.jpg"), bytes);
    EXPECT_THROW(io::decode_picture(path("bad.jpg"), cv::IMREAD_UNCHANGED), std::runtime_error) << bytes.size();
    EXPECT_THROW(io::decode_pages(path("bad.jpg")), std::runtime_error) << bytes.size();
  }
}

}  // namespace
}  // namespace tofgraph::tests
