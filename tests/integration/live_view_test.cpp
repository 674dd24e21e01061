// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: LiveView.*
// Rooms: live graph plugins
// The live view as seen by a network client.
#include "tests/live_view/live_run.hpp"
#include "tests/live_view/web_client.hpp"
#include "tests/program.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <map>

namespace tofgraph::tests {
namespace {

using testing::HasSubstr;

constexpr const char* boards =
    "pipeline: 1\nname: board\ncamera: camcube2\nnodes:\n"
    "  - {name: grab, stage: simulator, distance: 1 m, frames: 0}\n"
    "  - {name: decode, stage: four_phase_decoder}\n"
    "  - {name: correct, stage: optimized_bistatic}\n"
    "  - {name: denoise, stage: bilateral, strength: 2 mm, rho: 2 px, window: 3}\n"
    "  - {name: cloud, stage: point_cloud}\n";
std::string viewed(const std::string& parameters = "") {
  return std::string(boards) +
         "  - {name: view, stage: live_view, inputs: [decode, correct, denoise, cloud], port: 0, pace: 200 Hz" +
         parameters + "}\n";
}

/// Images of the frames that leave a node, by frame number.
class Recorder {
 public:
  graph::RunOptions options(const std::string& node, std::vector<std::string> channels) {
    graph::RunOptions result;
    result.receivers[node] = [this, channels = std::move(channels)](tofgraph_frame& frame) {
      const std::scoped_lock lock(mutex_);
      for (const std::string& name : channels) {
        const tofgraph_frame::Channel* channel = frame.find(name);
        const std::size_t count =
            channel->extent[0] * channel->extent[1] * (channel->rank == 3 ? channel->extent[2] : 1);
        const auto* values = static_cast<const float*>(channel->buffer.data());
        images_[frame.metadata.number][name].assign(values, values + count);
      }
    };
    return result;
  }
  std::vector<float> image(std::uint64_t frame, const std::string& name) {
    const std::scoped_lock lock(mutex_);
    return images_.at(frame).at(name);
  }

