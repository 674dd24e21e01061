// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rooms: foreign plugins io/captures
// HDF5 files of other programs, written through the HDF5 C interface.
#include <gmock/gmock.h>
#include <hdf5.h>

#include "tests/small_conversion.hpp"

#include <fstream>
#include <random>

using namespace tofgraph::tests;
using testing::HasSubstr;

namespace {

constexpr hsize_t frame_count = 5;

/// Properties of a dataset apart from its values.
struct Stored {
  hid_t type = H5T_STD_U16LE;
  bool compressed = false;
  std::string unit;
  std::vector<std::pair<std::string, std::vector<double>>> numbers;  ///< further attributes
  std::string matlab_class;
};

void add_text(hid_t object, const char* name, const std::string& value) {
  if (value.empty()) return;
  const hid_t text = H5Tcopy(H5T_C_S1), scalar = H5Screate(H5S_SCALAR);
  H5Tset_size(text, value.size());
  const hid_t attribute = H5Acreate2(object, name, text, scalar, H5P_DEFAULT, H5P_DEFAULT);
  H5Awrite(attribute, text, value.data());
  H5Aclose(attribute);
  H5Sclose(scalar);
  H5Tclose(text);
}

class ConvertHdf5 : public SmallConversion {
 protected:
  void SetUp() override {
    SmallConversion::SetUp();
    std::mt19937 random(4);
    for (std::size_t i = 0; i < frame_count * small_pixels; ++i)
      values_.push_back(static_cast<double>(random() % 100 + 1));
  }

