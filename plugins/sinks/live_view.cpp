// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// View of the running pipeline in the browser, and for programs that use Foxglove's protocol.
#include <tofgraph/stage.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <sstream>
#include <thread>

#include "live/encoding.hpp"
#include "live/foxglove_messages.hpp"
#include "live/server.hpp"

namespace tofgraph {

/// Sends the newest frame to each client that is ready for one. A frame is encoded only if a client is ready, and
/// copied only for clients of Foxglove's protocol or if `hold` is set, since any frame may be the last. Several inputs
/// can be viewed side by side. The server listens from prepare() on, so that a port in use is reported before the first
/// frame, but only if a run follows (not for `check`).
struct LiveView final : Sink {
  In<void> every{this, "*", {.text = "images of one number per pixel, flags and points"}};
  Param<std::int64_t> port{
      this, "port", {.default_value = "8765", .min = 0, .max = 65535, .text = "TCP port; 0: any free one"}};
  Param<std::string> address{this,
                             "address",
                             {.default_value = "127.0.0.1",
                              .text = "address to listen on; other computers reach the view with 0.0.0.0 and the token "
                                      "that is then printed"}};
  Param<std::string> origins{
      this, "origins", {.text = "web pages elsewhere that may connect, e.g. [https://app.foxglove.dev]"}};
  Param<std::int64_t> clients{
      this, "clients", {.default_value = "16", .min = 1, .max = 48, .text = "more are refused"}};
  Param<double> rate{this,
                     "rate",
                     {.unit = "Hz",
                      .default_value = "60 Hz",
                      .min = 0.1,
                      .max = 1000,
                      .text = "frames per second that a client gets at most"}};
  Param<double> pace{this,
                     "pace",
                     {.unit = "Hz",
                      .min = 0.01,
                      .max = 1e4,
                      .text = "limits the frame rate of the pipeline, e.g. 30 Hz for a recording"}};
  Param<bool> wait{this,
                   "wait",
                   {.default_value = "false",
                    .text = "the first frame waits for a client, each further one at most 1 s until a client is ready: "
                            "for recordings, if no frame may be missed"}};
  Param<bool> hold{this,
                   "hold",
                   {.default_value = "false",
                    .text = "after the last frame the view stays open until Ctrl-C, or until all clients have left"}};

  void prepare(Setup& setup) {
    if (setup.streams().size() > 64) throw std::runtime_error("shows at most 64 nodes");
    for (const tofgraph_stream* stream : setup.streams()) nodes_.push_back(described(*stream));
    const bool unstated = std::ranges::any_of(
        nodes_, [](const live::NodeInfo& node) { return node.rays != nullptr && node.distortion_model.empty(); });
    if (unstated)
      warn("Foxglove gets no camera: its CameraCalibration cannot hold a table of rays, a thin prism or a skew");
    const bool any = std::ranges::any_of(nodes_, [](const live::NodeInfo& node) { return !node.channels.empty(); });
    if (!any)
      throw std::runtime_error(
          "the input has no image and no cloud: let it read a node after the decoder, e.g. inputs: [decode]");
    live::ServerOptions options;
    options.address = *address;
    options.port = static_cast<std::uint16_t>(*port);
    options.max_clients = static_cast<std::size_t>(*clients);
    options.max_rate = *rate;
    const bool local = *address == "127.0.0.1" || *address == "::1";
    if (!local) options.token = live::random_token();
    std::istringstream words(*origins);
    for (std::string word; words >> word;) options.origins.push_back(word);
    if (stopping()) return;
    try {
      server_ = std::make_unique<live::Server>(options, nodes_, calls());
    } catch (const std::runtime_error& error) {
      throw ConfigError(std::string(error.what()).find("is not an address") != std::string::npos ? "address" : "port",
                        error.what());
    }
  }

  void process(std::span<Frame> frames) {
    if (!announced_) announce();
    keep_pace();
    wait_for_client(Clock::now() + std::chrono::seconds(1));
    live::Wanted wanted = server_->wanted();
    if (*hold) wanted = {.planes = ~std::uint64_t{0}, .coded = 0};
    if (!wanted.any()) return;
    auto picture = std::make_shared<live::Picture>();
    const tofgraph_metadata& metadata = frames.front().metadata();
    picture->frame = metadata.number;
    picture->timestamp_ns = metadata.timestamp_ns;
    picture->integration_time = metadata.integration_time;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const bool planes = (wanted.planes >> i & 1U) != 0, coded = (wanted.coded >> i & 1U) != 0;
      if (planes || coded) picture->nodes.push_back(picture_of(frames[i], i, planes, coded));
    }
    if (*hold) last_ = picture;
    if (server_->wanted().any()) server_->show(std::move(picture));
  }

