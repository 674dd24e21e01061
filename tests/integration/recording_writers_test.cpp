// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: RecordingWriters.ARecordingSurvives*
// Rooms: foreign plugins
// Captures written for other programs and read back; NumPy and the reference implementation of MCAP also read them.
#include <gmock/gmock.h>
#include <hdf5.h>

#include "tests/small_capture.hpp"
#include "tests/unit/raw_capture.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstring>

using namespace tofgraph::tests;
using testing::HasSubstr;

namespace {

constexpr std::size_t count = 3;

class RecordingWriters : public testing::Test {
 protected:
  void SetUp() override {
    write_text(path("tiny.yaml"), std::string(small_profile) + "distortion: [-0.1, 0.02, 0.001, -0.002, 0.003]\n");
    SmallCapture capture;
    SmallCapture::Image depth[count], amplitude[count], points[count];
    for (std::size_t f = 0; f < count; ++f) {
      std::vector<std::uint16_t> flags(small_pixels, 0);
      for (std::size_t i = 0; i < small_pixels; ++i) {
        const bool invalid = i == 5 + f;
        flags[i] = invalid ? 3 : 0;
        depth[f].push_back(invalid ? std::nanf("")
                                   : 1.0F + 0.1F * static_cast<float>(f) + 1e-7F * static_cast<float>(i * i));
        amplitude[f].push_back(100.125F * static_cast<float>(i + f));
        for (int k = 0; k < 3; ++k)
          points[f].push_back(invalid ? std::nanf("") : static_cast<float>(k + 1) * 0.3F + static_cast<float>(i) / 7);
      }
      capture.flags.push_back(flags);
      capture.timestamps.push_back(1700000000123456789 + static_cast<std::int64_t>(f) * 33333333);
    }
    capture.channels = {{"depth", {depth, depth + count}},
                        {"amplitude", {amplitude, amplitude + count}},
                        {"points", {points, points + count}}};
    capture.write(path("in.h5"));
  }
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  Outcome tofgraph(const std::string& arguments) const { return shell("$TOFGRAPH " + arguments, folder_.path()); }
  Outcome run(const std::string& sink) const {
    return tofgraph("run \"capture_reader file=in.h5 ! " + sink + "\" --camera ./tiny.yaml --force");
  }
  /// The dataset holds the same bytes in both captures.
  template <class T> void expect_same(const std::string& channel, const std::string& what) const {
    const std::vector<T> before = raw_values<T>(path("in.h5"), "/frames/" + channel),
                         after = raw_values<T>(path("out.h5"), "/frames/" + channel);
    ASSERT_EQ(before.size(), after.size()) << what << channel;
    for (std::size_t i = 0; i < before.size(); ++i)
      EXPECT_TRUE(before[i] == after[i] || (before[i] != before[i] && after[i] != after[i])) << what << channel << i;
  }