  /// Creates a file with the group `camera`; add() writes arrays to it.
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
    if (!values.empty()) {
      ASSERT_GE(H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
    }
    for (const auto& [name, numbers] : stored.numbers) {
      const hsize_t count = numbers.size();
      const hid_t list = count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr);
      const hid_t attribute = H5Acreate2(data, name.c_str(), H5T_IEEE_F64LE, list, H5P_DEFAULT, H5P_DEFAULT);
      ASSERT_GE(H5Awrite(attribute, H5T_NATIVE_DOUBLE, numbers.data()), 0);
      H5Aclose(attribute);
      H5Sclose(list);
    }
    add_text(data, "units", stored.unit);
    add_text(data, "MATLAB_class", stored.matlab_class);
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

/// MATLAB's version 7.3: a header of 512 bytes, and axes in reverse order.
TEST_F(ConvertHdf5, MatlabsFilesOfVersion73AreReadInMatlabsOrder) {
  const hid_t creation = H5Pcreate(H5P_FILE_CREATE);
  H5Pset_userblock(creation, 512);
  file_ = H5Fcreate(path("new.mat").c_str(), H5F_ACC_TRUNC, creation, H5P_DEFAULT);
  H5Pclose(creation);
  std::vector<double> turned;  // columns before rows
  for (hsize_t frame = 0; frame < frame_count; ++frame)
    for (std::size_t column = 0; column < 8; ++column)
      for (std::size_t row = 0; row < 6; ++row) turned.push_back(values_[(frame * 6 + row) * 8 + column]);
  add("S/camera/amplitude", {frame_count, 8, 6}, turned, {.type = H5T_IEEE_F64LE, .compressed = true});
  add("#refs#/a", {8, 6}, std::vector<double>(48, 1));
  add("text", {8, 6}, std::vector<double>(48, 65), {.matlab_class = "char"});
  add("nothing", {2}, {0, 3}, {.numbers = {{"MATLAB_empty", {1}}}, .matlab_class = "double"});
  add("sparse/data", {3}, {1, 2, 3});
  add("mask", {8, 6}, std::vector<double>(48, 1), {.type = H5T_STD_U8LE, .matlab_class = "logical"});
  const hid_t group = H5Gopen2(file_, "sparse", H5P_DEFAULT);
  add_text(group, "MATLAB_sparse", "6");
  H5Gclose(group);
  close();
  std::fstream(path("new.mat"), std::ios::binary | std::ios::in | std::ios::out)
      << "MATLAB 7.3 MAT-file, Platform: GLNXA64";
  const std::string listed = tofgraph("convert --inspect new.mat").out;
  EXPECT_THAT(listed, HasSubstr("S.camera.amplitude   float64  6 x 8 x 5"));
  EXPECT_THAT(listed, HasSubstr("mask"));
  for (const char* other : {"refs", "text", "nothing", "sparse"}) EXPECT_THAT(listed, testing::Not(HasSubstr(other)));
  const Outcome outcome = convert("new.mat --as amplitude=S.camera.amplitude");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(frames<float>("amplitude"), std::vector<float>(values_.begin(), values_.end()));
}

TEST_F(ConvertHdf5, PackedNumbersAreReadInTheUnitThatTheyState) {
  std::vector<double> z = values_;
  z[3] = 65535;
  create("a.h5");
  add("z", {frame_count, 6, 8}, z, {H5T_STD_U16LE, true, "m", {{"scale_factor", {0.001}}, {"_FillValue", {65535}}}});
  add("conf", {frame_count, 6, 8}, values_,
      {H5T_STD_I16BE, false, "", {{"scale_factor", {0.5}}, {"add_offset", {10}}, {"missing_value", {-1}}}});
  add("plain", {frame_count, 6, 8}, values_, {H5T_STD_U16LE, false, "", {{"scale_factor", {1}}, {"add_offset", {0}}}});
  add("two", {frame_count, 6, 8}, values_, {H5T_STD_U16LE, false, "m", {{"scale_factor", {1, 2}}}});
  z[3] = 9007199254740992.0;
  add("long", {frame_count, 6, 8}, z, {H5T_STD_I64LE, false, "", {{"_FillValue", {-1}}}});
  close();
  ASSERT_EQ(convert("a.h5 --as depth=z,amplitude=conf,intensity=plain").exit_code, 0);
  const std::vector<float> depth = frames<float>("depth"), amplitude = frames<float>("amplitude");
  for (std::size_t i = 0; i < values_.size(); ++i) {
    EXPECT_TRUE(i == 3 ? std::isnan(depth[i]) : depth[i] == static_cast<float>(0.001 * values_[i])) << i << depth[i];
    EXPECT_EQ(frames<std::uint16_t>("flags")[i], i == 3 ? 1 : 0) << i;
    EXPECT_EQ(amplitude[i], static_cast<float>(0.5 * values_[i] + 10)) << i;
  }
  EXPECT_EQ(frames<float>("intensity"), as_floats(values_));
  const std::string listed = tofgraph("convert --inspect a.h5").out;
  EXPECT_THAT(listed, HasSubstr("in m  (HDF5, unpacked: scale_factor 0.001, _FillValue 65535)"));
  EXPECT_THAT(listed, testing::ContainsRegex("plain +uint16 "));
  EXPECT_THAT(convert("a.h5 --as depth=two").err,
              HasSubstr("two has an attribute scale_factor that is not one number"));
  EXPECT_THAT(convert("a.h5 --as amplitude=long").err, HasSubstr("only numbers below 2^53 can be unpacked"));
}

TEST_F(ConvertHdf5, DatasetsThatAreTooLargeOrTooManyAreReportedAsSuch) {
  create("large.h5");
  add("large", {2, 40000, 40000}, {});
  add("conf", {frame_count, 6, 8}, values_);
  close();
  EXPECT_THAT(tofgraph("convert --inspect large.h5").out,
              testing::ContainsRegex("large +uint16 +2 x 40000 x 40000 .*large has 2.98 GiB per element"));
  EXPECT_EQ(convert("large.h5 --as amplitude=conf").exit_code, 0);
  create("many.h5");
  for (int n = 0; n <= 4096; ++n) add("a" + std::to_string(n), {1}, {1});
  close();
  const Outcome outcome = convert("many.h5 --as depth=a1");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("many.h5: the file has more than 4096 datasets"));
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
  for (int n = 0; n < 40; ++n) {  // read, or a single error; never a crash
    std::filesystem::remove(path("out.h5"));
    std::string changed = whole;
    for (int k = 0; k < 6; ++k) changed[random() % changed.size()] = static_cast<char>(random() % 256);
    write_text(path("changed.h5"), changed);
    const Outcome outcome = convert("changed.h5 --as depth");
    if (outcome.exit_code == 0) {
      EXPECT_EQ(frames<float>("depth").size(), values_.size()) << n;
      continue;
    }
    EXPECT_TRUE(outcome.exit_code == 1 || outcome.exit_code == 2) << n << outcome.err;
    EXPECT_THAT(outcome.err, testing::ContainsRegex("error: .*changed.h5: ")) << n;
    EXPECT_EQ(outcome.err.find("error: "), outcome.err.rfind("error: ")) << n << outcome.err;
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
