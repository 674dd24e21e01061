// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Images that end too early, declare too large a size, or are stored in unusual ways.
#include <gmock/gmock.h>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <algorithm>
#include <cstring>

#include "io/npy.hpp"
#include "io/picture_file.hpp"
#include "tests/program.hpp"
#include "tests/unit/message_of.hpp"

namespace tofgraph::io {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class DamagedImage : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return (folder_.path() / name).string(); }

  std::string npy(const std::string& type, const std::string& shape, const std::string& data, bool by_columns = false,
                  int version = 1) const {
    std::string header = fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': {}, }}", type,
                                     by_columns ? "True" : "False", shape);
    const std::size_t before = version == 1 ? 10 : 12;
    header.append(63 - (before + header.size()) % 64, ' ').push_back('\n');
    std::string bytes = "\x93NUMPY";
    bytes += static_cast<char>(version);
    bytes += '\0';
    for (std::size_t i = 0; i < before - 8; ++i) bytes += static_cast<char>(header.size() >> (8 * i));
    return bytes + header + data;
  }
  ImageData read(const std::string& bytes) const {
    tests::write_text(file("a.npy"), bytes);
    return read_npy(file("a.npy"));
  }
  std::string refusal(const std::string& bytes) const {
    return message_of([&] { read(bytes); });
  }
  static std::string picture_refusal(const std::string& name) {
    return message_of([&] { check_picture(name); });
  }

  tests::TemporaryFolder folder_;
};

template <class T> std::string bytes_of(const std::vector<T>& values, bool reversed = false) {
  std::string bytes;
  for (const T value : values) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof value);
    if (reversed) std::reverse(raw, raw + sizeof raw);
    bytes.append(raw, sizeof raw);
  }
  return bytes;
}

TEST_F(DamagedImage, NpyOfEachTypeAndOrderHasItsValues) {
  const std::vector<double> expected = {1, 2, 3, 4, 5, 6};
  const auto expect = [&](const std::string& bytes) {
    const ImageData image = read(bytes);
    EXPECT_EQ(image.rows, 2U);
    EXPECT_EQ(image.columns, 3U);
    EXPECT_EQ(image.values, expected);
  };
  expect(npy("<f8", "(2, 3)", bytes_of<double>({1, 2, 3, 4, 5, 6})));
  expect(npy(">f8", "(2, 3)", bytes_of<double>({1, 2, 3, 4, 5, 6}, true)));
  expect(npy("<f4", "(2,3)", bytes_of<float>({1, 2, 3, 4, 5, 6}), false, 2));
  expect(npy("<f4", "(2, 3)", bytes_of<float>({1, 4, 2, 5, 3, 6}), true));
  expect(npy(">u2", "(2, 3)", bytes_of<std::uint16_t>({1, 2, 3, 4, 5, 6}, true), false, 3));
  expect(npy("|u1", "(2, 3)", bytes_of<std::uint8_t>({1, 2, 3, 4, 5, 6})));
  expect(npy("<i8", "(2, 3)", bytes_of<std::int64_t>({1, 2, 3, 4, 5, 6})));
  EXPECT_EQ(read(npy("<i4", "(1, 2)", bytes_of<std::int32_t>({-7, 7}))).values, (std::vector<double>{-7, 7}));
}

