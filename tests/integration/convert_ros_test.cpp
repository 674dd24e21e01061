// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: ConvertRos.Bags*:ConvertRos.Mcap*
// Rooms: foreign plugins
// Recordings written by ROS's rosbag and by the reference implementation of MCAP, converted to captures.
#include <gmock/gmock.h>
#include <hdf5.h>

#include "tests/small_capture.hpp"
#include "tests/unit/raw_capture.hpp"

#include <cmath>
#include <cstring>

using namespace tofgraph::tests;
using testing::HasSubstr;

namespace {

class ConvertRos : public testing::Test {
 protected:
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  Outcome convert(const std::string& arguments) const {
    return shell("$TOFGRAPH convert " + arguments + " -o out.h5 --force", folder_.path());
  }
  Outcome tofgraph(const std::string& arguments) const { return shell("$TOFGRAPH " + arguments, folder_.path()); }
  template <class T> std::vector<T> frames(const std::string& channel) const {
    return raw_values<T>(path("out.h5"), "/frames/" + channel);
  }
  /// Runs a script with Debian's Python. @returns false if its packages are not installed
  bool python(const std::string& script) const {
    write_text(path("write.py"), script);
    const Outcome outcome = shell("/usr/bin/python3 write.py", folder_.path());
    EXPECT_TRUE(outcome.exit_code == 0 || outcome.err.find("ModuleNotFoundError") != std::string::npos) << outcome.err;
    return outcome.exit_code == 0;
  }
  /// Runs a script with Node. NODE_PATH must name a folder with @mcap/core and @foxglove/rosmsg2-serialization.
  bool node(const std::string& script) const {
    write_text(path("write.js"), script);
    const Outcome outcome = shell("node write.js", folder_.path());
    const bool missing = outcome.exit_code == 127 || outcome.err.find("Cannot find module") != std::string::npos;
    EXPECT_TRUE(outcome.exit_code == 0 || missing) << outcome.err;
    return outcome.exit_code == 0;
  }

  /// Depth (1000 + 50 frame + pixel) mm, amplitude pixel / 4, three frames; pixel 7 of the second has none.
  void expect_images(const std::string& what) const {
    const std::vector<float> depth = frames<float>("depth"), amplitude = frames<float>("amplitude");
    const std::vector<std::uint16_t> flags = frames<std::uint16_t>("flags");
    ASSERT_EQ(depth.size(), 3 * small_pixels) << what;
    for (std::size_t i = 0; i < depth.size(); ++i) {
      const double millimetres =
          1000.0 + 50.0 * static_cast<double>(i / small_pixels) + static_cast<double>(i % small_pixels);
      const bool invalid = i == small_pixels + 7;
      EXPECT_TRUE(invalid ? std::isnan(depth[i]) : depth[i] == static_cast<float>(millimetres * 1e-3)) << what << i;
      EXPECT_EQ(flags[i], invalid ? 1 : 0) << what << i;
      EXPECT_EQ(amplitude[i], static_cast<float>(i % small_pixels) / 4) << what << i;
    }
    EXPECT_THAT(frames<std::int64_t>("timestamp_ns"),
                testing::ElementsAre(1700000000000000001, 1700000000033000001, 1700000000066000001))
        << what;
  }
  void expect_camera(const std::string& what) const {
    const std::string info = tofgraph("info out.h5 --json").out;
    EXPECT_THAT(info, HasSubstr("tof_optical_frame")) << what;
    const std::string profile = shell("h5dump -a /profile out.h5", folder_.path()).out;
    if (profile.empty()) return;  // h5dump is not installed
    EXPECT_THAT(profile, HasSubstr("distortion: [-0.28")) << what;
  }

