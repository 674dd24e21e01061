// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Images as parameters: written by other libraries in every file format, read once by the host.
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

#include <fmt/format.h>
#include <hdf5.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <fstream>

#include "io/captures/capture_map.hpp"
#include "tests/program.hpp"

namespace tofgraph {
namespace {

constexpr std::size_t rows = 204, columns = 204, pixels = rows * columns, some = 5 * columns + 7;

class ImageParameter : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return (folder_.path() / name).string(); }

  static std::vector<double> ramp(double step) {
    std::vector<double> values(pixels);
    for (std::size_t i = 0; i < pixels; ++i) values[i] = step * static_cast<double>(i);
    return values;
  }
  void write_hdf5(const std::string& name, const std::string& unit, const std::vector<double>& values,
                  std::size_t height = rows) const {
    io::write_pixel_maps(file(name), {{"map", unit, values}}, height, values.size() / height);
  }
  /// NumPy's format according to its specification: magic, version, length of the header, header, values.
  void write_npy(const std::string& name, const std::vector<double>& values, const std::string& further = "") const {
    std::string header =
        fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {}{}), }}", rows, columns, further);
    header.append(63 - (10 + header.size()) % 64, ' ').push_back('\n');
    std::ofstream out(file(name), std::ios::binary);
    out.write("\x93NUMPY\x01\x00", 8);
    const auto length = static_cast<std::uint16_t>(header.size());
    out.write(reinterpret_cast<const char*>(&length), 2);
    out << header;
    out.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * 8));
  }

  /// Value that the map adds to a pixel.
  static double added(const std::string& map) {
    Harness stage("add_map map=" + map, {TOFGRAPH_BINARY_DIR "/tests/plugins"});
    stage.camera("camcube2");
    stage.put<float>("distance", {rows, columns}, std::vector<float>(pixels, 1));
    stage.run();
    return static_cast<double>(stage.get<float>("distance")[some]) - 1;
  }
  static std::string refusal(const std::string& map) {
    try {
      added(map);
      return "";
    } catch (const std::exception& error) {
      return error.what();
    }
  }
  static void expect_refusal(const std::string& map, const std::string& words) {
    const std::string said = refusal(map);
    EXPECT_NE(said.find(words), std::string::npos) << said;
  }

  tests::TemporaryFolder folder_;
};

TEST_F(ImageParameter, OfAnHdf5DatasetHasItsUnit) {
  write_hdf5("si.h5", "", ramp(1e-7));
  write_hdf5("mm.h5", "mm", ramp(1e-4));
  const double expected = 1e-7 * static_cast<double>(some);
  EXPECT_NEAR(added(file("si.h5")), expected, 1e-6);
  EXPECT_NEAR(added(file("mm.h5")), expected, 1e-6);
  EXPECT_NEAR(added("{file: " + file("mm.h5") + ", dataset: map}"), expected, 1e-6);
  EXPECT_NEAR(added("{file: " + file("si.h5") + ", unit: mm}"), expected * 1e-3, 1e-7) << "what is written wins";
}

TEST_F(ImageParameter, OfAPngAndATiff) {
  cv::Mat counts(static_cast<int>(rows), static_cast<int>(columns), CV_16U), floats;
  for (std::size_t i = 0; i < pixels; ++i)
    counts.at<std::uint16_t>(static_cast<int>(i / columns), static_cast<int>(i % columns)) =
        static_cast<std::uint16_t>(i % 65536);
  counts.convertTo(floats, CV_32F, 1e-6);
  cv::imwrite(file("counts.png"), counts);
  cv::imwrite(file("floats.tif"), floats);
  EXPECT_NEAR(added("{file: " + file("counts.png") + ", unit: 0.01 mm}"), 1e-5 * static_cast<double>(some), 1e-6);
  EXPECT_NEAR(added(file("floats.tif")), 1e-6 * static_cast<double>(some), 1e-6);
}

TEST_F(ImageParameter, OfANumPyArray) {
  write_npy("map.npy", ramp(1e-7));
  EXPECT_NEAR(added(file("map.npy")), 1e-7 * static_cast<double>(some), 1e-6);
}