 private:
  std::mutex mutex_;
  std::map<std::uint64_t, std::map<std::string, std::vector<float>>> images_;
};

/// The next frame received by a client.
ViewMessage next_frame(WebClient& client) {
  client.send(R"({"op":"next"})");
  for (int i = 0; i < 20; ++i) {
    const std::string message = client.read();
    if (message.empty()) throw std::runtime_error("the connection has ended");
    if (client.text()) continue;
    ViewMessage parsed(message);
    if (parsed.kind == 2) return parsed;
  }
  throw std::runtime_error("no frame came");
}

TEST(LiveView, ValuesAreThoseOfTheFrameToHalfAStep) {
  Recorder recorder;
  LiveRun run(viewed(), recorder.options("cloud", {"depth", "amplitude", "points"}));
  WebClient client(run.port());
  const auto hello = nlohmann::json::parse(client.read());
  EXPECT_EQ(hello["op"], "hello");
  EXPECT_EQ(hello["nodes"].size(), 4U);
  client.send(R"({"op":"show","nodes":["cloud"],"rate":60})");
  const ViewMessage rays(client.read());
  ASSERT_EQ(rays.kind, 1U);
  ASSERT_EQ(rays.json["rows"], 204);
  std::vector<float> ray(std::size_t{204} * 204 * 3);
  std::memcpy(ray.data(), rays.bytes.data() + rays.values, ray.size() * 4);
  for (int i = 0; i < 3; ++i) {
    const ViewMessage frame = next_frame(client);
    const auto number = frame.json["frame"].get<std::uint64_t>();
    for (const char* name : {"depth", "amplitude"}) {
      const std::vector<float> truth = recorder.image(number, name);
      const std::vector<double> shown = frame.decoded("cloud", name);
      const double step = frame.channel("cloud", name)["step"];
      ASSERT_EQ(shown.size(), truth.size());
      for (std::size_t k = 0; k < truth.size(); ++k) ASSERT_NEAR(shown[k], truth[k], step * 0.51) << name << ' ' << k;
    }
    EXPECT_LE(frame.channel("cloud", "depth")["step"].get<double>(), 1e-4);
    ASSERT_EQ(frame.channel("cloud", "points")["type"], "along_rays");
    const std::vector<double> along = frame.decoded("cloud", "points");
    const std::vector<float> points = recorder.image(number, "points");
    for (std::size_t k = 0; k < points.size(); ++k)
      ASSERT_NEAR(along[k / 3] * static_cast<double>(ray[k]), static_cast<double>(points[k]), 1e-4);
  }
}

TEST(LiveView, AChangedParameterCountsFromTheStatedFrameAndIsInTheProvenance) {
  Recorder recorder;
  LiveRun run(viewed(), recorder.options("denoise", {"depth"}));
  const auto change = [&](const std::string& value) {
    return request(run.port(), http::verb::put, "/parameters",
                   nlohmann::json({{"node", "denoise"}, {"parameter", "strength"}, {"value", value}}).dump());
  };
  const Answer done = change("40 mm");
  ASSERT_EQ(done.status, 200U) << done.body;
  const auto from = nlohmann::json::parse(done.body)["frame"].get<std::uint64_t>();
  while (run.frames_done() < from + 2) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const Answer refused = change("4000 m");
  EXPECT_EQ(refused.status, 422U);
  EXPECT_THAT(refused.body, HasSubstr("'strength' is '4000 m': it is out of range: at most 1000 m is allowed"));
  EXPECT_THAT(change("0 mm").body, HasSubstr("must be a length of at least 1 um"));
  EXPECT_THAT(
      request(run.port(), http::verb::put, "/parameters", R"({"node":"denoise","parameter":"window","value":"5"})")
          .body,
      HasSubstr("cannot change while the pipeline runs; those that can change: strength, sigma_adaptive, fill, rho"));
  EXPECT_THAT(
      request(run.port(), http::verb::put, "/parameters", R"({"node":"denose","parameter":"window","value":"5"})").body,
      HasSubstr("there is no node 'denose'; did you mean 'denoise'?"));
  run.stop();

  const std::size_t node = 3;
  const nlohmann::json provenance = run.graph().provenance(node)["stages"][node];
  EXPECT_EQ(provenance["parameters"]["strength"], "2 mm") << "at the start";
  EXPECT_EQ(provenance["changes"], nlohmann::json::parse(fmt::format(
                                       R"([{{"frame": {}, "parameter": "strength", "value": "40 mm"}}])", from)));
  // The same simulated frames with one constant value: equal before the change, or from the stated frame on.
  for (const auto& [value, frame] : std::map<std::string, std::uint64_t>{{"2 mm", from - 1}, {"40 mm", from}}) {
    Recorder constant;
    std::string pipeline = boards;
    pipeline.replace(pipeline.find("strength: 2 mm"), 14, "strength: " + value);
    pipeline += "  - {stage: 'null'}\n";
    config::Diagnostics diagnostics;
    graph::GraphOptions options;
    options.plugin_folders = graph::plugin_path({});
    const auto graph = graph::build_graph(config::parse_document("test", pipeline), {}, options, diagnostics);
    ASSERT_TRUE(diagnostics.ok()) << diagnostics.text();
    graph::RunOptions run_options = constant.options("denoise", {"depth"});
    run_options.frames = frame + 1;
    graph::Runner(*graph, run_options).run();
    EXPECT_EQ(constant.image(frame, "depth"), recorder.image(frame, "depth")) << value << ", frame " << frame;
  }
}

TEST(LiveView, FoxgloveClientsGetCloudImageAndCamera) {
  for (const std::string protocol : {"foxglove.websocket.v1", "foxglove.sdk.v1"}) {
    Recorder recorder;
    LiveRun run(viewed(), recorder.options("cloud", {"points", "depth"}));
    WebClient client(run.port(), protocol);
    EXPECT_EQ(client.protocol(), protocol);
    const auto info = nlohmann::json::parse(client.read());
    EXPECT_EQ(info["op"], "serverInfo");
    const auto advertised = nlohmann::json::parse(client.read());
    ASSERT_EQ(advertised["op"], "advertise");
    std::map<std::string, nlohmann::json> channels;
    for (const auto& channel : advertised["channels"]) channels[channel["topic"]] = channel;
    EXPECT_EQ(channels.at("/cloud/points")["schemaName"], "foxglove.PointCloud");
    EXPECT_EQ(channels.at("/cloud/depth")["schemaName"], "foxglove.RawImage");
    EXPECT_EQ(channels.at("/cloud/camera")["schemaName"], "foxglove.CameraCalibration");
    for (const auto& [topic, channel] : channels) {
      EXPECT_EQ(channel["encoding"], "json");
      EXPECT_TRUE(nlohmann::json::parse(channel["schema"].get<std::string>()).is_object());
    }
    client.send(nlohmann::json({{"op", "subscribe"},
                                {"subscriptions",
                                 {{{"id", 7}, {"channelId", channels.at("/cloud/points")["id"]}},
                                  {{"id", 8}, {"channelId", channels.at("/cloud/depth")["id"]}},
                                  {{"id", 9}, {"channelId", channels.at("/cloud/camera")["id"]}}}}})
                    .dump());
    std::map<std::uint32_t, nlohmann::json> got;
    while (got.size() < 3) {
      const std::string message = client.read();
      ASSERT_GT(message.size(), 13U);
      ASSERT_EQ(message[0], 1) << "message data";
      std::uint32_t id = 0;
      std::memcpy(&id, message.data() + 1, 4);
      got[id] = nlohmann::json::parse(message.substr(13));
    }
    EXPECT_EQ(got[7]["point_stride"], 16);
    EXPECT_EQ(got[7]["data"].get<std::string>().size(), (std::size_t{204} * 204 * 16 + 2) / 3 * 4);
    EXPECT_EQ(got[8]["encoding"], "32FC1");
    EXPECT_EQ(got[8]["width"], 204);
    EXPECT_NEAR(got[9]["K"][0].get<double>(), 320, 1e-9) << "12.8 mm over 40 um";
    EXPECT_NEAR(got[9]["K"][2].get<double>(), 101.5, 1e-9);
  }
}

TEST(LiveView, ForeignNamesOriginsAndMissingTokensAreRefused) {
  LiveRun run(viewed());
  const auto get = [&](const std::vector<std::pair<std::string, std::string>>& headers,
                       const std::string& target = "/state") {
    return request(run.port(), http::verb::get, target, "", headers);
  };
  EXPECT_EQ(get({}).status, 200U);
  EXPECT_EQ(get({{"Host", "evil.example:" + run.port()}}).status, 403U) << "a name that was made to point here";
  EXPECT_EQ(get({{"Origin", "http://evil.example"}}).status, 403U);
  EXPECT_EQ(get({{"Origin", "http://localhost:" + run.port()}}).status, 200U);
  for (const char* path : {"/../../etc/passwd", "/%2e%2e/etc/passwd", "/page/app.js", "//etc/passwd", "/app.js/.."}) {
    const Answer answer = get({}, path);
    EXPECT_EQ(answer.status, 404U) << path;
    EXPECT_THAT(answer.body, testing::Not(HasSubstr("etc"))) << "what was asked for is not repeated";
  }
  EXPECT_EQ(request(run.port(), http::verb::post, "/parameters", "{}").status, 405U);
  EXPECT_EQ(request(run.port(), http::verb::put, "/parameters", std::string(70000, 'x')).status, 413U);
  run.stop();

  LiveRun open(viewed(", address: 0.0.0.0"));
  const std::string token = open.url().substr(open.url().find("token=") + 6, 32);
  EXPECT_EQ(request(open.port(), http::verb::get, "/state").status, 401U);
  EXPECT_EQ(request(open.port(), http::verb::get, "/state?token=" + std::string(32, '0')).status, 401U);
  EXPECT_EQ(request(open.port(), http::verb::get, "/state?token=" + token).status, 200U);
  EXPECT_EQ(request(open.port(), http::verb::get, "/state", "", {{"Authorization", "Bearer " + token}}).status, 200U);
  EXPECT_EQ(request(open.port(), http::verb::get, "/").status, 200U) << "the page itself has no data";
  EXPECT_THROW(WebClient(open.port()), std::exception);
  WebClient with_token(open.port(), "tofgraph.v1", "/ws?token=" + token);
  EXPECT_THAT(with_token.read(), HasSubstr("hello"));
}

TEST(LiveView, TheStateTellsNoPathOfTheComputer) {
  const TemporaryFolder folder;
  LiveRun run("pipeline: 1\nnodes:\n  - {name: read, stage: capture_reader, file: '" TOFGRAPH_SOURCE_DIR
              "/pipelines/data/o3d303_scene.h5'}\n  - {name: mask, stage: mask, min_amplitude: 50 counts}\n"
              "  - {name: write, stage: capture_writer, path: '" +
              (folder.path() / "out.h5").string() +
              "'}\n  - {name: view, stage: live_view, inputs: [mask], port: 0, hold: true}\n");
  const std::string state = request(run.port(), http::verb::get, "/state").body;
  ASSERT_THAT(state, HasSubstr("min_amplitude")) << "what may change is told";
  EXPECT_THAT(state, testing::Not(HasSubstr(TOFGRAPH_SOURCE_DIR)));
  EXPECT_THAT(state, testing::Not(HasSubstr("o3d303_scene.h5")));
  EXPECT_THAT(state, testing::Not(HasSubstr(folder.path().string())));
}

TEST(LiveView, TheLastTwentyChangesAreTold) {
  LiveRun run(viewed());
  const auto change = [&](const std::string& value) {
    return request(run.port(), http::verb::put, "/parameters",
                   nlohmann::json({{"node", "denoise"}, {"parameter", "strength"}, {"value", value}}).dump());
  };
  for (int i = 1; i <= 25; ++i) ASSERT_EQ(change(std::to_string(i) + " mm").status, 200U);
  const auto changes = nlohmann::json::parse(request(run.port(), http::verb::get, "/state").body)["changes"];
  ASSERT_EQ(changes.size(), 20U);
  EXPECT_EQ(changes.back()["value"], "25 mm");
}

TEST(LiveView, AChangeThatIsRefusedLaterIsTold) {
  std::string slow = viewed();
  slow.replace(slow.find("pace: 200 Hz"), 12, "pace: 0.02 Hz");
  LiveRun run(slow);
  const Answer answer = request(run.port(), http::verb::put, "/parameters",
                                R"({"node":"denoise","parameter":"strength","value":"3 mm"})");
  EXPECT_THAT(answer.body, HasSubstr("pending"));
  run.stop();
  const auto changes = nlohmann::json::parse(request(run.port(), http::verb::get, "/state").body)["changes"];
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0]["problem"], "the run is over");
}