 private:
  TemporaryFolder folder_;
};

constexpr const char* bags = R"(
import numpy as np, rosbag, rospy, struct
from sensor_msgs.msg import Image, CameraInfo, PointCloud2, PointField
from std_msgs.msg import String
def header(m, i):
    m.header.stamp = rospy.Time(1700000000, 33000000 * i + 1)
    m.header.frame_id = "tof_optical_frame"
    return m
def image(i, a, encoding, big=0, pad=0):
    m = header(Image(), i)
    m.height, m.width = a.shape
    m.encoding, m.is_bigendian, m.step = encoding, big, a.shape[1] * a.itemsize + pad
    m.data = b"".join(row.tobytes() + b"\xee" * pad for row in a)
    return m
pixel = np.arange(48).reshape(6, 8)
for compression in ["none", "bz2", "lz4"]:
    for order in "<>":
        with rosbag.Bag(f"{compression}{'le' if order == '<' else 'be'}.bag", "w", compression=compression, chunk_threshold=400) as bag:
            for i in range(3):
                info = header(CameraInfo(), i)
                info.height, info.width, info.distortion_model = 6, 8, "plumb_bob"
                info.D, info.K = [-0.28, 0.09, 0, 0, 0], [44.4, 0, 3.6, 0, 44.5, 2.4, 0, 0, 1]
                bag.write("/tof/camera_info", info)
                z = (1000 + 50 * i + pixel).astype(order + "u2")
                if i == 1: z[0, 7] = 0
                bag.write("/tof/depth", image(i, z, "16UC1", int(order == ">"), 6))
                bag.write("/tof/amplitude", image(i, (pixel / 4).astype(order + "f4"), "32FC1", int(order == ">")))
                bag.write("/colour", image(i, np.zeros((2, 6), "u1"), "rgb8"))
                bag.write("/note", String("hello"))
                m = header(PointCloud2(), i)
                x = (pixel % 8 - 3.6) / 44.4; y = (pixel // 8 - 2.4) / 44.5
                keep = [k for k in range(48) if (k + i) % 5]
                m.height, m.width, m.point_step = 1, len(keep), 20
                m.row_step, m.is_bigendian = 20 * len(keep), order == ">"
                m.fields = [PointField(n, o, 7, 1) for n, o in [("x", 4), ("y", 8), ("z", 12), ("intensity", 16)]]
                m.data = b"".join(struct.pack(order + "4x4f", 2 * x.flat[k], 2 * y.flat[k], 2, k) for k in keep)
                bag.write("/tof/points", m)
)";

TEST_F(ConvertRos, BagsInEitherByteOrderAndEveryCompressionAreReadBitForBit) {
  if (!python(bags)) GTEST_SKIP() << "rosbag is not installed";
  for (const std::string name : {"nonele", "nonebe", "bz2le", "bz2be", "lz4le", "lz4be"}) {
    const Outcome outcome = convert(name + ".bag --as depth=/tof/depth,amplitude=/tof/amplitude");
    ASSERT_EQ(outcome.exit_code, 0) << name << outcome.err;
    expect_images(name);
    expect_camera(name);
  }
  // Clouds with varying numbers of points. The lens distorts, so the profile of the pinhole camera is given.
  write_text(path("pinhole.yaml"),
             "profile: 1\nname: pinhole\nwidth: 8\nheight: 6\nfocal_length: [44.4 px, 44.5 px]\nprincipal_point: [3.6, "
             "2.4]\n");
  const Outcome outcome =
      convert("lz4be.bag --camera ./pinhole.yaml --as points=/tof/points,amplitude=/tof/points.intensity");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<float> points = frames<float>("points"), amplitude = frames<float>("amplitude");
  ASSERT_EQ(points.size(), 3 * 3 * small_pixels);
  for (std::size_t i = 0; i < 3 * small_pixels; ++i) {
    const bool there = (i % small_pixels + i / small_pixels) % 5 != 0;
    EXPECT_TRUE(there ? points[3 * i + 2] == 2.0F : std::isnan(points[3 * i + 2])) << i;
    EXPECT_TRUE(there ? amplitude[i] == static_cast<float>(i % small_pixels) : std::isnan(amplitude[i])) << i;
  }
}

TEST_F(ConvertRos, BagsWithoutTheTopicListThoseThatExist) {
  if (!python(bags)) GTEST_SKIP() << "rosbag is not installed";
  const Outcome missing = convert("nonele.bag --as depth=/camera/depth");
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("has no array '/camera/depth'; it has: /tof/amplitude, /tof/amplitude.stamp, "
                                     "/tof/depth,"));
  const Outcome inspected = tofgraph("convert --inspect nonele.bag");
  EXPECT_THAT(inspected.out, HasSubstr("sensor_msgs/Image, 16UC1"));
  EXPECT_THAT(inspected.out, HasSubstr("with a camera profile"));
  ASSERT_TRUE(
      python("import rosbag\nfrom std_msgs.msg import String\n"
             "with rosbag.Bag('other.bag', 'w') as bag: bag.write('/note', String('hello'))\n"));
  EXPECT_THAT(convert("other.bag --as depth").err, HasSubstr("/note  std_msgs/String, 1 messages"));
}

