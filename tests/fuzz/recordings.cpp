// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/fuzz/target.hpp"

#include "foreign/foreign_file.hpp"
#include "foreign/foreign_frames.hpp"
#include "io/captures/capture.hpp"
#include "io/profile.hpp"

#include <algorithm>

namespace tofgraph::fuzz {
namespace {

constexpr std::uint64_t largest = 1 << 22;  // bytes read at once

/// Opens a file as for a user, and reads the first and last element of every array of moderate size.
void foreign_file(const std::string& name, std::string_view bytes) {
  static const foreign::Formats formats(plugins());
  try {
    const foreign::ForeignFile file(formats, file_of(bytes, name));
    for (std::size_t i = 0; i < file.arrays().size(); ++i) {
      const std::vector<std::uint64_t>& extent = file.arrays()[i].extent;  // slowest axis first
      if (extent.empty() || extent[0] == 0) continue;
      std::uint64_t slice = file.arrays()[i].bytes;
      for (std::size_t axis = 1; axis < extent.size() && slice < largest; ++axis)
        slice = extent[axis] == 0 ? 0 : slice > largest / extent[axis] ? largest : slice * extent[axis];
      if (slice >= largest) continue;
      std::vector<std::uint8_t> out(std::max<std::size_t>(slice, 1));
      file.read(i, 0, 1, out.data());
      file.read(i, extent[0] - 1, 1, out.data());
    }
  } catch (const foreign::ForeignError&) {
  }
}

void npy(std::string_view bytes) { foreign_file("a.npy", bytes); }
void npz(std::string_view bytes) { foreign_file("a.npz", bytes); }
void mat(std::string_view bytes) { foreign_file("a.mat", bytes); }
void picture(std::string_view bytes) { foreign_file("a.png", bytes); }
void csv(std::string_view bytes) { foreign_file("a.csv", bytes); }
void pcd(std::string_view bytes) { foreign_file("a.pcd", bytes); }
void ply(std::string_view bytes) { foreign_file("a.ply", bytes); }
void bag(std::string_view bytes) { foreign_file("a.bag", bytes); }
void hdf5(std::string_view bytes) { foreign_file("a.hdf5", bytes); }
void mcap(std::string_view bytes) { foreign_file("a.mcap", bytes); }

/// Raw bytes with a fixed layout, as frames of a small camera: headers, byte order, masks and codes.
void raw_dump(std::string_view bytes) {
  static const io::CameraPtr camera = io::load_profile(
      file_of("profile: 1\nname: small\nwidth: 4\nheight: 3\npixel_pitch: 45 um\nfocal_length: 12.8 mm\n"
              "principal_point: [1.5, 1]\nmodulation_frequency: 20 MHz\nsources: [{position: [0 mm, 0 mm, 0 mm]}]\n",
              "small.yaml"));
  static const foreign::Layout layout = foreign::read_layout(
      file_of("layout: 1\nfile_header: 3\nframe_header: 2\n"
              "arrays:\n  raw: {type: uint16, byte_order: big, shape: [3, 4], image_header: 1}\n"
              "channels:\n  depth: {array: raw, axes: row column, unit: mm, mask: 0x1fff, invalid: [0, 8191]}\n",
              "raw_layout.yaml"));
  try {
    foreign::ForeignFrames frames(plugins(), {{file_of(bytes, "a.raw")}, layout, camera});
    std::vector<float> out(12);
    std::vector<std::uint16_t> flags(12);
    for (std::uint64_t i = 0; i < std::min<std::uint64_t>(frames.frames(), 3); ++i)
      frames.read(i, 0, out.data(), flags.data());
  } catch (const foreign::ForeignError&) {
  }
}

/// A capture: checked in a process of its own, in which HDF5 may crash, and opened if it passes.
void capture(std::string_view bytes) {
  try {
    const io::CaptureReader reader(file_of(bytes, "a.h5"));
    for (std::size_t i = 0; i < reader.channels().size(); ++i) {
      const std::uint64_t size = reader.channels()[i].bytes();
      if (reader.frames() == 0 || size > largest) continue;
      std::vector<std::uint8_t> out(size);
      reader.read(i, 0, out.data());
      reader.read(i, reader.frames() - 1, out.data());
    }
  } catch (const std::runtime_error&) {
  }
}

}  // namespace

std::vector<Target> recording_targets() {
  return {{"npy", "NumPy arrays", npy},
          {"npz", "NumPy archives", npz},
          {"mat", "MATLAB files", mat},
          {"picture", "PNG, TIFF, PGM", picture},
          {"csv", "tables of numbers", csv},
          {"pcd", "PCD clouds", pcd},
          {"ply", "PLY clouds", ply},
          {"bag", "ROS 1 bags", bag},
          {"mcap", "MCAP recordings", mcap},
          {"hdf5", "HDF5 files of other programs", hdf5},
          {"raw_dump", "headerless dumps under a layout", raw_dump},
          {"capture", "captures (HDF5)", capture}};
}

}  // namespace tofgraph::fuzz
