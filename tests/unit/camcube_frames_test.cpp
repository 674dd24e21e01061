// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Assembly of single transfers into frames, the frame counter, and the exchange between two threads.
#include "devices/camcube/frame_assembler.hpp"
#include "devices/camcube/frame_counter.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <thread>

namespace tofgraph::camcube {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr std::size_t pixels = 6, image_bytes = 512 + 4 * pixels;

/// Images with a magic byte, their index, a one-byte counter, and a time in us.
class Assembling : public testing::Test {
 protected:
  Assembling() {
    protocol_.magic = Magic{0, {0x7f}};
    protocol_.image = Field{1, {1, false}};
    protocol_.number = Field{2, {1, false}};
    protocol_.integration_time = Field{4, {2, false}};
    layout_.rows = 2;
    layout_.columns = 3;
    frame_.bytes.resize(layout_.frame_bytes());
  }
  FrameAssembler& assembler() {
    if (!assembler_)
      assembler_ = std::make_unique<FrameAssembler>(protocol_, layout_, FrameDefaults{NAN, 20e6}, frames_);
    return *assembler_;
  }
  static std::vector<std::uint8_t> image(unsigned number, unsigned index) {
    std::vector<std::uint8_t> bytes(image_bytes, static_cast<std::uint8_t>(16 * number + index));
    bytes[0] = 0x7f;
    bytes[1] = static_cast<std::uint8_t>(index);
    bytes[2] = static_cast<std::uint8_t>(number);
    bytes[4] = 0xe8;
    bytes[5] = 0x03;
    return bytes;
  }
  void send(unsigned number, unsigned first = 0, unsigned last = 3) {
    for (unsigned i = first; i <= last; ++i) assembler().message(image(number, i));
  }
  /// Number of the next frame, "nothing", or the error.
  std::string next() {
    try {
      if (!frames_.take(frame_, 0ms)) return "nothing";
      for (std::size_t i = 0; i < 4; ++i) {
        const std::uint8_t last = frame_.bytes[(i + 1) * image_bytes - 1];
        EXPECT_EQ(last % 16, i);
        EXPECT_EQ(last / 16, frame_.bytes[2] % 16);
      }
      return std::to_string(frame_.number);
    } catch (const Fault& fault) {
      EXPECT_FALSE(fault.lost);
      return fault.what();
    }
  }