constexpr const char* mcaps = R"(
const { McapWriter } = require("@mcap/core");
const { MessageWriter } = require("@foxglove/rosmsg2-serialization");
const { execFileSync } = require("child_process");
const fs = require("fs");
const F = (type, name, more = {}) => ({ type, name, isComplex: false, ...more });
const C = (type, name, more = {}) => ({ type, name, isComplex: true, ...more });
const A = { isArray: true };
const common = [
  { name: "builtin_interfaces/Time", definitions: [F("int32", "sec"), F("uint32", "nanosec")] },
  { name: "std_msgs/Header", definitions: [C("builtin_interfaces/Time", "stamp"), F("string", "frame_id")] },
  { name: "sensor_msgs/RegionOfInterest", definitions: [F("uint32", "x_offset"), F("uint32", "y_offset"),
      F("uint32", "height"), F("uint32", "width"), F("bool", "do_rectify")] },
  { name: "sensor_msgs/PointField", definitions: [F("string", "name"), F("uint32", "offset"), F("uint8", "datatype"), F("uint32", "count")] }];
const types = {
  Image: [C("std_msgs/Header", "header"), F("uint32", "height"), F("uint32", "width"), F("string", "encoding"),
      F("uint8", "is_bigendian"), F("uint32", "step"), F("uint8", "data", A)],
  CameraInfo: [C("std_msgs/Header", "header"), F("uint32", "height"), F("uint32", "width"), F("string", "distortion_model"),
      F("float64", "d", A), F("float64", "k", { ...A, arrayLength: 9 }), F("float64", "r", { ...A, arrayLength: 9 }),
      F("float64", "p", { ...A, arrayLength: 12 }), F("uint32", "binning_x"), F("uint32", "binning_y"), C("sensor_msgs/RegionOfInterest", "roi")] };
