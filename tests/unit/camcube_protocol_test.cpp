// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "devices/camcube/protocol.hpp"

#include "config/diagnostics.hpp"
#include "tests/program.hpp"

#include <gmock/gmock.h>

namespace tofgraph::camcube {
namespace {

using testing::HasSubstr;

Protocol read(const std::string& text) {
  const tests::TemporaryFolder folder;
  tests::write_text(folder.path() / "p.yaml", text);
  return read_protocol(folder.path() / "p.yaml");
}

std::string refused(const std::string& text) {
  try {
    read(text);
  } catch (const config::ConfigurationError& error) {
    return error.what();
  }
  return "";
}

const std::string head = "protocol: 1\ndevice: {vendor: 0x1c28, product: 49155}\nendpoint: 0x82\n";

TEST(Protocol, ReadsWhatIsShipped) {
  const Protocol shipped = read_protocol(TOFGRAPH_SOURCE_DIR "/devices/camcube/software_camera.yaml");
  EXPECT_THAT(shipped.name, HasSubstr("not a real CamCube"));
  EXPECT_EQ(shipped.vendor, 0x1c28);
  EXPECT_EQ(shipped.product, 0xc003);
  EXPECT_EQ(shipped.endpoint, 0x82);
  EXPECT_FALSE(shipped.whole_frames);
  EXPECT_EQ(shipped.magic->bytes, (std::vector<std::uint8_t>{'T', 'F', 'G', 'I'}));
  EXPECT_EQ(shipped.commands.at("integration_time").front().bytes({1500, 0}),
            (std::vector<std::uint8_t>{1, 0xdc, 5, 0, 0}));
}

TEST(Protocol, ReadsTheExampleOfItsPage) {
  const std::string page = tests::read_text(TOFGRAPH_SOURCE_DIR "/docs/formats/protocol.md"), fence = "```";
  const std::size_t begin = page.find(fence + "yaml\n") + 8;
  EXPECT_EQ(read(page.substr(begin, page.find(fence, begin) - begin)).commands.size(), 2U);
}

TEST(Protocol, NumbersAreDecimalOrHexadecimalOfEitherOrder) {
  const Protocol protocol =
      read(head +
           "message: frame\nfields: {number: {offset: 2, type: u16be}, image: {offset: 0x1ff, type: u8}}\n"
           "commands: {start: [{bulk: 1, data: ff modulation_frequency:u64be 00}]}\n");
  EXPECT_EQ(protocol.product, 0xc003);
  EXPECT_TRUE(protocol.whole_frames);
  std::vector<std::uint8_t> header(512, 0);
  header[2] = 0x12;
  header[3] = 0x34;
  header[511] = 7;
  EXPECT_EQ(protocol.number->read(header), 0x1234U);
  EXPECT_EQ(protocol.image->read(header), 7U);
  EXPECT_EQ(read_number({4, false}, std::vector<std::uint8_t>{1, 2, 3, 4}), 0x04030201U);
  EXPECT_EQ(protocol.commands.at("start").front().bytes({0, 20'000'000}),
            (std::vector<std::uint8_t>{0xff, 0, 0, 0, 0, 0x01, 0x31, 0x2d, 0x00, 0}));
}

TEST(Protocol, ANumberWithoutRoomIsNotCutOff) {
  const Protocol protocol =
      read(head + "message: frame\ncommands: {start: [{bulk: 1, data: integration_time:u16le}]}\n");
  EXPECT_EQ(protocol.commands.at("start").front().bytes({0xffff, 0}).size(), 2U);
  EXPECT_THROW(static_cast<void>(protocol.commands.at("start").front().bytes({0x10000, 0})), std::out_of_range);
}

TEST(Protocol, NonsenseIsReportedWithItsPlaceAndAllAtOnce) {
  const std::string text = refused(
      "protocol: 1\n"
      "device: {vendor: 0x1c28, product: camcube}\n"
      "endpoint: 0x02\n"
      "mesage: image\n"
      "transfers: 1000\n"
      "fields:\n"
      "  number: {offset: 510, type: u32le}\n"
      "  image: {offset: 4, type: u9}\n"
      "  magic: {offset: 0, bytes: 5g}\n"
      "commands:\n"
      "  start:\n"
      "    - {control: [0x140, 0, 0, 0]}\n"
      "    - {bulk: 0x01}\n"
      "    - {bulk: 0x01, data: distance:u8}\n"
      "    - {control: [0x40, 1, 0, 0], answer: 00}\n"
      "  stop: now\n");
  for (const char* expected :
       {"p.yaml:2:35: error: 'product' is 'camcube', expected a whole number from 0 to 65535",
        "p.yaml:3:11: error: 'endpoint' is", "expected a whole number from 129 to 143 (0x81 to 0x8f)",
        "p.yaml:4:1: error: ", "did you mean 'message'?", "p.yaml:5:12: error: 'transfers'",
        "p.yaml:7:11: error: this is beyond the header's 512 bytes", "p.yaml:8:28: error: there is no type 'u9'",
        "p.yaml:9:29: error: 'bytes' is '5g', expected bytes of two hexadecimal digits",
        "p.yaml:12:17: error: expected request type, request", "p.yaml:13:7: error: a bulk transfer has no 'data'",
        "p.yaml:14:26: error: 'distance:u8' is neither a byte nor integration_time",
        "p.yaml:15:34: error: only a control transfer to the host has an answer",
        "p.yaml:16:9: error: the command 'stop' is 'now', expected a list of transfers"})
    EXPECT_THAT(text, HasSubstr(expected));
  const std::string magic = "fields: {magic: {offset: 0, bytes: 54}}\n";
  EXPECT_THAT(refused(head + magic), HasSubstr("have neither 'image' nor 'number'"));
  EXPECT_TRUE(read(head + magic + "message: frame\n").whole_frames);
  EXPECT_THAT(refused("protocol: 2\ndevice: {vendor: 1, product: 1}\nendpoint: 0x82\n"), HasSubstr("version"));
  EXPECT_THAT(refused("pipeline: 1\n"), HasSubstr("pipeline"));
  EXPECT_THAT(refused("- 1\n"), HasSubstr("error"));
}

}  // namespace
}  // namespace tofgraph::camcube
