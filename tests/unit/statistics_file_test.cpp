// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rooms: io/captures
// Datasets of statistics are those of HDF5's own filters, which the program does not use for them.
#include "io/captures/statistics_file.hpp"

#include <gtest/gtest.h>
#include <hdf5.h>

#include "tests/program.hpp"

#include <random>

namespace tofgraph::tests {
namespace {

/// Normal sums of a camera with four phases.
io::Statistics statistics_of(std::uint32_t width, std::uint32_t height) {
  std::mt19937_64 random(width);
  std::normal_distribution<double> sum(1000, 30);
  io::Statistics s;
  s.header.facts.header.width = width;
  s.header.facts.header.height = height;
  s.header.facts.exposures = 4;
  s.sums.kind = "phases";
  const std::size_t pixels = std::size_t{width} * height;
  for (std::size_t i = 0; i < 4 * pixels; ++i) s.sums.sum.push_back(sum(random));
  for (std::size_t i = 0; i < pixels; ++i) {
    s.sums.square.push_back(sum(random));
    s.sums.intensity.push_back(sum(random));
    s.sums.bad.push_back(static_cast<std::uint8_t>(random() % 4));
  }
  return s;
}

template <class T> std::vector<T> stored(hid_t file, const char* name, hid_t type) {
  const hid_t set = H5Dopen2(file, name, H5P_DEFAULT), space = H5Dget_space(set);
  std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  EXPECT_GE(H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  H5Sclose(space);
  H5Dclose(set);
  return values;
}

std::vector<unsigned char> chunk(hid_t file, const char* name) {
  const hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
  const hsize_t first = 0;
  hsize_t size = 0;
  H5Dget_chunk_storage_size(set, &first, &size);
  std::vector<unsigned char> bytes(size);
  std::uint32_t left_out = 1;
  EXPECT_GE(H5Dread_chunk(set, H5P_DEFAULT, &first, &left_out, bytes.data()), 0);
  EXPECT_EQ(left_out, 0U);
  H5Dclose(set);
  return bytes;
}

/// Writes a dataset with HDF5's filters.
void write(hid_t file, const char* name, hid_t type, hid_t memory, const void* data, hsize_t size) {
  const hid_t space = H5Screate_simple(1, &size, nullptr), creation = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_chunk(creation, 1, &size);
  H5Pset_shuffle(creation);
  H5Pset_deflate(creation, 4);
  const hid_t set = H5Dcreate2(file, name, type, space, H5P_DEFAULT, creation, H5P_DEFAULT);
  EXPECT_GE(H5Dwrite(set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), 0);
  H5Dclose(set);
  H5Pclose(creation);
  H5Sclose(space);
}

TEST(StatisticsFile, HasTheDatasetsThatHdf5WouldWrite) {
  const TemporaryFolder folder;
  for (const auto& [width, height] : {std::pair{1U, 1U}, {5U, 3U}, {64U, 48U}}) {
    const io::Statistics s = statistics_of(width, height);
    const std::filesystem::path ours = folder.path() / (std::to_string(width) + ".stats");
    io::write_statistics(ours, s);
    const hid_t file = H5Fopen(ours.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    ASSERT_GE(file, 0);
    EXPECT_EQ(stored<double>(file, "sum", H5T_NATIVE_DOUBLE), s.sums.sum);
    EXPECT_EQ(stored<double>(file, "square", H5T_NATIVE_DOUBLE), s.sums.square);
    EXPECT_EQ(stored<double>(file, "intensity", H5T_NATIVE_DOUBLE), s.sums.intensity);
    EXPECT_EQ(stored<std::uint8_t>(file, "bad", H5T_NATIVE_UINT8), s.sums.bad);

    const hid_t other = H5Fcreate((folder.path() / "other.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    write(other, "sum", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, s.sums.sum.data(), s.sums.sum.size());
    write(other, "bad", H5T_STD_U8LE, H5T_NATIVE_UINT8, s.sums.bad.data(), s.sums.bad.size());
    for (const char* name : {"sum", "bad"}) EXPECT_EQ(chunk(file, name), chunk(other, name)) << name << width;
    H5Fclose(other);
    H5Fclose(file);

    const io::Statistics read = io::read_statistics(ours);
    EXPECT_EQ(read.sums.sum, s.sums.sum);
    EXPECT_EQ(read.sums.square, s.sums.square);
    EXPECT_EQ(read.sums.intensity, s.sums.intensity);
    EXPECT_EQ(read.sums.bad, s.sums.bad);
  }
}

}  // namespace
}  // namespace tofgraph::tests