  TemporaryFolder folder_;
};

TEST_F(RecordingWriters, ARecordingSurvivesMcapInEveryCompression) {
  for (const std::string compression : {"none", "lz4", "zstd"}) {
    const Outcome written = run("mcap_writer path=a.mcap topics=/tof frame_id=tiny compression=" + compression);
    ASSERT_EQ(written.exit_code, 0) << written.err;
    const Outcome outcome = tofgraph(
        "convert a.mcap -o out.h5 --force --as depth=/tof/depth,amplitude=/tof/amplitude,points=/tof/points,"
        "flags=/tof/flags");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    for (const std::string channel : {"depth", "amplitude", "points"}) expect_same<float>(channel, compression);
    expect_same<std::uint16_t>("flags", compression);
    expect_same<std::int64_t>("timestamp_ns", compression);
  }
  const std::string inspected = tofgraph("convert --inspect a.mcap").out;
  EXPECT_THAT(inspected, HasSubstr("/tof/points.intensity"));
  EXPECT_THAT(inspected, HasSubstr("with a camera profile"));
}

TEST_F(RecordingWriters, TheReferenceImplementationOfMcapReadsWhatWasWritten) {
  ASSERT_EQ(run("mcap_writer path=a.mcap topics=/tof frame_id=tiny compression=none").exit_code, 0);
  write_text(path("read.js"), R"(
const { McapIndexedReader } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const fs = require("fs");
(async () => {
  const bytes = fs.readFileSync("a.mcap");
  const readable = { size: async () => BigInt(bytes.length),
                     read: async (at, size) => new Uint8Array(bytes.subarray(Number(at), Number(at + size))) };
  const reader = await McapIndexedReader.Initialize({ readable });
  const result = { count: Number(reader.statistics.messageCount), chunks: reader.chunkIndexes.length, messages: {} };
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId), schema = reader.schemasById.get(channel.schemaId);
    const text = new TextDecoder().decode(schema.data);
    const parsed = new MessageReader(parse(text, { ros2: true })).readMessage(message.data);
    const all = result.messages[channel.topic] ??= [];
    const data = parsed.data ? Buffer.from(parsed.data).toString("hex") : "";
    all.push({ type: schema.name, time: String(message.logTime), sec: parsed.header.stamp.sec,
               nanosec: parsed.header.stamp.nanosec, frame: parsed.header.frame_id, width: parsed.width,
               encoding: parsed.encoding, data, k: parsed.k && Array.from(parsed.k), d: parsed.d && Array.from(parsed.d),
               fields: parsed.fields && parsed.fields.map((field) => field.name + field.offset) });
  }
  console.log(JSON.stringify(result));
})().catch((error) => { console.error(error); process.exit(1); });
)");
  const Outcome outcome = shell("node read.js", folder_.path());
  if (outcome.exit_code == 127 || outcome.err.find("Cannot find module") != std::string::npos)
    GTEST_SKIP() << "node, @mcap/core or @foxglove/rosmsg2-serialization is not in NODE_PATH";
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto read = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(read["count"], 5 * count);  // depth, amplitude, points, flags, the camera
  EXPECT_EQ(read["chunks"], count);
  const auto& depth = read["messages"]["/tof/depth"];
  ASSERT_EQ(depth.size(), count);
  EXPECT_EQ(depth[1]["time"], "1700000000156790122");
  EXPECT_EQ(depth[1]["sec"], 1700000000);
  EXPECT_EQ(depth[1]["nanosec"], 156790122);
  EXPECT_EQ(depth[1]["frame"], "tiny");
  EXPECT_EQ(depth[1]["encoding"], "32FC1");
  std::string hex;
  const std::vector<float> values = raw_values<float>(path("in.h5"), "/frames/depth");
  for (std::size_t i = small_pixels; i < 2 * small_pixels; ++i) {
    unsigned char bytes[4];
    std::memcpy(bytes, &values[i], 4);
    char text[9];
    std::snprintf(text, sizeof text, "%02x%02x%02x%02x", bytes[0], bytes[1], bytes[2], bytes[3]);
    hex += text;
  }
  EXPECT_EQ(depth[1]["data"], hex);
  EXPECT_EQ(read["messages"]["/tof/points"][0]["fields"].dump(), R"(["x0","y4","z8","intensity12"])");
  const auto& camera = read["messages"]["/tof/camera_info"][0];
  EXPECT_EQ(camera["d"], (std::vector<double>{-0.1, 0.02, 0.001, -0.002, 0.003}));
  EXPECT_NEAR(camera["k"][0].get<double>(), 2 / 0.045, 1e-9);
  EXPECT_EQ(camera["k"][2], 3.5);
}

TEST_F(RecordingWriters, WhatViewersOfMcapWouldComputeWronglyIsSaid) {
  const Outcome pinhole = run("mcap_writer path=a.mcap");
  ASSERT_EQ(pinhole.exit_code, 0) << pinhole.err;
  EXPECT_THAT(pinhole.err, HasSubstr("place them 2 mm too far")) << "the focal length of the profile";
  std::string rays;
  for (std::size_t i = 0; i < small_pixels; ++i)
    rays += std::to_string(static_cast<double>(i % small_width) - 3.5) + "," +
            std::to_string(static_cast<double>(i / small_width) - 2.5) + ",44\n";
  write_text(path("rays.csv"), rays);
  write_text(path("table.yaml"),
             "profile: 1\nname: tiny\nwidth: 8\nheight: 6\npixel_pitch: 45 um\nrays: rays.csv\n"
             "modulation_frequency: 20 MHz\n");
  const Outcome table =
      tofgraph("run \"capture_reader file=in.h5 ! mcap_writer path=b.mcap topics=/tof\" --camera ./table.yaml");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  EXPECT_THAT(table.err, HasSubstr("no camera_info is written"));
  const std::string inspected = tofgraph("convert --inspect b.mcap").out;
  EXPECT_THAT(inspected, HasSubstr("/tof/points"));
  EXPECT_THAT(inspected, testing::Not(HasSubstr("with a camera profile"))) << "a pinhole without distortion is wrong";
}