TEST_F(DamagedImage, NpyThatDoesNotHoldWhatItAnnouncesIsRefused) {
  const std::string data = bytes_of<double>(std::vector<double>(6, 1));
  EXPECT_THAT(refusal(npy("<f8", "(2, 3)", data.substr(0, 24))),
              AllOf(HasSubstr("48 bytes in all, but 24 bytes follow"), HasSubstr("cut off")));
  EXPECT_THAT(refusal(npy("<f8", "(2, 3)", data + "x")),
              AllOf(HasSubstr("48 bytes in all, but 49"), HasSubstr("appended")));
  EXPECT_THAT(refusal(npy("<f8", "(2, 3)", "")), HasSubstr("but 0 bytes follow"));
  EXPECT_THAT(refusal(npy("<f8", "(4294967296, 4294967296)", data)), HasSubstr("announces 4294967296 x 4294967296"));
  EXPECT_THAT(refusal(npy("<f8", "(18446744073709551615, 2)", data)), HasSubstr("announces 18446744073709551615 x 2"));
  EXPECT_THAT(refusal(npy("<f8", "(99999999999999999999, 2)", data)), HasSubstr("a size of '99999999999999999999'"));
  EXPECT_THAT(refusal(npy("<f8", "(-2, -3)", data)), HasSubstr("announces a size of '-2'"));
  EXPECT_THAT(refusal(npy("<f8", "(0, 3)", "")), HasSubstr("announces 0 x 3 pixels"));
  EXPECT_THAT(refusal(npy("<f8", "(6,)", data)), HasSubstr("has 1 dimensions, expected 2"));
  EXPECT_THAT(refusal(npy("<f8", "()", data)), HasSubstr("has 0 dimensions"));
  EXPECT_THAT(refusal(npy("<f8", "(1, 2, 3, 1)", data)), HasSubstr("has 4 dimensions"));
  EXPECT_THAT(refusal(npy("<f8", "(1, 1, 6)", data)), HasSubstr("has 6 values a pixel, expected 1 to 3"));
  EXPECT_THAT(refusal(npy("<f8", "(1, 1, 2)", data)),
              HasSubstr("announces 1 x 1 x 2 values of 8 bytes, 16 bytes in all"));
  EXPECT_THAT(refusal(npy("<c16", "(2, 3)", data)), HasSubstr("type '<c16'"));
  EXPECT_THAT(refusal(npy("|O", "(2, 3)", data)), HasSubstr("type '|O'"));
  EXPECT_THAT(refusal("\x93NUMPY"), HasSubstr("ends within its header"));
  EXPECT_THAT(refusal(std::string("\x93NUMPY\x01\x00\xff\xff", 10)), HasSubstr("announces a header of 65535 bytes"));
  EXPECT_THAT(refusal(npy("<f8", "(2, 3)", data, false, 9)), HasSubstr("version 9"));
}

TEST_F(DamagedImage, PicturesOfEveryFormatThatWereCutOffAreRefused) {
  cv::Mat picture(64, 80, CV_16U);
  cv::randu(picture, 0, 65535);
  for (const std::string name : {"a.png", "a.tif", "a.jpg"}) {
    cv::Mat made;
    picture.convertTo(made, name == "a.jpg" ? CV_8U : CV_16U, name == "a.jpg" ? 1 / 257.0 : 1.0);
    ASSERT_TRUE(cv::imwrite(file(name), made));
    EXPECT_EQ(picture_refusal(file(name)), "no error") << name;
    const std::string whole = tests::read_text(file(name));
    for (const std::size_t kept : {whole.size() - 1, whole.size() * 3 / 4, whole.size() / 2, std::size_t{40}}) {
      tests::write_text(file("cut_" + name), whole.substr(0, kept));
      EXPECT_THAT(picture_refusal(file("cut_" + name)),
                  AllOf(HasSubstr("was cut off: it needs at least "), HasSubstr(fmt::format("but has {}", kept))))
          << name;
    }
  }
}

TEST_F(DamagedImage, PicturesThatAnnounceTooManyPixelsAreRefused) {
  cv::imwrite(file("a.png"), cv::Mat(4, 4, CV_16U, cv::Scalar(1)));
  std::string png = tests::read_text(file("a.png"));
  for (const std::size_t at : {18U, 22U}) png[at] = '\x7f';  // width and height in IHDR
  tests::write_text(file("bomb.png"), png);
  EXPECT_THAT(picture_refusal(file("bomb.png")), HasSubstr("announces 32516 x 32516 pixels"));
  cv::imwrite(file("a.jpg"), cv::Mat(4, 4, CV_8U, cv::Scalar(1)));
  std::string jpeg = tests::read_text(file("a.jpg"));
  const std::size_t frame = jpeg.find("\xFF\xC0");
  ASSERT_NE(frame, std::string::npos);
  jpeg.replace(frame + 5, 4, "\xFF\xFF\xFF\xFF");
  tests::write_text(file("bomb.jpg"), jpeg);
  EXPECT_THAT(picture_refusal(file("bomb.jpg")), HasSubstr("announces 65535 x 65535 pixels"));
}

}  // namespace
}  // namespace tofgraph::io
