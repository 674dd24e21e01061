// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Recorded captures read with HDF5's own interface: the stored values equal the written ones.
#include <gtest/gtest.h>
#include <hdf5.h>
#include <tofgraph/array.hpp>

#include "io/captures/capture.hpp"
#include "tests/program.hpp"
#include "tests/unit/capture_fixture.hpp"
#include "tests/unit/full_disk.hpp"
#include "tests/unit/raw_capture.hpp"

namespace tofgraph::tests {
namespace {

using io::CaptureReader;
using io::CaptureWriter;
namespace fs = std::filesystem;

io::CaptureHeader header_of(std::uint32_t width, std::uint32_t height) {
  io::CaptureHeader header;
  header.camera = "test";
  header.width = width;
  header.height = height;
  return header;
}

tofgraph_view view_of(std::vector<float>& values, const std::vector<std::uint64_t>& extent) {
  tofgraph_view view = empty_view();
  view.data = values.data();
  view.type = TOFGRAPH_TYPE_F32;
  view.rank = static_cast<std::uint32_t>(extent.size());
  std::int64_t stride = sizeof(float);
  for (std::size_t i = extent.size(); i-- > 0;) {
    view.extent[i] = extent[i];
    view.stride[i] = stride;
    stride *= static_cast<std::int64_t>(extent[i]);
  }
  return view;
}

/// Writes frames of 3 x 2 whose pixels all hold the frame number.
void append_number(CaptureWriter& writer, std::size_t number) {
  std::vector<float> values(6, static_cast<float>(number));
  const tofgraph_view view = view_of(values, {2, 3});
  tofgraph_metadata metadata{};
  metadata.timestamp_ns = 100 + static_cast<std::int64_t>(number);
  metadata.integration_time = 1e-3;
  metadata.modulation_frequency = 20e6;
  metadata.temperature = 300.15;
  metadata.time_since_power_on = std::nan("");
  metadata.device_number = 2 * number;
  writer.append(metadata, {&view, 1});
}

const io::CaptureChannel range_channel{"range", TOFGRAPH_TYPE_F32, {2, 3}, "m", "", "point_cloud", "distance rays"};

TEST_F(CaptureFile, WritesTheFormat) {
  for (const int compression : {0, 4}) {
    io::CaptureHeader header = header_of(3, 2);
    header.comment = "on a table";
    header.profile = "profile: 1\n";
    CaptureWriter writer(path, header, {range_channel}, {compression, true});
    for (std::size_t i = 0; i < 5; ++i) append_number(writer, i);
    EXPECT_TRUE(fs::exists(path.string() + ".part"));
    writer.finish();
    EXPECT_EQ(listing(folder.path()), std::vector<std::string>{"a.h5"});
    std::vector<float> expected(30);
    for (std::size_t i = 0; i < 30; ++i) expected[i] = static_cast<float>(i / 6);
    EXPECT_EQ(raw_values<float>(path, "/frames/range"), expected);
    EXPECT_EQ(raw_values<std::int64_t>(path, "/frames/timestamp_ns"),
              std::vector<std::int64_t>({100, 101, 102, 103, 104}));
    EXPECT_EQ(raw_values<std::uint64_t>(path, "/frames/frame_number"), std::vector<std::uint64_t>({0, 2, 4, 6, 8}));
    EXPECT_EQ(raw_values<float>(path, "/frames/temperature_c"), std::vector<float>(5, 27));
    EXPECT_EQ(raw_values<double>(path, "/frames/integration_time_s"), std::vector<double>(5, 1e-3));
    EXPECT_TRUE(std::isnan(raw_values<double>(path, "/frames/time_since_power_on_s")[4]));
    EXPECT_EQ(raw_text(path, "/", "format"), "tofgraph-capture");
    EXPECT_EQ(raw_text(path, "/", "comment"), "on a table");
    EXPECT_EQ(raw_text(path, "/", "profile"), "profile: 1\n");
    EXPECT_EQ(raw_text(path, "/", "serial"), "") << "what is not known is not there";
    EXPECT_EQ(raw_text(path, "/frames/range", "applied"), "point_cloud");
    EXPECT_EQ(raw_text(path, "/frames/range", "unit"), "m");
  }
}

TEST_F(CaptureFile, OneChunkAFrame) {
  CaptureWriter writer(path, header_of(3, 2), {range_channel});
  append_number(writer, 0);
  writer.finish();
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t set = H5Dopen2(file, "/frames/range", H5P_DEFAULT), creation = H5Dget_create_plist(set);
  hsize_t chunk[3] = {};
  EXPECT_EQ(H5Pget_chunk(creation, 3, chunk), 3);
  EXPECT_EQ(std::vector<hsize_t>(chunk, chunk + 3), std::vector<hsize_t>({1, 2, 3}));
  H5Pclose(creation);
  H5Dclose(set);
  H5Fclose(file);
}

TEST_F(CaptureFile, CanBeReadWhileItIsWritten) {
  CaptureWriter writer(path, header_of(3, 2), {range_channel});
  for (std::size_t i = 0; i < 300; ++i) append_number(writer, i);
  const Outcome outcome = shell("\"$TOFGRAPH\" run 'capture_reader file=a.h5.part ! null'", folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  expect_words(outcome.err, {"is still being recorded or was cut off: 300 frames complete"});
  append_number(writer, 300);
  writer.finish();
  EXPECT_EQ(CaptureReader(path).frames(), 301U);
}

TEST_F(CaptureFile, RefusesFramesThatAreNotAsAnnounced) {
  CaptureWriter writer(path, header_of(3, 2), {range_channel});
  std::vector<float> values(6);
  const tofgraph_view wrong = view_of(values, {3, 2});
  expect_words(thrown([&] {
                 writer.append({}, {&wrong, 1});
               }),
               {"frame 0 of range is float32 3 x 2, expected float32 2 x 3 without gaps"});
}

TEST_F(CaptureFile, DoesNotReplaceARecordingOrWhatIsLeftOfOne) {
  write_text(path, "precious");
  const auto why_not = [&] { return thrown([&] { CaptureWriter writer(path, header_of(3, 2), {range_channel}); }); };
  expect_words(why_not(), {"a.h5 already exists"});
  fs::rename(path, path.string() + ".part");
  expect_words(why_not(), {"a.h5.part already exists"});
  expect_words(thrown([&] {
                 CaptureWriter(path, header_of(3, 2), {range_channel}, {0, true});
               }),
               {"a.h5.part already exists", "read it", "or move it away"});
  EXPECT_EQ(read_text(path.string() + ".part"), "precious");
}

TEST_F(CaptureFile, ASecondRecorderDoesNotTouchWhatTheFirstWrites) {
  CaptureWriter first(path, header_of(3, 2), {range_channel});
  append_number(first, 0);
  EXPECT_NE(thrown([&] { CaptureWriter(path, header_of(3, 2), {range_channel}, {0, true}); }), "");
  append_number(first, 1);
  first.finish();
  EXPECT_EQ(CaptureReader(path).frames(), 2U);
}

TEST_F(CaptureFile, WithoutFinishThePartStaysWithAllFrames) {
  {
    CaptureWriter writer(path, header_of(3, 2), {range_channel});
    for (std::size_t i = 0; i < 7; ++i) append_number(writer, i);
  }
  EXPECT_EQ(listing(folder.path()), std::vector<std::string>{"a.h5.part"});
  const CaptureReader reader(path.string() + ".part");
  EXPECT_EQ(reader.frames(), 7U);
  EXPECT_FALSE(reader.finished());
}

TEST_F(CaptureFile, AFullDiskIsAnErrorAndWhatWasWrittenCanBeRead) {
  const SmallDisk disk("4m");
  if (!disk.available()) GTEST_SKIP() << "no right to mount a small disk";
  const fs::path small = disk.path() / "a.h5";
  std::size_t written = 0;
  const std::string message = thrown([&] {
    CaptureWriter writer(small, header_of(200, 200), {{"range", TOFGRAPH_TYPE_F32, {200, 200}, "m", "", "", ""}});
    for (;; ++written) {
      std::vector<float> values(40000, static_cast<float>(written));
      const tofgraph_view view = view_of(values, {200, 200});
      writer.append({}, {&view, 1});
    }
  });
  expect_words(message, {"a.h5.part", "cannot"});
  EXPECT_FALSE(fs::exists(small));
  EXPECT_GT(written, 15U);  // 160 kB each
  const CaptureReader reader(small.string() + ".part");
  EXPECT_GE(reader.frames(), written);
  std::vector<float> last(40000);
  reader.read(0, written - 1, last.data());
  EXPECT_EQ(last, std::vector<float>(40000, static_cast<float>(written - 1)));
}

}  // namespace
}  // namespace tofgraph::tests
