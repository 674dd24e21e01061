// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Clients of a live view: HTTP, WebSocket, raw bytes.
#pragma once

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace tofgraph::tests {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using tcp = net::ip::tcp;

inline tcp::socket connected(net::io_context& io, const std::string& port) {
  tcp::socket socket(io);
  socket.connect({net::ip::make_address("127.0.0.1"), static_cast<std::uint16_t>(std::stoi(port))});
  return socket;
}

struct Answer {
  unsigned status = 0;
  std::string body;
};

/// Sends a request. @param headers "Name: value" in addition to Host
inline Answer request(const std::string& port, http::verb verb, const std::string& target, const std::string& body = "",
                      const std::vector<std::pair<std::string, std::string>>& headers = {}) {
  net::io_context io;
  tcp::socket socket = connected(io, port);
  http::request<http::string_body> question{verb, target, 11};
  question.set(http::field::host, "localhost:" + port);
  for (const auto& [name, value] : headers) question.set(name, value);
  question.body() = body;
  question.prepare_payload();
  http::write(socket, question);
  beast::flat_buffer buffer;
  http::response<http::string_body> response;
  http::read(socket, buffer, response);
  return {response.result_int(), response.body()};
}

/// Sends raw bytes. @returns the answer until the server closed or `wait` passed
inline std::string raw_exchange(const std::string& port, const std::string& bytes, std::chrono::milliseconds wait) {
  net::io_context io;
  beast::tcp_stream stream(connected(io, port));
  beast::error_code ignored;
  net::write(stream.socket(), net::buffer(bytes), ignored);
  std::string answer;
  char piece[4096];
  for (bool more = true; more && answer.size() < 65536;) {
    more = false;
    stream.expires_after(wait);
    stream.async_read_some(net::buffer(piece), [&](beast::error_code error, std::size_t count) {
      answer.append(piece, count);
      more = !error;
    });
    io.restart();
    io.run();
  }
  return answer;
}

/// WebSocket client; reads wait at most 10 s.
class WebClient {
 public:
  explicit WebClient(const std::string& port, const std::string& protocol = "tofgraph.v1",
                     const std::string& target = "/ws")
      : socket_(beast::tcp_stream(connected(io_, port))) {
    socket_.set_option(beast::websocket::stream_base::decorator([&](beast::websocket::request_type& request) {
      if (!protocol.empty()) request.set(http::field::sec_websocket_protocol, protocol);
    }));
    socket_.read_message_max(0);
    socket_.handshake(response_, "localhost:" + port, target);
  }
  void send(const std::string& text) {
    socket_.text(true);
    socket_.write(net::buffer(text));
  }
  void send_binary(const std::string& bytes) {
    socket_.binary(true);
    socket_.write(net::buffer(bytes));
  }
  /// @returns the next message; empty: the connection has ended, or no message came in time
  std::string read(std::chrono::milliseconds wait = std::chrono::seconds(10)) {
    beast::flat_buffer buffer;
    bool came = false;
    beast::get_lowest_layer(socket_).expires_after(wait);
    socket_.async_read(buffer, [&](beast::error_code error, std::size_t) { came = !error; });
    io_.restart();
    io_.run();
    beast::get_lowest_layer(socket_).expires_never();
    return came ? beast::buffers_to_string(buffer.data()) : "";
  }
  bool text() const { return socket_.got_text(); }
  std::string protocol() const { return std::string(response_[http::field::sec_websocket_protocol]); }
  void cut() { beast::get_lowest_layer(socket_).socket().close(); }

 private:
  net::io_context io_;
  beast::websocket::response_type response_;
  beast::websocket::stream<beast::tcp_stream> socket_;
};

/// A binary message of the project's protocol: its JSON text, and the offset of the values.
struct ViewMessage {
  std::uint32_t kind = 0;
  nlohmann::json json;
  std::string bytes;
  std::size_t values = 0;

  explicit ViewMessage(std::string message) : bytes(std::move(message)) {
    std::uint32_t length = 0;
    std::memcpy(&kind, bytes.data(), 4);
    std::memcpy(&length, bytes.data() + 4, 4);
    json = nlohmann::json::parse(bytes.substr(8, length));
    values = 8 + length;
  }
  const nlohmann::json& channel(const std::string& node, const std::string& name) const {
    for (const auto& block : json["nodes"])
      for (const auto& one : block["channels"])
        if (block["node"] == node && one["name"] == name) return one;
    throw std::runtime_error("the message has no " + name + " of " + node);
  }
  /// Values of a channel; NaN if missing. For flags, the bits.
  std::vector<double> decoded(const std::string& node, const std::string& name) const {
    const nlohmann::json& one = channel(node, name);
    std::vector<std::uint16_t> codes(one["rows"].get<std::size_t>() * one["columns"].get<std::size_t>());
    std::memcpy(codes.data(), bytes.data() + values + one["at"].get<std::size_t>(), codes.size() * 2);
    std::vector<double> result;
    for (const std::uint16_t code : codes) {
      if (one["type"] == "bits")
        result.push_back(code);
      else
        result.push_back(code == 0 ? std::nan("")
                                   : one["offset"].get<double>() + (code - 1) * one["step"].get<double>());
    }
    return result;
  }
};

}  // namespace tofgraph::tests