  Protocol protocol_;
  RawSourceData layout_;
  FrameExchange frames_{8, 4 * image_bytes};
  std::unique_ptr<FrameAssembler> assembler_;
  RawFrame frame_;
};

TEST_F(Assembling, FramesComeWithTheirNumberAndTimes) {
  const std::int64_t before = now_ns();
  send(3);
  send(4);
  EXPECT_EQ(next(), "3");
  EXPECT_DOUBLE_EQ(frame_.integration_time, 1e-3);
  EXPECT_DOUBLE_EQ(frame_.modulation_frequency, 20e6);
  EXPECT_GE(frame_.timestamp_ns, before - 4'000'000);  // four exposures ago
  EXPECT_LE(frame_.timestamp_ns, now_ns() - 4'000'000);
  EXPECT_EQ(next(), "4");
  EXPECT_EQ(next(), "nothing");
}

TEST_F(Assembling, AMissingImageSpoilsItsFrameAndNoOther) {
  for (unsigned missing = 0; missing < 4; ++missing) {
    assembler_.reset();
    send(1);
    for (unsigned i = 0; i < 4; ++i)
      if (i != missing) send(2, i, i);
    send(3);
    EXPECT_EQ(next(), "1");
    EXPECT_EQ(next(), "half a frame: its image " + std::to_string(missing) + " is missing");
    EXPECT_EQ(next(), "3") << missing;
    EXPECT_EQ(next(), "nothing") << missing;
  }
}

TEST_F(Assembling, WhatIsNoImageSpoilsItsFrame) {
  for (unsigned bad = 0; bad < 4; ++bad) {
    assembler_.reset();
    for (unsigned i = 0; i < 4; ++i) {
      auto bytes = image(2, i);
      if (i == bad) bytes[0] = 0x55;
      assembler().message(bytes);
    }
    send(3);
    EXPECT_EQ(next(), "the header of an image has 55 at byte 0, expected 7f");
    EXPECT_EQ(next(), "3") << bad;
    assembler_.reset();
    for (unsigned i = 0; i < 4; ++i) {
      const auto bytes = image(2, i);
      assembler().message(std::span(bytes).first(i == bad ? 100 : bytes.size()));
    }
    send(3);
    EXPECT_EQ(next(), "a transfer delivered 100 bytes, an image of this camera has 536");
    EXPECT_EQ(next(), "3") << bad;
    EXPECT_EQ(next(), "nothing");
  }
}

TEST_F(Assembling, TheCounterWrapsAroundAndIsNotFooled) {
  send(254);
  send(255);
  send(0);
  send(2);  // frame 1 is lost
  EXPECT_EQ(next(), "254");
  EXPECT_EQ(next(), "255");
  EXPECT_EQ(next(), "256");
  EXPECT_EQ(next(), "258");
  send(2);
  EXPECT_EQ(next(), "frame 2 came twice");
  send(3, 0, 1);
  send(4, 2, 3);
  send(5);
  EXPECT_EQ(next(), "image 2 is of frame 4, those before it of frame 3");
  EXPECT_EQ(next(), "261");
}

TEST_F(Assembling, WithoutANumberFramesAreCounted) {
  protocol_.magic.reset();
  protocol_.number.reset();
  protocol_.integration_time.reset();
  send(1);
  const auto half = image(2, 0);
  assembler().message(std::span(half).first(9));
  send(2, 1, 3);
  send(3);
  send(4, 1, 3);
  send(5);
  EXPECT_EQ(next(), "0");
  EXPECT_TRUE(std::isnan(frame_.integration_time));
  EXPECT_THAT(next(), HasSubstr("a transfer delivered 9 bytes"));
  EXPECT_EQ(next(), "2");  // the corrupted frame counts
  EXPECT_THAT(next(), HasSubstr("image 0 is missing"));
  EXPECT_EQ(next(), "4");
}

/// After any loss, with either field: no frame is assembled from two frames, and the next complete one arrives.
TEST_F(Assembling, OneFieldIsEnoughToFindTheBeginningOfAFrame) {
  for (const bool by_number : {true, false}) {
    for (unsigned first = 0; first < 12; ++first) {
      for (unsigned lost = 0; lost < 9; ++lost) {
        if (by_number) protocol_.image.reset();
        if (!by_number) protocol_.number.reset();
        if (!by_number && lost % 4 == 0) continue;  // cannot be detected, see protocol.md
        assembler_.reset();
        for (unsigned i = 0; i < 32; ++i) {
          if (i == first && lost == 8) assembler().interrupted();
          if (i < first || i >= first + lost) send(i / 4 + 1, i % 4, i % 4);
        }
        std::vector<unsigned> frames;
        for (std::string one = next(); one != "nothing"; one = next())  // next() examines the frames
          if (one.size() == 1) frames.push_back(frame_.bytes[2]);
        for (unsigned frame = 1; frame <= 8; ++frame) {
          const bool touched = first < 4 * frame && first + lost > 4 * (frame - 1) && lost > 0;
          EXPECT_EQ(std::count(frames.begin(), frames.end(), frame), touched ? 0 : 1)
              << "frame " << frame << ", " << lost << " images lost from " << first << " on";
        }
        protocol_.image = Field{1, {1, false}};
        protocol_.number = Field{2, {1, false}};
      }
    }
  }
}

TEST_F(Assembling, WholeFramesBeginWithEachMessage) {
  protocol_.whole_frames = true;
  const auto whole = [](unsigned number) {
    std::vector<std::uint8_t> all;
    for (unsigned i = 0; i < 4; ++i)
      for (const std::uint8_t byte : image(number, i)) all.push_back(byte);
    return all;
  };
  for (const char* without : {"nothing", "image", "number", "both"}) {
    const std::string fields = without;
    protocol_.image = Field{1, {1, false}};
    protocol_.number = Field{2, {1, false}};
    if (fields == "image" || fields == "both") protocol_.image.reset();
    if (fields == "number" || fields == "both") protocol_.number.reset();
    assembler_.reset();
    EXPECT_EQ(assembler().message_bytes(), whole(1).size());
    const unsigned begin = protocol_.number ? 1 : 0;
    for (unsigned n = 1; n < 8; ++n) {
      const auto bytes = whole(n);
      assembler().message(std::span(bytes).first(n == 3 ? image_bytes : bytes.size()));
      if (n == 5) assembler().interrupted();
    }
    EXPECT_EQ(next(), std::to_string(begin)) << fields;
    EXPECT_EQ(next(), std::to_string(begin + 1)) << fields;
    EXPECT_THAT(next(), HasSubstr("a frame of this camera has 2144"));
    EXPECT_EQ(next(), std::to_string(begin + 3)) << fields;
    EXPECT_EQ(next(), std::to_string(begin + 4)) << fields;
    next();
    EXPECT_EQ(frame_.bytes[2], 6) << fields;
    next();
    EXPECT_EQ(frame_.bytes[2], 7) << fields;
    EXPECT_EQ(next(), "nothing");
  }
}

TEST_F(Assembling, ACounterThatGoesBackIsTold) {
  send(100);
  send(3);
  send(4);
  EXPECT_EQ(next(), "100");
  EXPECT_EQ(next(), "the camera's counter went from 100 back to 3");
  EXPECT_EQ(next(), "3");
  EXPECT_EQ(next(), "4");
  auto bad = image(90, 0);  // a flipped bit: the frames after it keep their numbers
  assembler().message(bad);
  send(5, 1, 3);
  send(6);
  EXPECT_EQ(next(), "image 1 is of frame 5, those before it of frame 90");
  EXPECT_EQ(next(), "6");
}

TEST_F(Assembling, TimesThatCannotBeSpoilTheFrame) {
  protocol_.integration_time = Field{4, {8, false}};
  for (const std::uint8_t byte : {std::uint8_t{0}, std::uint8_t{0x7f}}) {
    for (unsigned i = 0; i < 4; ++i) {
      auto bytes = image(2U + byte, i);
      std::fill(bytes.begin() + 4, bytes.begin() + 12, byte);
      assembler().message(bytes);
    }
    EXPECT_THAT(next(), HasSubstr("a header states an integration time of "));
    EXPECT_EQ(next(), "nothing");
  }
}

/// A command that takes effect between two images: 1 ms before it, 2 ms after it.
TEST_F(Assembling, FramesOfTwoIntegrationTimesAreLeftOut) {
  for (unsigned changes = 1; changes < 4; ++changes) {
    assembler_.reset();
    send(1);
    for (unsigned number : {2U, 3U}) {
      for (unsigned i = 0; i < 4; ++i) {
        auto bytes = image(number, i);
        if (number == 3 || i >= changes) {
          bytes[4] = 0xd0;
          bytes[5] = 0x07;
        }
        assembler().message(bytes);
      }
    }
    EXPECT_EQ(next(), "1");
    EXPECT_DOUBLE_EQ(frame_.integration_time, 1e-3);
    EXPECT_EQ(next(), "3") << changes;
    EXPECT_DOUBLE_EQ(frame_.integration_time, 2e-3);
    EXPECT_EQ(next(), "nothing");
  }
}

TEST_F(Assembling, ATimeThatCannotBeInAnyHeaderSpoilsTheFrame) {
  for (unsigned bad = 0; bad < 4; ++bad) {
    assembler_.reset();
    for (unsigned i = 0; i < 4; ++i) {
      auto bytes = image(2, i);
      if (i == bad) bytes[4] = bytes[5] = 0;
      assembler().message(bytes);
    }
    send(3);
    EXPECT_THAT(next(), HasSubstr("a header states an integration time of 0 us")) << bad;
    EXPECT_EQ(next(), "3") << bad;
  }
}

TEST(FrameCounter, GoesOnBehindAGap) {
  FrameCounter counter;
  EXPECT_EQ(counter.number(5, 1, 80), 5U);
  EXPECT_EQ(counter.number(7, 1, 80), 7U);  // the device lost one
  counter.interrupted();
  EXPECT_EQ(counter.number(9, 1, 80), 9U);  // the counter went on
  counter.interrupted();
  EXPECT_EQ(counter.number(0, 0.5, 80), 49U);  // the counter restarted: 0.5 s are 40 frames, of which the last is here
  EXPECT_EQ(counter.number(1, 0.01, 80), 50U);
  counter.interrupted();
  EXPECT_EQ(counter.number(0, 5, NAN), 52U);  // at least one is missing
}

TEST(FrameExchange, KeepsTheNewestInOrder) {
  FrameExchange exchange(3, 4);
  RawFrame frame;
  frame.bytes.resize(4);
  for (std::uint64_t n = 0; n < 10; ++n) {
    frame.number = n;
    exchange.offer(frame);
  }
  for (const std::uint64_t n : {7U, 8U, 9U}) {
    ASSERT_TRUE(exchange.take(frame, 0ms));
    EXPECT_EQ(frame.number, n);
  }
  EXPECT_EQ(exchange.lost_frames(), 7U);
  EXPECT_FALSE(exchange.take(frame, 0ms));
  exchange.wake();
  EXPECT_FALSE(exchange.take(frame, 1h));
}

TEST(FrameExchange, FaultsComeInTheirPlaceAndTheGravestOfSeveralIsKept) {
  FrameExchange exchange(3, 4);
  RawFrame frame;
  const auto offer = [&](std::uint64_t n) {
    frame.bytes.resize(4);
    frame.number = n;
    exchange.offer(frame);
  };
  const auto next = [&]() -> std::string {
    try {
      return exchange.take(frame, 0ms) ? std::to_string(frame.number) : "nothing";
    } catch (const Fault& fault) {
      return std::string(fault.what()) + (fault.lost ? ", lost" : "");
    }
  };
  offer(1);
  exchange.fail(Fault("short", false));
  exchange.fail(Fault("another", false));
  offer(2);
  exchange.fail(Fault("short", false));
  exchange.fail(Fault("unplugged", true));
  exchange.fail(Fault("cannot be asked", true));
  for (const char* expected : {"1", "short", "2", "unplugged, lost", "nothing"}) EXPECT_EQ(next(), expected);
  // A reader that is slower than the camera is reported too.
  exchange.fail(Fault("first", false));
  offer(1);
  exchange.fail(Fault("second", true));
  for (std::uint64_t n = 2; n < 12; ++n) offer(n);
  for (const char* expected : {"second, lost", "9", "10", "11", "nothing"}) EXPECT_EQ(next(), expected);
  exchange.fail(Fault("old", true));
  offer(1);
  exchange.clear();
  EXPECT_EQ(next(), "nothing");
}

TEST(FrameExchange, LosesNothingBetweenTwoThreadsThatKeepUp) {
  FrameExchange exchange(64, 8);
  std::atomic<std::uint64_t> read{0};
  std::jthread writer([&] {
    RawFrame frame;
    frame.bytes.resize(8);
    for (std::uint64_t n = 0; n < 20'000; ++n) {
      while (n > read.load() + 32) std::this_thread::yield();
      frame.number = n;
      frame.bytes[0] = static_cast<std::uint8_t>(n);
      exchange.offer(frame);
    }
  });
  RawFrame frame;
  frame.bytes.resize(8);
  for (std::uint64_t n = 0; n < 20'000; ++n) {
    ASSERT_TRUE(exchange.take(frame, 10s));
    ASSERT_EQ(frame.number, n);
    ASSERT_EQ(frame.bytes[0], static_cast<std::uint8_t>(n));
    read.store(n);
  }
}

}  // namespace
}  // namespace tofgraph::camcube
