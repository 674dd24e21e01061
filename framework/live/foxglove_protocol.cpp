// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Foxglove's WebSocket protocol, version 1, as used by Foxglove and Lichtblick: channels in JSON with the schemas
// foxglove.PointCloud, foxglove.RawImage and foxglove.CameraCalibration.
#include "live/client.hpp"
#include "live/foxglove_messages.hpp"

#include <chrono>
#include <map>

namespace tofgraph::live {
namespace {

constexpr std::size_t max_subscriptions = 60;  // one message each per frame; must stay below a client's queue

class FoxgloveProtocol final : public Protocol {
 public:
  using Protocol::Protocol;

  void opened() override {
    topics_ = foxglove_topics(client_.hub().nodes);
    nlohmann::json channels = nlohmann::json::array();
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      channels.push_back({{"id", i + 1},
                          {"topic", topics_[i].name},
                          {"encoding", "json"},
                          {"schemaName", foxglove_schema_name(topics_[i].kind)},
                          {"schemaEncoding", "jsonschema"},
                          {"schema", foxglove_schema(topics_[i].kind)}});
    }
    client_.send_text(json_line({{"op", "serverInfo"},
                                 {"name", "tofgraph"},
                                 {"capabilities", nlohmann::json::array()},
                                 {"supportedEncodings", {"json"}},
                                 {"metadata", nlohmann::json::object()}}));
    client_.send_text(json_line({{"op", "advertise"}, {"channels", channels}}));
  }

  void received(std::string_view message, bool binary) override {
    if (binary) return status("binary messages of clients are not supported");
    const auto json = nlohmann::json::parse(message);
    const std::string op = json.at("op");
    if (op == "subscribe") {
      const char* problem = nullptr;  // one reply for all refused subscriptions
      for (const auto& wish : json.at("subscriptions")) {
        if (const char* refused = subscribe(wish.at("id"), wish.at("channelId"))) problem = refused;
      }
      if (problem != nullptr) status(problem);
    } else if (op == "unsubscribe") {
      for (const auto& id : json.at("subscriptionIds")) subscriptions_.erase(id.get<std::uint32_t>());
    } else {
      status("this operation is not supported");
    }
  }

  Wanted wanted() const override {
    if (client_.hub().ended && has_last_) return {};
    std::uint64_t bits = 0;
    for (const auto& [id, topic] : subscriptions_) bits |= std::uint64_t{1} << topics_[topic].node;
    return {.planes = bits};
  }

  void show(const Picture& picture) override {
    client_.frame_sent();
    has_last_ = client_.hub().ended;
    for (const auto& [id, topic] : subscriptions_) {
      for (const NodePicture& node : picture.nodes) {
        if (node.node != topics_[topic].node) continue;
        const nlohmann::json message =
            foxglove_message(topics_[topic], client_.hub().nodes[node.node], node, time_of(picture));
        if (!message.is_null()) send_data(id, time_of(picture), json_line(message));
      }
    }
  }

 private:
  static std::uint64_t time_of(const Picture& picture) {
    if (picture.timestamp_ns > 0) return static_cast<std::uint64_t>(picture.timestamp_ns);
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
  }

  /// @returns the reason for a refusal, or null
  const char* subscribe(std::uint32_t id, std::size_t channel) {
    if (channel == 0 || channel > topics_.size()) return "there is no such channel";
    if (subscriptions_.size() >= max_subscriptions && !subscriptions_.contains(id))
      return "at most 60 channels can be subscribed at once";
    subscriptions_[id] = channel - 1;
    has_last_ = false;
    return nullptr;
  }

  void send_data(std::uint32_t id, std::uint64_t time, const std::string& message) {
    std::string bytes(1, '\x01');
    bytes.append(reinterpret_cast<const char*>(&id), sizeof id);
    bytes.append(reinterpret_cast<const char*>(&time), sizeof time);
    client_.send_binary(bytes + message);
  }

  void status(const char* text) { client_.send_text(json_line({{"op", "status"}, {"level", 1}, {"message", text}})); }

  std::vector<FoxgloveTopic> topics_;
  std::map<std::uint32_t, std::size_t> subscriptions_;  // topic by subscription ID of the client
  bool has_last_ = false;                               // the last frame was sent after the newest subscription
};

}  // namespace

std::unique_ptr<Protocol> foxglove_protocol(Client& client) { return std::make_unique<FoxgloveProtocol>(client); }

}  // namespace tofgraph::live