TEST(LiveView, ViewTakesFilesWithAnyName) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(TOFGRAPH_SOURCE_DIR "/pipelines/data/o3d303_scene.h5", folder.path() / "it's new!.h5");
  const Outcome outcome =
      shell("timeout -s INT 3 \"$TOFGRAPH\" view \"it's new!.h5\" --port 0 --camera o3d303 2>&1; true", folder.path());
  EXPECT_THAT(outcome.out, HasSubstr("live view: http://localhost:"));
}

TEST(LiveView, ATakenPortIsReportedBeforeAnythingStarts) {
  LiveRun run(viewed());
  const TemporaryFolder folder;
  write_text(folder.path() / "p.yaml",
             std::string(boards) +
                 "  - {stage: capture_writer, path: a.h5}\n  - {stage: live_view, inputs: [cloud], port: " +
                 run.port() + "}\n");
  const Outcome outcome = shell("\"$TOFGRAPH\" run p.yaml --frames 3", folder.path());
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err,
              HasSubstr("parameter 'port': port " + run.port() + " is taken by another program: choose another one"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.h5"));
  for (const std::string command : {"check", "explain"}) {
    const Outcome looked = shell("\"$TOFGRAPH\" " + command + " p.yaml", folder.path());
    EXPECT_EQ(looked.exit_code, 0) << command << ": " << looked.err;
  }
  write_text(folder.path() / "q.yaml",
             "pipeline: 1\ncamera: camcube2\nnodes:\n  - {stage: simulator}\n  - {stage: live_view, port: 0}\n");
  EXPECT_THAT(shell("\"$TOFGRAPH\" run q.yaml", folder.path()).err, HasSubstr("the input has no image and no cloud"));
}

TEST(LiveView, ManyClientsAndOnesThatNeverReadDoNotStopThePipeline) {
  LiveRun run(viewed(", clients: 16"));
  const auto frames_in_a_second = [&] {
    const std::uint64_t before = run.frames_done();
    std::this_thread::sleep_for(std::chrono::seconds(1));
    return run.frames_done() - before;
  };
  const std::uint64_t alone = frames_in_a_second();
  std::vector<std::unique_ptr<WebClient>> clients;
  int refused = 0;
  for (int i = 0; i < 50; ++i) {
    try {
      clients.push_back(std::make_unique<WebClient>(run.port()));
      clients.back()->send(R"({"op":"show","nodes":["decode","cloud"],"rate":60})");
      clients.back()->send(R"({"op":"next"})");  // never read afterwards
    } catch (const std::exception&) {
      ++refused;
    }
  }
  EXPECT_EQ(clients.size(), 16U);
  EXPECT_EQ(refused, 34);
  const std::uint64_t before = run.frames_done();
  EXPECT_GE(2 * frames_in_a_second(), alone) << "at least half the rate";
  for (auto& client : clients) client->cut();  // in the middle of frames
  clients.clear();
  WebClient fresh(run.port());
  fresh.send(R"({"op":"show","nodes":["cloud"]})");
  EXPECT_GT(next_frame(fresh).json["frame"].get<std::uint64_t>(), before);
  EXPECT_TRUE(run.stop().error.empty());
}

}  // namespace
}  // namespace tofgraph::tests
