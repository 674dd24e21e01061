// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Protocol of the page: docs/live_view.md.
#include "live/client.hpp"

#include <cmath>

namespace tofgraph::live {
namespace {

enum class Kind : std::uint32_t { rays = 1, frame = 2 };

/// First part of a message: kind, length of the JSON text, the text padded with blanks to a multiple of 8.
std::string message_head(Kind kind, const nlohmann::json& header) {
  std::string text = json_line(header);
  text.append((8 - text.size() % 8) % 8, ' ');
  const std::uint32_t head[2] = {static_cast<std::uint32_t>(kind), static_cast<std::uint32_t>(text.size())};
  text.insert(0, reinterpret_cast<const char*>(head), sizeof head);
  return text;
}

nlohmann::json number_or_null(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

class ViewProtocol final : public Protocol {
 public:
  using Protocol::Protocol;

  void opened() override {
    nlohmann::json nodes = nlohmann::json::array();
    for (const NodeInfo& node : client_.hub().nodes) {
      nlohmann::json channels = nlohmann::json::array();
      for (const ChannelInfo& c : node.channels)
        channels.push_back({{"name", c.name}, {"unit", c.unit}, {"applied", c.applied}});
      nodes.push_back({{"name", node.name},
                       {"channels", std::move(channels)},
                       {"rows", node.rows},
                       {"columns", node.columns},
                       {"camera", node.camera},
                       {"focal_length", number_or_null(node.focal_length)},
                       {"rays", node.rays != nullptr}});
    }
    client_.send_text(json_line({{"op", "hello"}, {"version", 1}, {"nodes", nodes}}));
  }

  void received(std::string_view message, bool binary) override {
    if (binary) throw std::runtime_error("a binary message");
    const auto json = nlohmann::json::parse(message);
    const std::string op = json.at("op");
    if (op == "show") {
      choose(json);
    } else if (op == "next") {
      ready_ = true;
    } else if (op == "state") {
      answer(client_.hub().calls.state, {{"op", "state"}});
    } else if (op == "set") {
      const std::string node = json.at("node"), parameter = json.at("parameter"), value = json.at("value");
      answer([&calls = client_.hub().calls, node, parameter, value] { return calls.change(node, parameter, value); },
             {{"op", "set"}, {"node", node}, {"parameter", parameter}});
    } else {
      throw std::runtime_error("unknown op");
    }
  }

  Wanted wanted() const override { return {.coded = ready_ ? nodes_ : 0}; }

  void show(const Picture& picture) override {
    nlohmann::json blocks = nlohmann::json::array();
    Client::Values values;
    std::size_t begin = 0;  // of a node's values
    for (const NodePicture& shown : picture.nodes) {
      if ((nodes_ >> shown.node & 1U) == 0) continue;
      values.push_back(shown.coded);
      nlohmann::json channels = values.back()->descriptions;
      for (nlohmann::json& channel : channels) channel["at"] = channel["at"].get<std::size_t>() + begin;
      begin += values.back()->bytes.size();
      blocks.push_back({{"node", client_.hub().nodes[shown.node].name}, {"channels", std::move(channels)}});
    }
    ready_ = false;
    client_.frame_sent();
    client_.send_binary(message_head(Kind::frame, {{"frame", picture.frame},
                                                   {"timestamp_ns", std::to_string(picture.timestamp_ns)},
                                                   {"integration_time", number_or_null(picture.integration_time)},
                                                   {"nodes", std::move(blocks)}}),
                        std::move(values));
  }

  void ended() override { client_.send_text(R"({"op":"end"})"); }

 private:
  void choose(const nlohmann::json& json) {
    std::uint64_t chosen = 0;
    for (const nlohmann::json& name : json.at("nodes")) {
      for (std::size_t i = 0; i < client_.hub().nodes.size(); ++i) {
        if (client_.hub().nodes[i].name == name) chosen |= std::uint64_t{1} << i;
      }
    }
    if (json.contains("rate")) client_.set_rate(json["rate"].get<double>());
    for (std::size_t i = 0; i < client_.hub().nodes.size(); ++i) {
      if ((chosen & ~with_rays_) >> i & 1U) send_rays(client_.hub().nodes[i]);
    }
    nodes_ = chosen;
    with_rays_ |= chosen;
  }

  void send_rays(const NodeInfo& node) {
    if (node.rays == nullptr) return;
    const std::size_t count = node.rows * node.columns * 3;
    std::string message =
        message_head(Kind::rays, {{"node", node.name}, {"rows", node.rows}, {"columns", node.columns}});
    message.append(reinterpret_cast<const char*>(node.rays), count * sizeof(float));
    client_.send_binary(std::move(message));
  }

  void refuse(nlohmann::json head, const std::string& problem) {
    head["problem"] = problem;
    client_.send_text(json_line(head));
  }

  void answer(std::function<std::string()> question, nlohmann::json head) {
    if (asking_ >= 8) return refuse(std::move(head), "too many requests at once: wait for the replies");
    ++asking_;
    client_.hub().ask(std::move(question), [client = client_.shared_from_this(), this, head = std::move(head)](
                                               const std::string& reply, const std::string& problem) {
      --asking_;  // `this` is valid: the client owns this protocol
      if (!problem.empty()) return refuse(head, problem);
      std::string message = json_line(head);
      message.insert(message.size() - 1, ",\"reply\":" + reply);
      client->send_text(std::move(message));
    });
  }

  std::uint64_t nodes_ = 0, with_rays_ = 0;
  bool ready_ = false;
  int asking_ = 0;
};

}  // namespace

std::unique_ptr<Protocol> view_protocol(Client& client) { return std::make_unique<ViewProtocol>(client); }

}  // namespace tofgraph::live
