// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Formats/DamagedRecordings.*
// Rooms: foreign plugins
// Files of every format with random bytes changed, removed and inserted: each is either read or gives one error.
// Intended for the address sanitizer; TOFGRAPH_MUTATIONS is the number of files per format (default 400).
#include <gtest/gtest.h>
#include <hdf5.h>

#include "foreign/foreign_file.hpp"
#include "plugins/sinks/mcap_file.hpp"
#include "tests/program.hpp"

#include <opencv2/imgcodecs.hpp>

#include <cstdlib>
#include <random>

using namespace tofgraph;
using tofgraph::tests::read_text;
using tofgraph::tests::write_text;

namespace {

constexpr const char* python_seeds = R"(
import numpy as np
a = np.arange(2 * 6 * 8).reshape(2, 6, 8)
np.save("a.npy", a.astype("<u2"))
np.save("b.npy", np.asfortranarray(a.astype(">f8")))
np.savez("a.npz", depth=a.astype("u2"), amplitude=a.astype("f4"))
np.savez_compressed("b.npz", depth=a.astype("u2"))
import scipy.io
scipy.io.savemat("a.mat", {"depth": a.astype("f4"), "t": np.arange(2.0)})
scipy.io.savemat("b.mat", {"depth": a.astype("u2")}, do_compression=True)
for name, compressed in [("c.mat", False), ("d.mat", True)]:
    scipy.io.savemat(name, {"S": {"t": 2.0, "camera": {"depth": a.astype("u2"), "empty": np.zeros((0, 2))}}},
                     do_compression=compressed)
)";
constexpr const char* rosbag_seeds = R"(
import numpy as np, rosbag, struct
from sensor_msgs.msg import Image, CameraInfo, PointCloud2, PointField
for name, compression in [("a", "none"), ("b", "bz2"), ("c", "lz4")]:
    with rosbag.Bag(name + ".bag", "w", compression=compression, chunk_threshold=200) as bag:
        for i in range(2):
            m = Image(); m.height, m.width, m.encoding, m.step, m.data = 6, 8, "16UC1", 16, bytes(range(96))
            bag.write("/depth", m)
            c = CameraInfo(); c.height, c.width, c.distortion_model = 6, 8, "plumb_bob"
            c.D, c.K = [0.1] * 5, [40, 0, 3, 0, 40, 2, 0, 0, 1]
            bag.write("/camera_info", c)
            p = PointCloud2(); p.height, p.width, p.point_step, p.row_step = 1, 8, 12, 96
            p.fields = [PointField(n, 4 * k, 7, 1) for k, n in enumerate("xyz")]
            p.data = struct.pack("<24f", *range(24))
            bag.write("/points", p)
)";

