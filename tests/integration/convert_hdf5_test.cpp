// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rooms: foreign plugins io/captures
// HDF5 files of other programs, written with the HDF5 library.
#include <gmock/gmock.h>
#include <hdf5.h>

#include "tests/small_conversion.hpp"

#include <random>

using namespace tofgraph::tests;
using testing::HasSubstr;

namespace {

constexpr hsize_t frame_count = 5;

/// Properties of a dataset other than its values.
struct Stored {
  hid_t type = H5T_STD_U16LE;
  bool compressed = false;
  std::string unit;
};

class ConvertHdf5 : public SmallConversion {
 protected:
  void SetUp() override {
    SmallConversion::SetUp();
    std::mt19937 random(4);
    for (std::size_t i = 0; i < frame_count * small_pixels; ++i)
      values_.push_back(static_cast<double>(random() % 100 + 1));
  }

  /// Creates a file, to which add() adds arrays.
  void create(const std::string& name) {
    file_ = H5Fcreate(path(name).c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  }
  void close() const { ASSERT_GE(H5Fclose(file_), 0); }

  void add(const std::string& dataset, const std::vector<hsize_t>& extent, const std::vector<double>& values,
           const Stored& stored = {}) const {
    const hid_t space = H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr);
    const hid_t links = H5Pcreate(H5P_LINK_CREATE), creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_create_intermediate_group(links, 1);
    if (stored.compressed) {
      std::vector<hsize_t> chunk = extent;
      chunk[0] = std::min<hsize_t>(chunk[0], 2);
      H5Pset_chunk(creation, static_cast<int>(chunk.size()), chunk.data());
      H5Pset_shuffle(creation);
      H5Pset_deflate(creation, 6);
    }
    const hid_t data = H5Dcreate2(file_, dataset.c_str(), stored.type, space, links, creation, H5P_DEFAULT);
    ASSERT_GE(data, 0);
    ASSERT_GE(H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
    if (!stored.unit.empty()) {
      const hid_t text = H5Tcopy(H5T_C_S1), scalar = H5Screate(H5S_SCALAR);
      H5Tset_size(text, stored.unit.size());
      const hid_t attribute = H5Acreate2(data, "units", text, scalar, H5P_DEFAULT, H5P_DEFAULT);
      H5Awrite(attribute, text, stored.unit.data());
      H5Aclose(attribute);
      H5Sclose(scalar);
      H5Tclose(text);
    }
    H5Dclose(data);
    H5Pclose(creation);
    H5Pclose(links);
    H5Sclose(space);
  }

  static std::vector<float> as_floats(const std::vector<double>& values, double scale = 1) {
    std::vector<float> result;
    for (const double value : values) result.push_back(static_cast<float>(value * scale));
    return result;
  }

  std::vector<double> values_;  ///< 5 frames of 6 x 8 px
  hid_t file_ = -1;
};

TEST_F(ConvertHdf5, DatasetsOfEveryTypeAndByteOrderAreReadBitForBit) {
  const hid_t types[] = {H5T_IEEE_F32LE, H5T_IEEE_F32BE, H5T_IEEE_F64LE, H5T_IEEE_F64BE, H5T_STD_U8LE,
                         H5T_STD_I8BE,   H5T_STD_U16LE,  H5T_STD_U16BE,  H5T_STD_I16LE,  H5T_STD_I16BE,
                         H5T_STD_U32BE,  H5T_STD_I32LE,  H5T_STD_U64LE,  H5T_STD_I64BE};
  for (const hid_t type : types) {
    for (const bool compressed : {false, true}) {
      create("a.h5");
      add("camera/amplitude", {frame_count, 6, 8}, values_, {type, compressed, ""});
      close();
      const Outcome outcome = convert("a.h5 --as amplitude");
      ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
      EXPECT_EQ(frames<float>("amplitude"), as_floats(values_)) << H5Tget_size(type) << compressed;
    }
  }
}

TEST_F(ConvertHdf5, OneOfSeveralDatasetsIsChosenByItsPathAndCanBeInspected) {
  create("scan.hdf5");
  add("camera/z", {frame_count, 6, 8}, values_, {H5T_STD_U16BE, true, "cm"});
  add("camera/conf", {6, 8, frame_count}, values_);
  add("time", {frame_count}, {10, 20, 30, 40, 50}, {H5T_STD_I64LE, false, ""});
  close();
  const Outcome listed = tofgraph("convert --inspect scan.hdf5");
  ASSERT_EQ(listed.exit_code, 0) << listed.err;
  EXPECT_THAT(listed.out, HasSubstr("format hdf5, 3 arrays"));
  EXPECT_THAT(listed.out, testing::ContainsRegex("camera/z +uint16 +5 x 6 x 8 +1 to [0-9]+, 0 % zeros, in cm"));
  EXPECT_THAT(listed.out, testing::ContainsRegex("time +int64 +5 "));
  write_text(path("layout.yaml"),
             "layout: 1\ncamera: ./tiny.yaml\nchannels:\n  depth: {array: camera/z, axes: frame row column}\n"
             "  amplitude: {array: camera/conf, axes: row column frame}\ntimestamp: {array: time, unit: ms}\n");
  const Outcome outcome = tofgraph("convert scan.hdf5 -o out.h5 --layout layout.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(frames<float>("depth"), as_floats(values_, 0.01));
  EXPECT_EQ(frames<std::int64_t>("timestamp_ns")[4], 50'000'000);
  const std::vector<float> amplitude = frames<float>("amplitude");
  for (std::size_t i = 0; i < amplitude.size(); ++i)
    ASSERT_EQ(amplitude[i], static_cast<float>(values_[i % small_pixels * frame_count + i / small_pixels])) << i;
  EXPECT_EQ(tofgraph("inspect scan.hdf5 --layout layout.yaml").exit_code, 0);
  EXPECT_THAT(convert("scan.hdf5 --as depth=camera/y").err, HasSubstr("it has: camera/conf, camera/z, time"));
}

TEST_F(ConvertHdf5, ACaptureNeedsNoConversionAndAnotherFileIsNoCapture) {
  create("scan.h5");
  add("depth", {6, 8}, {values_.begin(), values_.begin() + small_pixels});
  close();
  ASSERT_EQ(convert("scan.h5 --as depth --unit cm").exit_code, 0);
  EXPECT_THAT(tofgraph("convert out.h5 -o again.h5 --camera ./tiny.yaml").err,
              HasSubstr("is a capture of this program"));
  EXPECT_THAT(tofgraph("inspect scan.h5").err, HasSubstr("--as CHANNEL=DATASET"));
}

TEST_F(ConvertHdf5, DamagedFilesAreOneErrorAndWhatIsNoArrayOfNumbersIsLeftAlone) {
  create("a.h5");
  add("depth", {frame_count, 6, 8}, values_, {H5T_STD_U16LE, true, "mm"});
  close();
  const std::string whole = read_text(path("a.h5"));
  for (const std::size_t size : {whole.size() - 1, whole.size() / 2, std::size_t{600}, std::size_t{9}}) {
    write_text(path("cut.h5"), whole.substr(0, size));
    const Outcome outcome = convert("cut.h5 --as depth");
    EXPECT_EQ(outcome.exit_code, 2) << size;
    EXPECT_THAT(outcome.err, HasSubstr("cut.h5: the file ")) << size;
  }
  std::mt19937 random(7);
  for (int n = 0; n < 40; ++n) {  // files are read or rejected, without a crash
    std::string changed = whole;
    for (int k = 0; k < 6; ++k) changed[random() % changed.size()] = static_cast<char>(random() % 256);
    write_text(path("changed.h5"), changed);
    const Outcome outcome = convert("changed.h5 --as depth");
    EXPECT_TRUE(outcome.exit_code >= 0 && outcome.exit_code <= 2) << n << outcome.err;
  }
  create("text.h5");
  const hid_t text = H5Tcopy(H5T_C_S1), scalar = H5Screate(H5S_SCALAR);
  H5Tset_size(text, 8);
  H5Dclose(H5Dcreate2(file_, "note", text, scalar, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Sclose(scalar);
  H5Tclose(text);
  close();
  EXPECT_THAT(convert("text.h5 --as depth --unit mm").err, HasSubstr("no dataset that is an array of numbers"));
}

}  // namespace
