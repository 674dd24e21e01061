// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "live/client.hpp"
#include "live/encoding.hpp"

#include <boost/asio/post.hpp>

#include <algorithm>

namespace tofgraph::live {
namespace {

constexpr std::size_t max_message = std::size_t{64} << 10, max_queued = 64;
constexpr int max_messages_per_s = 300;

}  // namespace

std::string json_line(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void Hub::want(const Wanted& nodes) {
  wanted_planes = nodes.planes;
  wanted_coded = nodes.coded;
}

void Hub::send(Picture& picture, Client& client) const {
  for (NodePicture& node : picture.nodes) {
    if (node.coded || (client.protocol().wanted().coded >> node.node & 1U) == 0) continue;
    std::vector<PlaneView> views;
    for (const Plane& plane : node.planes.value()) views.push_back(view_of(plane));
    node.coded = std::make_shared<CodedChannels>(coded_channels(views, nodes[node.node]));
  }
  client.protocol().show(picture);
}

void Hub::update_wanted() {
  if (ended && last) {
    for (const auto& client : std::set(clients)) {
      if (client->wanted().any()) client->guarded([&] { send(*last, *client); });
    }
  }
  Wanted all;
  for (const auto& client : clients) {
    const Wanted nodes = client->wanted();
    all.planes |= nodes.planes;
    all.coded |= nodes.coded;
  }
  want(all);
  client_count = clients.size();
}

void Hub::ask(std::function<std::string()> question, std::function<void(std::string, std::string)> done) {
  net::post(workers, [this, question = std::move(question), done = std::move(done)] {
    std::string answer, problem;
    try {
      answer = question();
    } catch (const std::exception& error) {
      problem = error.what();
    }
    net::post(io, [done, answer = std::move(answer), problem = std::move(problem)] { done(answer, problem); });
  });
}

Client::Client(beast::tcp_stream stream, Hub& hub)
    : hub_(hub), socket_(std::move(stream)), rate_(hub.options.max_rate), timer_(hub.io) {
  ++hub_.connections;
}
Client::~Client() { --hub_.connections; }

void Client::open(const Request& request, const std::string& protocol) {
  namespace websocket = beast::websocket;
  beast::get_lowest_layer(socket_).expires_never();
  websocket::stream_base::timeout timeout = websocket::stream_base::timeout::suggested(beast::role_type::server);
  timeout.idle_timeout = std::chrono::seconds(30);
  timeout.keep_alive_pings = true;
  socket_.set_option(timeout);
  socket_.set_option(websocket::stream_base::decorator([protocol](websocket::response_type& response) {
    response.set(beast::http::field::server, "tofgraph");
    if (!protocol.empty()) response.set(beast::http::field::sec_websocket_protocol, protocol);
  }));
  socket_.read_message_max(max_message);
  socket_.auto_fragment(false);
  protocol_ = protocol.starts_with("foxglove") ? foxglove_protocol(*this) : view_protocol(*this);
  socket_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
    if (error) return;
    self->hub_.clients.insert(self);
    self->hub_.client_count = self->hub_.clients.size();
    self->guarded([&] {
      self->protocol_->opened();
      if (self->hub_.ended) self->protocol_->ended();
    });
    if (!self->closing_) self->read();
  });
}

void Client::read() {
  socket_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    if (error) return self->gone();
    if (self->too_many_messages()) return self->close("too many messages");
    const auto data = self->buffer_.cdata();
    self->guarded(
        [&] {
          self->protocol_->received({static_cast<const char*>(data.data()), data.size()}, !self->socket_.got_text());
        },
        "this message is not part of the protocol");
    if (self->closing_) return;
    self->buffer_.consume(self->buffer_.size());
    self->hub_.update_wanted();
    if (!self->closing_) self->read();
  });
}

bool Client::too_many_messages() {
  const Clock::time_point now = Clock::now();
  if (now - second_ > std::chrono::seconds(1)) {
    second_ = now;
    messages_ = 0;
  }
  return ++messages_ > max_messages_per_s;
}

void Client::send(Message message) {
  if (closing_) return;
  if (queue_.size() >= max_queued) return close("does not read the messages sent to it");
  queue_.push_back(std::move(message));
  if (!writing_) write();
}

void Client::write() {
  writing_ = true;
  const Message& message = queue_.front();
  std::vector<net::const_buffer> buffers = {net::buffer(message.bytes)};
  for (const auto& values : message.values) buffers.emplace_back(values->bytes.data(), values->bytes.size());
  socket_.binary(message.binary);
  socket_.async_write(buffers, [self = shared_from_this()](beast::error_code error, std::size_t) {
    self->writing_ = false;
    self->queue_.pop_front();
    if (error) return self->gone();
    if (!self->queue_.empty() && !self->closing_) return self->write();
    self->hub_.update_wanted();
  });
}

/// Does not wait for a pending write: a client that does not read would never let it finish.
void Client::close(const std::string& reason) {
  if (closing_) return;
  closing_ = true;
  if (writing_) return gone();
  beast::get_lowest_layer(socket_).expires_after(std::chrono::seconds(2));
  socket_.async_close({beast::websocket::close_code::policy_error, reason.substr(0, 120)},
                      [self = shared_from_this()](beast::error_code) { self->gone(); });
}

void Client::gone() {
  closing_ = true;
  timer_.cancel();
  beast::error_code ignored;
  beast::get_lowest_layer(socket_).socket().close(ignored);
  hub_.clients.erase(shared_from_this());
  hub_.update_wanted();
}

Wanted Client::wanted() const {
  const bool ready = !closing_ && queue_.empty() && Clock::now() >= next_frame_;
  return ready ? protocol_->wanted() : Wanted{};
}

void Client::frame_sent() {
  const auto pause = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / rate_));
  next_frame_ = std::max(next_frame_ + pause, Clock::now() + pause / 2);
  timer_.expires_at(next_frame_);
  timer_.async_wait([self = shared_from_this()](beast::error_code error) {
    if (!error) self->hub_.update_wanted();
  });
}

void Client::set_rate(double frames_per_s) { rate_ = std::clamp(frames_per_s, 0.1, hub_.options.max_rate); }

}  // namespace tofgraph::live
