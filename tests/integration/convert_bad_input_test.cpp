// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: ConvertBadInput.*
// Rooms: foreign plugins
// Files that are damaged, malicious, or contain something other than images of the camera.
#include <gmock/gmock.h>
#include <hdf5.h>

#include "tests/small_conversion.hpp"

#include <opencv2/imgcodecs.hpp>

#include <cmath>

using namespace tofgraph::tests;
using testing::HasSubstr;

namespace {

using ConvertBadInput = SmallConversion;

TEST_F(ConvertBadInput, AFileOfAnotherSizeOrOrderInASeriesIsToldBeforeAnythingIsWritten) {
  cv::imwrite(path("a_1.png").string(), cv::Mat(6, 8, CV_16U, cv::Scalar(1000)));
  cv::imwrite(path("a_2.png").string(), cv::Mat(8, 6, CV_16U, cv::Scalar(1000)));
  const Outcome size = convert("a_1.png a_2.png --as depth --unit mm");
  EXPECT_EQ(size.exit_code, 2);
  EXPECT_THAT(size.err, HasSubstr("a_2.png: differs from the first file of the series"));
  if (!python("np.save('b_1.npy', np.ones((6, 8)))\nnp.save('b_2.npy', np.asfortranarray(np.ones((6, 8))))\n"))
    GTEST_SKIP() << "NumPy is not installed";
  EXPECT_THAT(convert("b_1.npy b_2.npy --as amplitude").err, HasSubstr("(Fortran order)"));
}

TEST_F(ConvertBadInput, WhatIsNoNumberIsInvalidAndWhatHoldsNoNumbersIsRefused) {
  if (!python(R"(
z = np.full((6, 8), 1.5)
z[0, :3] = np.nan, np.inf, -np.inf
np.save("z.npy", z)
np.save("code.npy", np.where(np.arange(48).reshape(6, 8) < 12, -1, 1500).astype("i2"))
np.save("words.npy", np.array([["one", "two"]]))
np.savez("objects.npz", a=np.array([[{}]], dtype=object))
)"))
    GTEST_SKIP() << "NumPy is not installed";
  for (const std::string channel : {"depth --unit m", "amplitude"}) {
    ASSERT_EQ(convert("z.npy --as " + channel).exit_code, 0) << channel;
    const std::vector<float> values = frames<float>(channel.substr(0, channel.find(' ')));
    for (std::size_t i = 0; i < small_pixels; ++i) {
      EXPECT_EQ(std::isnan(values[i]), i < 3) << channel << i;
      if (channel != "amplitude") {
        EXPECT_EQ(frames<std::uint16_t>("flags")[i], i < 3 ? 1 : 0) << i;
      }
    }
  }
  EXPECT_THAT(tofgraph("convert --inspect z.npy").out, HasSubstr("0 % zeros, 6.2 % NaN or infinite"));
  EXPECT_THAT(tofgraph("convert --inspect code.npy").out, HasSubstr("-1 to 1500, 0 % zeros, 25 % negative"));
  EXPECT_THAT(convert("code.npy --as depth --unit mm").err, HasSubstr("are negative: taken as invalid"));
  EXPECT_THAT(convert("code.npy --as depth --unit mm --invalid -1").err, testing::Not(HasSubstr("taken as")));
  EXPECT_THAT(convert("words.npy --as amplitude").err, HasSubstr("holds elements of type '<U3'"));
  EXPECT_THAT(convert("objects.npz --as amplitude").err, HasSubstr("holds elements of type '|O'"));
  if (!python("import scipy.io\nscipy.io.savemat('text.mat', {'name': 'hello'})\n")) return;
  EXPECT_THAT(convert("text.mat --as amplitude").err, HasSubstr("no variable that is an array of real numbers"));
  // The dimensions list of a variable, with a declared size of 4 GB.
  std::string matlab = read_text(path("text.mat"));
  matlab.replace(128 + 8 + 16 + 4, 4, "\xf4\xff\xff\xff");
  write_text(path("text.mat"), matlab);
  EXPECT_THAT(convert("text.mat --as amplitude").err, HasSubstr("the head of a variable has no end"));
}

TEST_F(ConvertBadInput, NotesBesideTheMeasurementAreLeftAloneAndZerosOfAnAmplitudeAreValues) {
  if (!python(R"(
r = np.full((6, 8), 1.5)
r[0, :2] = 0
a = np.arange(48.0).reshape(6, 8)
np.savez("scan.npz", range=r, amplitude=a, note=np.array("made in the hall"), when=np.datetime64("2026-01-01"),
         more=np.array([{}], dtype=object))
np.savez("half.npz", range=r, amplitude=a.astype("f2"))
(np.full((6, 8), 700) | 0x8000 * (np.arange(48).reshape(6, 8) == 5)).astype("<u2").tofile("codes.raw")
)"))
    GTEST_SKIP() << "NumPy is not installed";
  const Outcome outcome = convert("scan.npz --as range=range,amplitude=amplitude --unit m --invalid 0");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (std::size_t i = 0; i < small_pixels; ++i) {
    EXPECT_EQ(frames<std::uint16_t>("flags")[i], i < 2 ? 1 : 0) << i << ": an amplitude of 0 is no lack of a range";
    EXPECT_EQ(frames<float>("amplitude")[i], static_cast<float>(i));
  }
  EXPECT_THAT(convert("half.npz --as range=range --unit m").err, HasSubstr("holds elements of type '<f2'"));
  write_text(path("codes.yaml"),
             "layout: 1\narrays:\n  raw: {type: uint16, shape: [6, 8]}\nchannels:\n"
             "  depth: {array: raw, axes: row column, unit: mm, invalid: [0x82bc]}\n");
  const Outcome codes = convert("codes.raw --layout codes.yaml");
  ASSERT_EQ(codes.exit_code, 0) << codes.err;
  for (std::size_t i = 0; i < small_pixels; ++i) EXPECT_EQ(frames<std::uint16_t>("flags")[i], i == 5 ? 1 : 0) << i;
}

TEST_F(ConvertBadInput, DamagedFilesEndInOneClearError) {
  const bool there = python("a = np.ones((5, 6, 8), 'f4')\nnp.save('a.npy', a)\nnp.savez_compressed('a.npz', a=a)\n");
  if (!there) GTEST_SKIP() << "NumPy is not installed";
  for (const std::string name : {"a.npy", "a.npz"}) {
    const std::string whole = read_text(path(name));
    for (const std::size_t size : {whole.size() / 2, whole.size() - 1, std::size_t{3}}) {
      write_text(path(name), whole.substr(0, size));
      const Outcome outcome = convert(name + " --as amplitude");
      EXPECT_NE(outcome.exit_code, 0) << name << size;
      EXPECT_LT(outcome.exit_code, 3) << outcome.err;
      EXPECT_THAT(outcome.err, HasSubstr("error: "));
    }
  }
  // A flipped byte in an uncompressed archive: detectable only by its checksum.
  ASSERT_TRUE(python("np.savez('s.npz', a=np.ones((5, 6, 8), 'f4'))\n"));
  std::string stored_archive = read_text(path("s.npz"));
  stored_archive[stored_archive.size() / 2] ^= 4;
  write_text(path("s.npz"), stored_archive);
  EXPECT_THAT(convert("s.npz --as amplitude=a").err, HasSubstr("damaged archive"));
  // For an intact archive that cannot be read, the cause is stated.
  const std::pair<int, const char*> unreadable[] = {{6, "encrypted"}, {8, "compression"}};
  for (const auto& [offset, words] : unreadable) {
    ASSERT_TRUE(python("np.savez('u.npz', a=np.ones((5, 6, 8), 'f4'))\n"));
    std::string archive = read_text(path("u.npz"));
    const std::size_t local = archive.find("PK\x03\x04"), central = archive.find("PK\x01\x02");
    ASSERT_NE(central, std::string::npos);
    for (const std::size_t at : {local, central + 2}) archive[at + static_cast<std::size_t>(offset)] = 1;
    write_text(path("u.npz"), archive);
    EXPECT_THAT(convert("u.npz --as amplitude=a").err, testing::AllOf(HasSubstr(words), Not(HasSubstr("damaged"))));
  }
  // A member with a path outside the archive's folder is an ordinary array: nothing is unpacked.
  ASSERT_TRUE(
      python("import zipfile\nnp.save('b.npy', np.ones((6, 8)))\nz = zipfile.ZipFile('p.npz', 'w')\n"
             "z.write('b.npy', '../../b.npy')\nz.close()\n"));
  EXPECT_EQ(convert("p.npz --as amplitude").exit_code, 0);
  // A megabyte that would expand to a gigabyte.
  ASSERT_TRUE(python(
      "import zipfile\nwith zipfile.ZipFile('bomb.npz', 'w', zipfile.ZIP_DEFLATED) as z:\n"
      "  with z.open('a.npy', 'w') as f:\n"
      "    np.lib.format.write_array_header_1_0(f, dict(descr='|u1', fortran_order=False, shape=(2**25, 6, 8)))\n"
      "    for _ in range(48): f.write(bytes(2**25))\n"));
  EXPECT_THAT(convert("bomb.npz --as amplitude").err, HasSubstr("no measurement compresses that well"));
  // The same as a compressed variable of MATLAB.
  ASSERT_TRUE(python(R"(
import struct, zlib
size = 48 * 2**25
def element(kind, data): return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)
head = (element(6, struct.pack("<II", 9, 0)) + element(5, struct.pack("<iii", 6, 8, size // 48)) +
        element(1, b"depth") + struct.pack("<II", 2, size))
packer = zlib.compressobj(1)
packed = packer.compress(struct.pack("<II", 14, len(head) + size) + head)
for _ in range(48): packed += packer.compress(bytes(2**25))
packed += packer.flush()
with open("bomb.mat", "wb") as file:
    file.write(b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM")
    file.write(struct.pack("<II", 15, len(packed)) + packed)
)"));
  EXPECT_THAT(convert("bomb.mat --as amplitude").err, HasSubstr("no measurement compresses that well"));
  // Images that their decoder would accept.
  std::vector<cv::Mat> pages(3, cv::Mat(6, 8, CV_32F, cv::Scalar(1)));
  cv::imwritemulti(path("p.tiff").string(), pages);
  const std::string tiff = read_text(path("p.tiff"));
  write_text(path("p.tiff"), tiff.substr(0, tiff.size() - 20));
  EXPECT_NE(convert("p.tiff --as range --unit m").exit_code, 0);
  write_text(path("p.pgm"), "P5 30000 30000 65535\nxx");
  EXPECT_THAT(convert("p.pgm --as amplitude").err, HasSubstr("announces 30000 x 30000 pixels"));
  write_text(path("text.csv"), "1,2\n3,x\n");
  EXPECT_THAT(convert("text.csv --as amplitude").err, HasSubstr("has 'x' in line 2, expected a number"));
  write_text(path("binary.raw"), std::string("1\n\0\0", 4));
  EXPECT_THAT(convert("binary.raw --as amplitude").err, HasSubstr("no format recognises"));
  write_text(path("empty.npy"), "");
  EXPECT_THAT(convert("empty.npy --as amplitude").err, HasSubstr("the file is empty"));
  write_text(path("text.xyz"), "no numbers here");
  EXPECT_THAT(convert("text.xyz --as amplitude").err, HasSubstr("no format recognises"));
}

}  // namespace
