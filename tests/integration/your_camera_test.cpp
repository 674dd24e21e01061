// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: *
// Rooms: foreign inspection plugins cli
// Every command of docs/your_camera.md, on files of a slanted wall written by Python in the vendors' layouts.
#include <gmock/gmock.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include "tests/guide.hpp"

#include <opencv2/imgcodecs.hpp>

#include <cmath>
#include <cstring>

namespace tofgraph::tests {
namespace {

constexpr const char* page = TOFGRAPH_SOURCE_DIR "/docs/your_camera.md";

/// The wall 0.3 x - 0.2 y + z = 1.4 m in the optical frame, seen by the module of the page; 0.3 mm of noise.
constexpr const char* files = R"(
import numpy as np, scipy.io, struct
w, h, fx, fy, cx, cy, k1, k2 = 80, 60, 70.0, 70.5, 40.2, 29.1, -0.12, 0.03
rng = np.random.default_rng(8)
def rays(fx, fy):
    v, u = np.mgrid[0:h, 0:w].astype(float)
    xd, yd = (u - cx) / fx, (v - cy) / fy
    x, y = xd.copy(), yd.copy()
    for _ in range(200):
        s = x * x + y * y
        x, y = xd / (1 + k1 * s + k2 * s * s), yd / (1 + k1 * s + k2 * s * s)
    n = np.sqrt(x * x + y * y + 1)
    return x / n, y / n, 1 / n
ux, uy, uz = rays(fx, fy)
r = 1.4 / (0.3 * ux - 0.2 * uy + uz)
noise = lambda: 0.0003 * rng.standard_normal((h, w))
z = [np.rint(1000 * (r + noise()) * uz).astype("<u2") for _ in range(3)]
np.stack(z).tofile("depth.raw")
A = 400 / r**2
# Raw phases: half of the path lamp - wall - lens - pixel; the lens is 2.8 mm before the sensor plane.
f, lamp = 2.8e-3, np.array([0.03, 0, 0])
vx, vy, vz = rays(70.0, 70.0)
q = 1.4 / (0.3 * vx - 0.2 * vy + vz)
P = np.stack([q * vx - lamp[0], q * vy - lamp[1], q * vz + f - lamp[2]])
D = (np.sqrt((P**2).sum(0)) + q + f / vz) / 2
psi = 4 * np.pi * 20e6 * D / 299792458.0
c = [[8000 / q**2 * np.cos(psi + k * np.pi / 2) + 2 * rng.standard_normal((h, w)) for k in range(4)] for _ in range(4)]
np.save("phases.npy", np.rint(np.array(c)).astype("<i2"))
R = np.stack([100 * (r + noise()) for _ in range(4)], axis=2)
scipy.io.savemat("scan.mat", {"R": R.astype("f4"), "A": np.stack([A] * 4, axis=2)}, do_compression=True)
with open("dump.bin", "wb") as out:
    out.write(b"VENDOR" + bytes(58))
    for i in range(4):
        codes = np.rint((r + noise()) * uz / 0.25e-3).astype("u2")
        codes[5, 7] = 0x3fff
        out.write(struct.pack(">QQ", i, 0) + (codes | 0x4000).astype(">u2").tobytes())
)";
constexpr const char* bag = R"(
import numpy as np, rosbag, rospy
from sensor_msgs.msg import Image, CameraInfo
z = np.fromfile("depth.raw", "<u2").reshape(3, 60, 80)
with rosbag.Bag("drive.bag", "w", compression="lz4") as out:
    for i in range(3):
        stamp = rospy.Time(1700000000, 50000000 * i)
        info = CameraInfo(); info.header.stamp, info.header.frame_id = stamp, "tof"
        info.height, info.width, info.distortion_model = 60, 80, "plumb_bob"
        info.D, info.K = [-0.12, 0.03, 0, 0, 0], [70.0, 0, 40.2, 0, 70.5, 29.1, 0, 0, 1]
        out.write("/tof/camera_info", info)
        for topic, image, encoding in [("depth", z[i], "16UC1"), ("amplitude", np.ones((60, 80), "f4"), "32FC1")]:
            m = Image(); m.header.stamp = stamp
            m.height, m.width, m.encoding, m.step, m.data = 60, 80, encoding, 80 * image.itemsize, image.tobytes()
            out.write("/tof/" + topic, m)
)";

/// RMS distance of a cloud's points from the wall, m.
double deviation(const std::filesystem::path& file, std::size_t min_points) {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  EXPECT_EQ(pcl::io::loadPCDFile(file.string(), cloud), 0) << file;
  double square = 0, count = 0;
  for (const pcl::PointXYZ& p : cloud) {
    if (!std::isfinite(p.z)) continue;
    const double beyond =
        (0.3 * static_cast<double>(p.x) - 0.2 * static_cast<double>(p.y) + static_cast<double>(p.z) - 1.4) /
        std::sqrt(1.13);
    square += beyond * beyond;
    ++count;
  }
  EXPECT_GE(count, static_cast<double>(min_points)) << file;
  return std::sqrt(square / count);
}

TEST(YourCamera, FiveStrangeFilesBecomeCorrectClouds) {
  const TemporaryFolder folder;
  const auto path = [&](const std::string& name) { return folder.path() / name; };
  write_text(path("files.py"), files);
  write_text(path("bag.py"), bag);
  const Outcome made = shell("/usr/bin/python3 files.py && /usr/bin/python3 bag.py", folder.path());
  if (made.err.find("ModuleNotFoundError") != std::string::npos) GTEST_SKIP() << "SciPy or rosbag is not installed";
  ASSERT_EQ(made.exit_code, 0) << made.err;
  std::string raw = read_text(path("depth.raw"));
  for (int i = 0; i < 3; ++i) {
    const cv::Mat picture(60, 80, CV_16U, raw.data() + i * 60 * 80 * 2);
    cv::imwrite(path("depth_" + std::to_string(i + 1) + ".png").string(), picture);
  }
  std::string said;
  for (const std::string& block : commands_of(page)) {
    const Outcome outcome = shell("set -e; export PATH=\"${TOFGRAPH%/*}:$PATH\"\n" + block, folder.path());
    ASSERT_EQ(outcome.exit_code, 0) << block << outcome.err;
    EXPECT_THAT(outcome.out, testing::HasSubstr("No defect was found in this scene")) << block;
    said += outcome.err;
  }
  // Rounding to 1 mm and 0.25 mm, plus the noise: 2 counts of about 4000 in a phase are 1 mm.
  const std::pair<const char*, double> clouds[] = {{"png_0.pcd", 0.0005},
                                                   {"npy_0.pcd", 0.0015},
                                                   {"bag_0.pcd", 0.0005},
                                                   {"mat_0.pcd", 0.0004},
                                                   {"bin_0.pcd", 0.0004}};
  for (const auto& [name, most] : clouds) {
    const double found = deviation(path(name), 60 * 80 - 1);
    std::printf("%s: %.3f mm (RMS) from the wall\n", name, 1e3 * found);
    EXPECT_LT(found, most) << name;
  }
  const Outcome wrong =
      shell("$TOFGRAPH inspect depth_1.png depth_2.png depth_3.png --camera ./module.yaml --as range --unit mm",
            folder.path());
  EXPECT_THAT(wrong.out, testing::HasSubstr("1. channel: the lengths are depth, not range"));
}

}  // namespace
}  // namespace tofgraph::tests