TEST_F(RecordingWriters, ARecordingSurvivesNumPy) {
  for (const std::string channel : {"depth", "amplitude", "points", "flags"}) {
    const Outcome written = run("npy_writer path=" + channel + ".npy channel=" + channel);
    ASSERT_EQ(written.exit_code, 0) << written.err;
  }
  for (const std::string channel : {"depth", "amplitude", "points"}) {
    const std::string unit = channel == "amplitude" ? ""
                             : channel == "depth"   ? " --unit m"
                                                    : " --unit m --axes 'frame row column coordinate'";
    const Outcome outcome =
        tofgraph("convert " + channel + ".npy -o out.h5 --force --camera ./tiny.yaml --as " + channel + unit);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    expect_same<float>(channel, "npy ");
  }
  const Outcome numpy = shell(
      "/usr/bin/python3 -c \"import numpy as np; a = np.load('depth.npy'); f = np.load('flags.npy'); "
      "print(a.dtype, a.shape, f.dtype, f.shape, int(np.isnan(a).sum()), int((f == 3).sum()))\"",
      folder_.path());
  if (numpy.err.find("ModuleNotFoundError") != std::string::npos) GTEST_SKIP() << "NumPy is not installed";
  EXPECT_EQ(numpy.out, "float32 (3, 6, 8) uint16 (3, 6, 8) 3 3\n");
}

TEST_F(RecordingWriters, NumPyHasTheBytesOfAByteChannel) {
  const std::string images = "abcd";
  std::string dump;
  for (const char image : images) dump += std::string(512, image) + std::string(4 * small_pixels, '\0');
  write_text(path("a.raw"), dump);
  const Outcome written = tofgraph(
      "run 'pmd_raw_reader file=a.raw phase_order=[0,1,2,3] ! npy_writer path=h.npy channel=raw_headers' "
      "--camera ./tiny.yaml");
  ASSERT_EQ(written.exit_code, 0) << written.err;
  const std::string array = read_text(path("h.npy"));
  ASSERT_EQ(array.size(), 256 + 4 * 512U);
  EXPECT_THAT(array.substr(0, 256), HasSubstr("u1', 'fortran_order': False, 'shape': (1, 4, 512)"));
  for (std::size_t i = 0; i < images.size(); ++i)
    EXPECT_EQ(array.substr(256 + 512 * i, 512), std::string(512, images[i])) << i;
}

TEST_F(RecordingWriters, SixteenBitPicturesFollowTheConventionOfRos) {
  ASSERT_EQ(run("image_writer path=d_{frame}.png channel=depth format=uint16").exit_code, 0);
  const Outcome outcome = tofgraph("convert 'd_*.png' -o out.h5 --force --camera ./tiny.yaml --as depth --unit mm");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<float> before = raw_values<float>(path("in.h5"), "/frames/depth"),
                           after = raw_values<float>(path("out.h5"), "/frames/depth");
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(std::isnan(before[i]), std::isnan(after[i])) << i;
    EXPECT_TRUE(std::isnan(before[i]) || std::abs(before[i] - after[i]) < 0.000501F) << i;
  }
}

TEST_F(RecordingWriters, WhatCannotBeWrittenIsSaidBeforeTheFirstFrame) {
  const Outcome channel = run("npy_writer path=a.npy channel=range");
  EXPECT_EQ(channel.exit_code, 2);
  EXPECT_THAT(channel.err, HasSubstr("'range' is missing; the input has amplitude, depth, flags, points"));
  EXPECT_EQ(run("mcap_writer path=a.mcap topics=tof").exit_code, 2);
  ASSERT_EQ(run("mcap_writer path=a.mcap").exit_code, 0);
  const Outcome again = tofgraph("run \"capture_reader file=in.h5 ! mcap_writer path=a.mcap\" --camera ./tiny.yaml");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("a.mcap"));
}

}  // namespace
