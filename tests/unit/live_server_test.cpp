// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: LiveServer.SurvivesMalformed*
// Rooms: live
// The server of the live view without a pipeline: encoding of values, and input from the network.
#include "config/base64.hpp"
#include "live/encoding.hpp"
#include "live/foxglove_messages.hpp"
#include "live/server.hpp"
#include "tests/live_view/web_client.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <random>

namespace tofgraph::live {
namespace {

using tests::WebClient;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

std::vector<double> decoded(const std::vector<float>& values, Coding& coding) {
  coding = coding_of(values);
  std::string bytes(2 * values.size(), 0);
  write_codes(bytes.data(), values, coding);
  std::vector<double> result;
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::uint16_t code = 0;
    std::memcpy(&code, bytes.data() + 2 * i, 2);
    result.push_back(code == 0 ? std::nan("") : coding.offset + (code - 1) * coding.step);
  }
  return result;
}

TEST(LiveEncoding, ErrorsAreAtMostHalfAStep) {
  Coding coding;
  for (const std::vector<float>& values : {std::vector<float>{0.5F, 6.5F, nan},
                                           {6.6F, 1e-3F},
                                           {-3.2F, 7.1F},
                                           {0, 0, 0},
                                           {1e6F, 1},
                                           {3e-5F, 1e-6F},
                                           {30000, 1.5F}}) {
    const std::vector<double> back = decoded(values, coding);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::isnan(values[i]))
        EXPECT_TRUE(std::isnan(back[i]));
      else
        EXPECT_NEAR(back[i], static_cast<double>(values[i]), coding.step * 0.505);
    }
  }
  decoded({0.5F, 6.5F}, coding);
  EXPECT_DOUBLE_EQ(coding.step, 1e-4) << "0.1 mm up to 6.55 m";
  decoded({0.5F, 13}, coding);
  EXPECT_DOUBLE_EQ(coding.step, 2e-4);
}

TEST(LiveEncoding, ImagesWithoutAnyValueHaveNone) {
  Coding coding;
  for (const double value : decoded({nan, nan, std::numeric_limits<float>::infinity()}, coding))
    EXPECT_TRUE(std::isnan(value));
  EXPECT_TRUE(decoded({}, coding).empty());
}

TEST(LiveEncoding, MovedCloudsAreNotAlongTheRays) {
  const std::vector<float> rays = {0, 0, 1, 0.6F, 0, 0.8F};
  NodeInfo node;
  node.rows = 1;
  node.columns = 2;
  node.rays = rays.data();
  Plane points{"points", "m", 1, 2, 3, {0, 0, 2, nan, nan, nan}, {}};
  const std::vector<float> along = along_rays(view_of(points), node);
  ASSERT_EQ(along.size(), 2U);
  EXPECT_EQ(along[0], 2);
  EXPECT_TRUE(std::isnan(along[1]));
  points.values[0] = 0.01F;
  EXPECT_TRUE(along_rays(view_of(points), node).empty());
  points.columns = 1;
  EXPECT_TRUE(along_rays(view_of(points), node).empty());
}

TEST(LiveEncoding, Base64IsThatOfRfc4648) {
  for (const auto& [plain, text] : std::vector<std::pair<std::string, std::string>>{{"", ""},
                                                                                    {"f", "Zg=="},
                                                                                    {"fo", "Zm8="},
                                                                                    {"foo", "Zm9v"},
                                                                                    {"foob", "Zm9vYg=="},
                                                                                    {"fooba", "Zm9vYmE="},
                                                                                    {"foobar", "Zm9vYmFy"}})
    EXPECT_EQ(config::base64(plain.data(), plain.size()), text);
}