TEST_F(ImageParameter, ThatCannotBeIsToldWithItsFile) {
  write_hdf5("small.h5", "m", std::vector<double>(100 * 204), 100);
  write_hdf5("counts.h5", "counts", ramp(1));
  write_hdf5("nan.h5", "m", std::vector<double>(pixels, std::nan("")));
  std::ofstream(file("empty.h5"));
  std::ofstream(file("broken.npy")) << "no array";
  write_npy("rays.npy", std::vector<double>(2 * pixels), ", 2");
  cv::imwrite(file("colours.png"), cv::Mat(4, 4, CV_8UC3, cv::Scalar(1, 2, 3)));
  cv::imwrite(file("bytes.png"), cv::Mat(4, 4, CV_8U, cv::Scalar(1)));
  expect_refusal(file("absent.h5"), "there is no file " + file("absent.h5"));
  expect_refusal(file("small.h5"), "small.h5 is 204 x 100 px, the camera camcube2 has 204 x 204 (width x height)");
  expect_refusal(file("counts.h5"), "the unit of its values is 'counts', expected one of m");
  expect_refusal("{file: " + file("nan.h5") + ", unit: kg}", "the unit of its values is 'kg'");
  expect_refusal(file("nan.h5"), "values that are not finite");
  expect_refusal("{file: " + file("counts.h5") + ", dataset: none}", "no dataset 'none'");
  expect_refusal(file("empty.h5"), "empty.h5");
  expect_refusal(file("broken.npy"), "broken.npy is not a .npy");
  expect_refusal(file("rays.npy"), "has 3 dimensions, expected rows x columns");
  expect_refusal(file("colours.png"), "has 3 colour channels, expected one value per pixel");
  expect_refusal(file("bytes.png"), "has 8 bits per pixel, expected 16");
  expect_refusal("{file: " + file("bytes.png") + ", dataset: map}", "only .h5 files have");
  expect_refusal(file("map.bmp"), "there is no file");
  expect_refusal("{dataset: map}", "'file'");
}

TEST_F(ImageParameter, OfAMapThatAnnouncesMoreThanItHoldsIsRefused) {
  const auto write = [&](const std::string& name, hsize_t side) {
    const hsize_t extent[2] = {side, side}, chunk[2] = {100, 100};  // none of it is stored
    const hid_t h5 = H5Fcreate(file(name).c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t space = H5Screate_simple(2, extent, nullptr), creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(creation, 2, chunk);
    H5Dclose(H5Dcreate2(h5, "map", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, creation, H5P_DEFAULT));
    H5Pclose(creation);
    H5Sclose(space);
    H5Fclose(h5);
  };
  const std::vector<double> zeros(pixels, 0);
  const auto write_whole = [&](const std::string& name) {  // in compressed chunks that are smaller than the values
    write(name, 204);
    const hid_t h5 = H5Fopen(file(name).c_str(), H5F_ACC_RDWR, H5P_DEFAULT), creation = H5Pcreate(H5P_DATASET_CREATE);
    const hsize_t extent[2] = {rows, columns}, chunk[2] = {100, 102};
    H5Ldelete(h5, "map", H5P_DEFAULT);
    H5Pset_chunk(creation, 2, chunk);
    H5Pset_deflate(creation, 9);
    const hid_t space = H5Screate_simple(2, extent, nullptr);
    const hid_t data = H5Dcreate2(h5, "map", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, zeros.data());
    H5Dclose(data);
    H5Sclose(space);
    H5Pclose(creation);
    H5Fclose(h5);
  };
  write_whole("whole.h5");
  EXPECT_EQ(refusal(file("whole.h5")), "");
  write("bomb.h5", 20000);
  write("hollow.h5", 204);
  expect_refusal(file("bomb.h5"), "'map' announces 20000 x 20000 pixels");
  expect_refusal(file("hollow.h5"), "'map' is not stored whole");
}

TEST_F(ImageParameter, AFolderMustBeThere) {
  EXPECT_NO_THROW(Harness("add_map folder=" + folder_.path().string(), {TOFGRAPH_BINARY_DIR "/tests/plugins"}));
  try {
    Harness("add_map folder=" + file("absent"), {TOFGRAPH_BINARY_DIR "/tests/plugins"});
    FAIL() << "a folder that is not there was taken";
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find("is not an existing folder"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace tofgraph