class DamagedRecordings : public testing::TestWithParam<std::string> {
 protected:
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }

  /// Small files of a format, written by other programs or by hand.
  std::vector<std::string> seeds(const std::string& format) const {
    cv::Mat picture(6, 8, CV_16U);
    for (int i = 0; i < 48; ++i) picture.at<std::uint16_t>(i / 8, i % 8) = static_cast<std::uint16_t>(500 + i);
    if (format == "picture") {
      for (const char* ending : {"png", "tif", "pgm"}) cv::imwrite(path(std::string("a.") + ending).string(), picture);
      cv::imwritemulti(path("b.tif").string(), std::vector<cv::Mat>{picture, picture});
      return {"a.png", "a.tif", "a.pgm", "b.tif"};
    }
    if (format == "csv") write_text(path("a.csv"), "1, 2, 3, 4\n5, 6.5, nan, 8\n9, 10, 11, 1e3\n");
    const std::string header =
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z i\nSIZE 4 4 4 2\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 4\n"
        "HEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 8\nDATA ";
    if (format == "pcd") {
      std::string rows;
      for (int i = 0; i < 8; ++i) rows += std::to_string(i) + " 1.5 2 7\n";
      write_text(path("a.pcd"), header + "ascii\n" + rows);
      write_text(path("b.pcd"), header + "binary\n" + std::string(8 * 14, '?'));
      return {"a.pcd", "b.pcd"};
    }
    const std::string ply =
        " 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n";
    if (format == "ply") {
      write_text(path("a.ply"), "ply\nformat ascii" + ply + "0 0 1\n1 0 1\n0 1 1\n1 1 1\n3 0 1 2\n");
      write_text(path("b.ply"),
                 "ply\nformat binary_little_endian" + ply + std::string(48, '?') + '\3' + std::string(12, '\1'));
      return {"a.ply", "b.ply"};
    }
    if (format == "mcap") return mcap_seeds();
    if (format == "hdf5") return hdf5_seeds();
    const auto run =
        tests::shell("/usr/bin/python3 seeds.py",
                     (write_text(path("seeds.py"), format == "bag" ? rosbag_seeds : python_seeds), folder_.path()));
    if (run.exit_code != 0 && format != "csv") return {};
    if (format == "bag") return {"a.bag", "b.bag", "c.bag"};
    if (format == "csv") return {"a.csv"};
    if (format == "mat") return {"a.mat", "b.mat", "c.mat", "d.mat"};
    return {"a." + format, "b." + format};
  }

  /// Contiguous, and in compressed chunks.
  std::vector<std::string> hdf5_seeds() const {
    const std::vector<std::uint16_t> values(96, 1500);
    const hsize_t extent[] = {2, 6, 8}, chunk[] = {1, 6, 8};
    for (const char* name : {"a.h5", "b.h5"}) {
      const hid_t file = H5Fcreate(path(name).c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
      const hid_t space = H5Screate_simple(3, extent, nullptr), creation = H5Pcreate(H5P_DATASET_CREATE);
      if (name[0] == 'b') H5Pset_chunk(creation, 3, chunk);
      if (name[0] == 'b') H5Pset_deflate(creation, 4);
      const hid_t data = H5Dcreate2(file, "depth", H5T_STD_U16LE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
      H5Dwrite(data, H5T_NATIVE_UINT16, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
      H5Dclose(data);
      H5Pclose(creation);
      H5Sclose(space);
      H5Fclose(file);
    }
    return {"a.h5", "b.h5"};
  }

  std::vector<std::string> mcap_seeds() const {
    for (const std::string compression : {"", "lz4", "zstd"}) {
      mcap::File file(path("m" + compression + ".mcap").string(), compression);
      const std::uint16_t image = file.add_channel("/depth", "sensor_msgs/msg/Image", "text"),
                          cloud = file.add_channel("/points", "sensor_msgs/msg/PointCloud2", "text");
      for (std::uint64_t time : {1, 2}) {
        mcap::Message m, p;
        m.header(1, "f").number(std::uint32_t{6}).number(std::uint32_t{8}).text("16UC1").number(std::uint8_t{0});
        m.number(std::uint32_t{16}).data(std::string(96, 'x').data(), 96);
        p.header(1, "f").number(std::uint32_t{1}).number(std::uint32_t{8}).number(std::uint32_t{3});
        for (std::uint32_t i = 0; i < 3; ++i)
          p.text(std::string(1, static_cast<char>('x' + i)))
              .number(4 * i)
              .number(std::uint8_t{7})
              .number(std::uint32_t{1});
        p.number(std::uint8_t{0})
            .number(std::uint32_t{12})
            .number(std::uint32_t{96})
            .data(std::string(96, '?').data(), 96);
        file.add(image, time, m);
        file.add(cloud, time, p.number(std::uint8_t{0}));
        file.end_chunk();
      }
      file.finish();
    }
    return {"m.mcap", "mlz4.mcap", "mzstd.mcap"};
  }

 private:
  tests::TemporaryFolder folder_;
};

/// Changes a file at one to four positions.
std::string mutated(std::string bytes, std::mt19937& random) {
  const auto below = [&random](std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
  };
  for (std::size_t changes = 1 + below(4); changes > 0 && !bytes.empty(); --changes) {
    const std::size_t near = below(2) == 0 ? std::min<std::size_t>(bytes.size(), 512) : bytes.size(), at = below(near);
    switch (below(7)) {
      case 0:
        bytes.resize(at);
        break;
      case 1:
        bytes.insert(at, std::string(1 + below(16), static_cast<char>(below(256))));
        break;
      case 2:
        bytes.erase(at, 1 + below(16));
        break;
      case 3: {
        static const std::string extremes[] = {std::string(8, '\xff'), std::string(8, '\0'), "\xff\xff\xff\x7f",
                                               std::string("\0\0\0\x80", 4), "99999999"};
        const std::string& value = extremes[below(std::size(extremes))];
        bytes.replace(at, value.size(), value);
        break;
      }
      case 4:
        bytes.insert(at, bytes.substr(below(bytes.size()), 64));
        break;
      default:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
    }
  }
  return bytes;
}

TEST_P(DamagedRecordings, AreReadOrAreOneError) {
  const char* given = std::getenv("TOFGRAPH_MUTATIONS");
  const int wanted = given != nullptr ? std::atoi(given) : 400;
  const graph::PluginRegistry registry({TOFGRAPH_BINARY_DIR "/lib/tofgraph/plugins"});
  const foreign::Formats formats(registry);
  std::vector<std::string> contents;
  for (const std::string& seed : seeds(GetParam())) contents.push_back(read_text(path(seed)));
  if (contents.empty()) GTEST_SKIP() << "the packages that write this format are not installed";
  std::mt19937 random(7);
  int whole = 0, refused = 0, crashed = 0;
  for (int i = 0; i < wanted; ++i) {
    const std::string bytes = mutated(contents[static_cast<std::size_t>(i) % contents.size()], random);
    write_text(path("mutated"), bytes);
    try {
      const foreign::ForeignFile file(formats, path("mutated"));
      for (std::size_t a = 0; a < file.arrays().size(); ++a) {
        const FileArray& array = file.arrays()[a];
        if (array.elements() == 0) continue;
        const std::uint64_t slice = array.elements() / array.extent[0] * array.bytes;
        ASSERT_LT(slice, std::uint64_t{1} << 32U) << i;
        std::vector<std::uint8_t> out(slice);
        file.read(a, 0, 1, out.data());
        file.read(a, array.extent[0] - 1, 1, out.data());
      }
      ++whole;
    } catch (const foreign::ForeignError& error) {
      const std::string text = error.what();
      ASSERT_EQ(text.find("bad_alloc"), std::string::npos) << i << text;
      ASSERT_EQ(text.find("length_error"), std::string::npos) << i << text;
      // HDF5 files are tried in a child process, whose report is part of the error.
      ASSERT_TRUE(text.find("Sanitizer") == std::string::npos || text.find("libhdf5") != std::string::npos)
          << i << text;
      crashed += text.find("crashed") != std::string::npos || text.find("libhdf5") != std::string::npos ? 1 : 0;
      ++refused;
    }
  }
  std::printf("%s: %d files read, %d refused, in %d of these the library crashed in a child process\n",
              GetParam().c_str(), whole, refused, crashed);
  EXPECT_EQ(whole + refused, wanted);
  EXPECT_GT(refused, 0);
}

INSTANTIATE_TEST_SUITE_P(Formats, DamagedRecordings,
                         testing::Values("npy", "npz", "mat", "picture", "csv", "pcd", "ply", "bag", "mcap", "hdf5"),
                         [](const auto& about) { return about.param; });

}  // namespace