  void finish() {
    if (!server_) return;
    server_->end(last_);
    bool seen = false;
    for (auto alone_since = Clock::now(); *hold && runs_ && !stopping(); std::this_thread::sleep_for(tick)) {
      seen = seen || server_->clients() != 0;
      if (server_->clients() != 0) alone_since = Clock::now();
      if (seen && Clock::now() - alone_since > std::chrono::seconds(3)) break;  // longer than reloading the page takes
    }
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds tick{20};

  static bool is_shown(const tofgraph_channel& channel) {
    const std::string_view name = channel.name;
    if (name == "rays") return false;
    if (name == "points") return channel.type == TOFGRAPH_TYPE_F32 && channel.rank == 3;
    return channel.rank == 2 &&
           (channel.type == TOFGRAPH_TYPE_F32 || (channel.type == TOFGRAPH_TYPE_U16 && name == "flags"));
  }

  static live::NodeInfo described(const tofgraph_stream& stream) {
    live::NodeInfo node;
    node.name = stream.node;
    for (const tofgraph_channel& channel :
         Strided<const tofgraph_channel>{stream.channels, stream.channel_size, stream.channel_count}) {
      const auto text = [](const char* word) { return std::string(word != nullptr ? word : ""); };
      if (is_shown(channel)) node.channels.push_back({channel.name, text(channel.unit), text(channel.applied)});
    }
    if (stream.camera == nullptr) return node;
    const tofgraph_camera& camera = *stream.camera;
    node.camera = camera.name;
    node.rows = camera.height;
    node.columns = camera.width;
    node.rays = camera.rays;
    node.focal_length = camera.focal_length;
    std::copy_n(camera.focal_px, 2, node.focal_px);
    std::copy_n(camera.principal_point, 2, node.principal_point);
    live::set_lens(camera, node);
    return node;
  }

  /// Channels of a frame; valid as long as the frame.
  std::vector<live::PlaneView> planes_of(const Frame& frame, std::size_t node) const {
    std::vector<live::PlaneView> planes;
    for (const live::ChannelInfo& channel : nodes_[node].channels) {
      const tofgraph_view view = frame.find(channel.name.c_str());
      if (view.data == nullptr) continue;
      live::PlaneView& plane = planes.emplace_back();
      plane.name = channel.name;
      plane.unit = channel.unit;
      plane.rows = view.extent[0];
      plane.columns = view.extent[1];
      plane.depth = view.rank == 3 ? view.extent[2] : 1;
      if (view.type == TOFGRAPH_TYPE_U16)
        plane.bits = Array<const std::uint16_t>(view).span();
      else
        plane.values = Array<const float>(view).span();
    }
    return planes;
  }

  live::NodePicture picture_of(const Frame& frame, std::size_t node, bool with_planes, bool with_codes) const {
    const std::vector<live::PlaneView> planes = planes_of(frame, node);
    live::NodePicture picture{node, {}, {}};
    if (with_codes) picture.coded = std::make_shared<live::CodedChannels>(live::coded_channels(planes, nodes_[node]));
    if (!with_planes) return picture;
    picture.planes.emplace();
    for (const live::PlaneView& plane : planes) picture.planes->push_back(live::copy_of(plane));
    return picture;
  }

  void announce() {
    announced_ = true;
    runs_ = host->run_state(context, nullptr, nullptr) == TOFGRAPH_STATUS_OK;
    const bool everywhere = *address == "0.0.0.0" || *address == "::";
    host->message(context, TOFGRAPH_MESSAGE_INFO,
                  fmt::format("live view: {}{}", server_->url(),
                              everywhere ? " (replace the zeros by the name of this computer)" : "")
                      .c_str());
    wait_for_client(Clock::time_point::max());
    next_ = Clock::now();
  }

  void wait_for_client(Clock::time_point until) const {
    while (*wait && runs_ && !server_->wanted().any() && !stopping() && Clock::now() < until)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }

  void keep_pace() {
    if (!pace.given() || !runs_) return;
    while (Clock::now() < next_ && !stopping()) std::this_thread::sleep_until(std::min(next_, Clock::now() + tick));
    next_ = std::max(next_, Clock::now() - tick) +
            std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / *pace));
  }

  /// Calls the host and returns the answer, or throws the reason.
  template <class Call> static std::string asked(Call&& call) {
    std::string text;
    const auto take = [](void* user, const char* answer) { *static_cast<std::string*>(user) = answer; };
    if (call(+take, &text) != TOFGRAPH_STATUS_OK) throw std::runtime_error(text);
    return text;
  }

  live::RunCalls calls() const {
    return {[this] { return asked([this](auto take, void* user) { return host->run_state(context, take, user); }); },
            [this](const std::string& node, const std::string& parameter, const std::string& value) {
              return asked([&](auto take, void* user) {
                return host->change_parameter(context, node.c_str(), parameter.c_str(), value.c_str(), take, user);
              });
            }};
  }

  std::vector<live::NodeInfo> nodes_;
  std::shared_ptr<live::Picture> last_;
  bool announced_ = false, runs_ = false;  // runs: false without a pipeline, as in `plugin check`: no client will come
  Clock::time_point next_{};
  std::unique_ptr<live::Server> server_;  // last, so that its thread ends first
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::LiveView, "Shows the frames in a web browser while the pipeline runs")