/// Names and parameters as in the documentation of Foxglove's schema.
TEST(Foxglove, StatesTheLensInTheTermsOfItsSchema) {
  const float ray[] = {0, 0, 1};
  tofgraph_camera camera{};
  std::ranges::copy(std::array{0.1, 0.2, 0.3, 0.4, 0.5}, camera.distortion);
  const auto lens = [&]() -> nlohmann::json {
    NodeInfo node;
    node.rays = ray;
    set_lens(camera, node);
    const std::vector<FoxgloveTopic> topics = foxglove_topics({node});
    if (topics.empty()) return nullptr;
    const nlohmann::json message = foxglove_message(topics.front(), node, {}, 0);
    return {{"model", message["distortion_model"]}, {"D", message["D"]}};
  };
  EXPECT_EQ(lens().dump(), R"({"D":[0.1,0.2,0.3,0.4,0.5],"model":"plumb_bob"})");
  camera.lens_model = TOFGRAPH_LENS_FISHEYE;
  EXPECT_EQ(lens().dump(), R"({"D":[0.1,0.2,0.3,0.4],"model":"kannala_brandt"})");
  camera.lens_model = TOFGRAPH_LENS_RAYS;
  EXPECT_TRUE(lens().is_null());
  camera.lens_model = TOFGRAPH_LENS_OPENCV;
  camera.further_distortion[1] = 0.7;
  EXPECT_EQ(lens().dump(), R"({"D":[0.1,0.2,0.3,0.4,0.5,0.0,0.7,0.0],"model":"rational_polynomial"})");
  camera.skew = 0.01;
  EXPECT_TRUE(lens().is_null());
  camera.skew = 0;
  camera.further_distortion[3] = 0.01;
  EXPECT_TRUE(lens().is_null()) << "thin prism";
}