function pack(program) {
  return (data) => new Uint8Array(execFileSync(program, ["-c", "-q"], { input: data }));
}
async function write(name, compression, useChunks) {
  const fd = fs.openSync(name, "w");
  let at = 0;
  const writable = { position: () => BigInt(at), write: async (data) => { fs.writeSync(fd, data); at += data.byteLength; } };
  const options = { writable, useChunks, chunkSize: 300 };
  if (compression) options.compressChunk = (data) => ({ compression, compressedData: pack(compression)(data) });
  const writer = new McapWriter(options);
  await writer.start({ profile: "ros2", library: "test" });
  const channels = {};
  for (const [topic, type] of [["/tof/depth", "Image"], ["/tof/amplitude", "Image"], ["/tof/camera_info", "CameraInfo"]]) {
    const schemaId = await writer.registerSchema({ name: "sensor_msgs/msg/" + type, encoding: "ros2msg", data: new Uint8Array() });
    channels[topic] = { id: await writer.registerChannel({ topic, schemaId, messageEncoding: "cdr", metadata: new Map() }),
                        cdr: new MessageWriter([{ definitions: types[type] }, ...common]) };
  }
  const send = async (topic, i, message) => {
    const time = 1700000000000000001n + BigInt(33000000 * i);
    message.header = { stamp: { sec: 1700000000, nanosec: 33000000 * i + 1 }, frame_id: "tof_optical_frame" };
    await writer.addMessage({ channelId: channels[topic].id, sequence: i, logTime: time, publishTime: time,
                              data: channels[topic].cdr.writeMessage(message) });
  };
  for (let i = 0; i < 3; ++i) {
    await send("/tof/camera_info", i, { height: 6, width: 8, distortion_model: "plumb_bob", d: [-0.28, 0.09, 0, 0, 0],
        k: [44.4, 0, 3.6, 0, 44.5, 2.4, 0, 0, 1], r: [1, 0, 0, 0, 1, 0, 0, 0, 1], p: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0],
        binning_x: 0, binning_y: 0, roi: { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false } });
    const z = new Uint16Array(48), a = new Float32Array(48);
    for (let k = 0; k < 48; ++k) { z[k] = i === 1 && k === 7 ? 0 : 1000 + 50 * i + k; a[k] = k / 4; }
    await send("/tof/depth", i, { height: 6, width: 8, encoding: "16UC1", is_bigendian: 0, step: 16, data: new Uint8Array(z.buffer) });
    await send("/tof/amplitude", i, { height: 6, width: 8, encoding: "32FC1", is_bigendian: 0, step: 32, data: new Uint8Array(a.buffer) });
  }
  await writer.end();
  fs.closeSync(fd);
}
(async () => {
  await write("plain.mcap", "", false);
  await write("chunks.mcap", "", true);
  await write("lz4.mcap", "lz4", true);
  await write("zstd.mcap", "zstd", true);
})().catch((error) => { console.error(error); process.exit(1); });
)";

TEST_F(ConvertRos, McapOfTheReferenceImplementationIsReadBitForBit) {
  if (!node(mcaps)) GTEST_SKIP() << "node, @mcap/core or @foxglove/rosmsg2-serialization is not in NODE_PATH";
  for (const std::string name : {"plain", "chunks", "lz4", "zstd"}) {
    const Outcome outcome = convert(name + ".mcap --as depth=/tof/depth,amplitude=/tof/amplitude");
    ASSERT_EQ(outcome.exit_code, 0) << name << outcome.err;
    expect_images(name);
    expect_camera(name);
  }
}

/// A record of MCAP.
std::string record(char operation, const std::string& content) {
  std::string text(1, operation);
  for (int i = 0; i < 8; ++i) text += static_cast<char>(content.size() >> (8 * i));
  return text + content;
}

TEST_F(ConvertRos, DamagedRecordingsAreOneError) {
  const std::string magic = std::string("\x89MCAP") + "0\r\n", bag = "#ROSBAG V2.0\n";
  const std::map<std::string, std::string> files = {
      {"empty.mcap", magic},
      {"cut.mcap", magic + record(1, "x").substr(0, 5) + std::string(8, '\x7f')},
      {"huge.mcap", magic + "\x06" + std::string(7, '\xff') + '\x0f'},
      {"bomb.mcap",
       magic + record(6, std::string(16, '\0') + std::string("\0\0\0\x20\0\0\0\0\0\0\0\0\x03\0\0\0lz4", 19) +
                             std::string("\x04\0\0\0\0\0\0\0abcd", 12))},
      {"orphan.mcap", magic + record(5, std::string(22, '\0'))},
      {"empty.bag", bag},
      {"cut.bag", bag + std::string("\xff\xff\xff\x7f", 4)},
      {"field.bag", bag + std::string("\x08\0\0\0\x04\0\0\0abcd\0\0\0\0", 16)}};
  for (const auto& [name, content] : files) {
    write_text(path(name), content);
    const Outcome outcome = convert(name + " --as depth --unit m");
    EXPECT_EQ(outcome.exit_code, 2) << name << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(name + ": the file ")) << name;
  }
}

}  // namespace