/// A server with one node of 4 x 3 pixels.
class LiveServer : public testing::Test {
 protected:
  LiveServer() {
    for (int i = 0; i < 12; ++i) rays.insert(rays.end(), {0, 0, 1});
    NodeInfo node;
    node.name = "decode";
    node.channels = {{"depth", "m", ""}, {"flags", "", ""}};
    node.rows = 3;
    node.columns = 4;
    node.rays = rays.data();
    ServerOptions options;
    options.port = 0;
    server = std::make_unique<Server>(
        options, std::vector{node},
        RunCalls{[] { return std::string(R"({"frames":1})"); },
                 [](const std::string& name, const std::string&, const std::string&) -> std::string {
                   throw std::runtime_error("no node " + name);
                 }});
    port = std::to_string(server->port());
  }
  std::shared_ptr<Picture> picture(std::uint64_t number, std::size_t rows, std::size_t columns) const {
    auto made = std::make_shared<Picture>();
    made->frame = number;
    made->integration_time = std::nan("");
    made->nodes.push_back(
        {0,
         std::vector<Plane>{{"depth", "m", rows, columns, 1, std::vector<float>(rows * columns, nan), {}},
                            {"flags", "", rows, columns, 1, {}, std::vector<std::uint16_t>(rows * columns, 1)}},
         {}});
    return made;
  }
  void wait_until_wanted() const {
    for (int i = 0; i < 1000 && !server->wanted().any(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ASSERT_TRUE(server->wanted().any());
  }
  std::vector<float> rays;
  std::unique_ptr<Server> server;
  std::string port;
};

TEST_F(LiveServer, FramesMayChangeTheirSizeAndHaveNoValue) {
  WebClient client(port);
  EXPECT_THAT(client.read(), testing::HasSubstr("\"op\":\"hello\""));
  client.send(R"({"op":"show","nodes":["decode","nothing"],"rate":1000})");
  EXPECT_EQ(tests::ViewMessage(client.read()).kind, 1U);
  EXPECT_FALSE(server->wanted().any()) << "no client has requested a frame";
  for (const std::size_t rows : {std::size_t{3}, std::size_t{7}, std::size_t{1}}) {
    client.send(R"({"op":"next"})");
    wait_until_wanted();
    server->show(picture(rows, rows, 4));
    const tests::ViewMessage frame(client.read());
    EXPECT_EQ(frame.json["frame"], rows);
    EXPECT_EQ(frame.json["integration_time"], nullptr);
    for (const double value : frame.decoded("decode", "depth")) EXPECT_TRUE(std::isnan(value));
    EXPECT_EQ(frame.decoded("decode", "flags"), std::vector<double>(rows * 4, 1));
  }
}

TEST(LiveServerNodes, ShareAMessageWithAlignedValues) {
  NodeInfo near, far;
  near.name = "near", far.name = "far";
  near.channels = far.channels = {{"depth", "m", ""}, {"flags", "", ""}};
  ServerOptions options;
  options.port = 0;
  Server server(options, {near, far}, {});
  const std::vector<float> depths = {1, 2, 3, nan, 5, 6, 7, 8, 9};
  const std::vector<std::uint16_t> bits = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  const std::vector<PlaneView> planes = {{"depth", "m", 3, 3, 1, depths, {}}, {"flags", "", 3, 3, 1, {}, bits}};
  WebClient page(std::to_string(server.port())), other(std::to_string(server.port()), "foxglove.sdk.v1");
  page.read();
  page.send(R"({"op":"show","nodes":["near","far"]})");
  page.send(R"({"op":"next"})");
  other.read();
  other.read();
  other.send(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":1}]})");
  const auto all_wanted = [&] { return server.wanted().coded == 3 && server.wanted().planes == 1; };
  for (int i = 0; i < 1000 && !all_wanted(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ASSERT_TRUE(all_wanted());
  auto coded = std::make_shared<Picture>();
  for (const std::size_t node : {std::size_t{0}, std::size_t{1}})
    coded->nodes.push_back({node, {}, std::make_shared<CodedChannels>(coded_channels(planes, near))});
  server.show(coded);
  const tests::ViewMessage frame(page.read());
  for (const std::string node : {"near", "far"}) {
    for (const std::string channel : {"depth", "flags"})
      EXPECT_EQ(frame.channel(node, channel)["at"].get<std::size_t>() % 8, 0U) << node << " " << channel;
    const std::vector<double> decoded = frame.decoded(node, "depth");
    ASSERT_EQ(decoded.size(), 9U);
    EXPECT_NEAR(decoded[8], 9, 1e-4);
    EXPECT_TRUE(std::isnan(decoded[3]));
    EXPECT_EQ(frame.decoded(node, "flags"), (std::vector<double>{0, 1, 2, 3, 4, 5, 6, 7, 8}));
  }
  EXPECT_TRUE(other.read(std::chrono::milliseconds(200)).empty()) << "it needs the values themselves";
}

TEST_F(LiveServer, ALateClientSeesTheLastFrame) {
  server->end(picture(41, 3, 4));
  WebClient client(port);
  client.send(R"({"op":"show","nodes":["decode"]})");
  client.send(R"({"op":"next"})");
  std::string message = client.read();
  while (!message.empty() && (client.text() || tests::ViewMessage(message).kind != 2)) message = client.read();
  ASSERT_FALSE(message.empty());
  EXPECT_EQ(tests::ViewMessage(message).json["frame"], 41);
}

TEST_F(LiveServer, RefusesWordsThatAreNoAddress) {
  ServerOptions options;
  options.address = "somewhere";
  EXPECT_THROW(Server(options, {}, {}), std::runtime_error);
}

/// A server with one node that has channels of these names.
std::unique_ptr<Server> server_of(const std::vector<std::string>& channels, RunCalls calls = {}) {
  NodeInfo node;
  node.name = "read";
  for (const std::string& name : channels) node.channels.push_back({name, "m", ""});
  ServerOptions options;
  options.port = 0;
  return std::make_unique<Server>(options, std::vector{node}, std::move(calls));
}
std::shared_ptr<Picture> picture_of(const std::vector<std::string>& channels) {
  auto made = std::make_shared<Picture>();
  std::vector<Plane> planes;
  for (const std::string& name : channels) planes.push_back({name, "m", 1, 1, 1, {2}, {}});
  made->nodes.push_back({0, planes, {}});
  return made;
}

TEST(LiveServerNames, ThoseThatAreNotUtf8AreReplaced) {
  const auto server = server_of({"m\xe4", "depth"});
  const std::string port = std::to_string(server->port());
  for (const std::string protocol : {"foxglove.sdk.v1", "tofgraph.v1"}) {
    WebClient client(port, protocol);
    std::string message = client.read();
    if (protocol != "tofgraph.v1") message = client.read();
    EXPECT_THAT(message, testing::HasSubstr("m\xef\xbf\xbd")) << "the replacement character";
    client.send(protocol == "tofgraph.v1" ? R"({"op":"show","nodes":["read"]})"
                                          : R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":1}]})");
    if (protocol == "tofgraph.v1") client.send(R"({"op":"next"})");
    for (int i = 0; i < 1000 && !server->wanted().any(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    server->show(picture_of({"m\xe4", "depth"}));
    EXPECT_FALSE(client.read().empty());
  }
}

TEST(LiveServerNames, AFoxgloveClientMaySubscribe60Channels) {
  std::vector<std::string> channels;
  nlohmann::json wishes = nlohmann::json::array();
  for (int i = 1; i <= 80; ++i) {
    channels.push_back("image" + std::to_string(i));
    wishes.push_back({{"id", i}, {"channelId", i}});
  }
  const auto server = server_of(channels);
  WebClient client(std::to_string(server->port()), "foxglove.sdk.v1");
  client.read();
  client.read();
  client.send(nlohmann::json({{"op", "subscribe"}, {"subscriptions", wishes}}).dump());
  EXPECT_THAT(client.read(), testing::HasSubstr("at most 60 channels"));
  for (int i = 0; i < 1000 && !server->wanted().any(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  server->show(picture_of(channels));
  for (int i = 0; i < 60; ++i) ASSERT_EQ(client.read()[0], 1) << i;
}

TEST(LiveServerQuestions, EachIsAnsweredOrRefused) {
  const auto server = server_of({"depth"}, {[] {
                                              std::this_thread::sleep_for(std::chrono::milliseconds(50));
                                              return std::string("{}");
                                            },
                                            {}});
  WebClient client(std::to_string(server->port()));
  client.read();
  for (int i = 0; i < 20; ++i) client.send(R"({"op":"state"})");
  int answered = 0, refused = 0;
  for (int i = 0; i < 20; ++i) {
    const auto reply = nlohmann::json::parse(client.read());
    EXPECT_EQ(reply["op"], "state");
    answered += reply.contains("reply") ? 1 : 0;
    refused += reply.contains("problem") ? 1 : 0;
  }
  EXPECT_GE(answered, 8);
  EXPECT_GE(refused, 1);
  EXPECT_EQ(answered + refused, 20);
}

TEST_F(LiveServer, AClientThatAsksOnAfterTheEndIsNotBuriedInFrames) {
  server->end(picture(41, 1000, 1000));  // 4 MB, more than the socket buffer holds for a client that does not read
  WebClient client(port);
  client.send(R"({"op":"show","nodes":["decode"]})");
  for (int i = 0; i < 200; ++i) client.send(R"({"op":"next"})");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  client.send(R"({"op":"state"})");
  int frames = 0;
  std::string message = client.read();
  for (; !message.empty(); message = client.read()) {
    if (!client.text() && tests::ViewMessage(message).kind == 2) ++frames;
    if (client.text() && message.find("\"state\"") != std::string::npos) break;
  }
  EXPECT_FALSE(message.empty()) << "still connected";
  EXPECT_GE(frames, 1);
  EXPECT_LE(frames, 20) << "as many as the rate allows";
}

TEST_F(LiveServer, ClosesConnectionsBeyond64AtOnce) {
  tests::net::io_context io;
  std::vector<tests::tcp::socket> idle;
  for (int i = 0; i < 64; ++i) idle.push_back(tests::connected(io, port));
  const auto start = std::chrono::steady_clock::now();
  tests::raw_exchange(port, "", std::chrono::seconds(5));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2)) << "closed, not kept waiting";
  idle.clear();
  for (unsigned status = 0, i = 0; status != 200 && i < 100; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    try {
      status = tests::request(port, tests::http::verb::get, "/state").status;
    } catch (const std::exception&) {  // not all closed connections are removed yet
      ASSERT_LT(i, 99U);
    }
  }
}

TEST_F(LiveServer, PagesMayNotSendFormsOrHaveAnotherBase) {
  const std::string answer = tests::raw_exchange(
      port, "GET / HTTP/1.1\r\nHost: localhost:" + port + "\r\nConnection: close\r\n\r\n", std::chrono::seconds(2));
  EXPECT_THAT(answer, testing::HasSubstr("base-uri 'none'; form-action 'none'"));
}

/// Valid requests and messages, to be corrupted.
const std::vector<std::string>& good_requests() {
  static const std::vector<std::string> all = {
      "GET / HTTP/1.1\r\nHost: localhost:8765\r\n\r\n",
      "GET /state HTTP/1.1\r\nHost: localhost:8765\r\nConnection: close\r\n\r\n",
      "PUT /parameters HTTP/1.1\r\nHost: localhost:8765\r\nContent-Length: "
      "45\r\n\r\n{\"node\":\"a\",\"parameter\":\"b\",\"value\":\"1 mm\"}",
      "GET /ws HTTP/1.1\r\nHost: localhost:8765\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: "
      "AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: tofgraph.v1\r\n\r\n",
      "GET /../../../../etc/passwd HTTP/1.1\r\nHost: localhost:8765\r\n\r\n",
      "POST /parameters HTTP/1.1\r\nHost: localhost:8765\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n\r\n"};
  return all;
}
const std::vector<std::string>& good_messages() {
  static const std::vector<std::string> all = {R"({"op":"show","nodes":["decode"],"rate":60})",
                                               R"({"op":"next"})",
                                               R"({"op":"state"})",
                                               R"({"op":"set","node":"decode","parameter":"x","value":"1"})",
                                               R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":1}]})",
                                               R"({"op":"unsubscribe","subscriptionIds":[1]})",
                                               R"([[[[[[[[[[1]]]]]]]]]])",
                                               R"({"op":7})",
                                               R"({"op":"show","nodes":7,"rate":"fast"})"};
  return all;
}

std::string damaged(std::string text, std::mt19937& random) {
  const auto upto = [&](std::size_t most) { return std::uniform_int_distribution<std::size_t>(0, most)(random); };
  for (std::size_t changes = 1 + upto(4); changes > 0 && !text.empty(); --changes) {
    const std::size_t at = upto(text.size() - 1);
    switch (upto(4)) {
      case 0:
        text[at] = static_cast<char>(upto(255));
        break;
      case 1:
        text.erase(at, 1 + upto(20));
        break;
      case 2:
        text.insert(at, std::string(1 + upto(300), static_cast<char>(upto(255))));
        break;
      case 3:
        text.insert(at, text.substr(0, at));
        break;
      default:
        text.resize(at);
        break;
    }
  }
  return text;
}

/// 1000 rounds; TOFGRAPH_FUZZ_ROUNDS sets another number.
TEST_F(LiveServer, SurvivesMalformedRequestsAndMessages) {
  const char* written = std::getenv("TOFGRAPH_FUZZ_ROUNDS");
  const int rounds = written != nullptr ? std::atoi(written) : 1000;
  std::mt19937 random(1);
  const auto any = [&](const auto& all) { return all[random() % all.size()]; };
  for (int i = 0; i < rounds; ++i) {
    std::string request = any(good_requests());
    request.replace(request.find("8765"), 4, port);
    if (i % 2 == 0) {
      const std::string answer = tests::raw_exchange(port, damaged(request, random), std::chrono::milliseconds(2));
      EXPECT_EQ(answer.find("root:"), std::string::npos);
    } else {
      std::unique_ptr<WebClient> client;
      try {
        client = std::make_unique<WebClient>(port, i % 4 == 1 ? "tofgraph.v1" : "foxglove.sdk.v1");
        for (int k = 0; k < 4; ++k) {
          const std::string message = k % 2 == 0 ? any(good_messages()) : damaged(any(good_messages()), random);
          i % 3 == 0 ? client->send_binary(message) : client->send(message);
          if (server->wanted().any()) server->show(picture(static_cast<std::uint64_t>(i), 3, 4));
        }
        if (i % 5 == 0) client->send(std::string(100000, 'x'));  // longer than allowed
      } catch (const std::exception&) {                          // disconnected: correct
      }
      if (client) client->cut();
    }
  }
  const tests::Answer answer = tests::request(port, tests::http::verb::get, "/state");
  EXPECT_EQ(answer.status, 200U) << "it still answers";
  for (int i = 0; i < 200 && server->clients() != 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(server->clients(), 0U) << "nobody is left over";
}

}  // namespace
}  // namespace tofgraph::live
