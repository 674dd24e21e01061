// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A WebSocket client and its protocol. Everything here runs on the server's thread.
#pragma once

#include "live/server.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <atomic>
#include <chrono>
#include <deque>
#include <memory>
#include <set>
#include <string>
#include <string_view>

namespace tofgraph::live {

namespace net = boost::asio;
namespace beast = boost::beast;

class Client;

/// Serializes JSON on one line. Bytes that are not UTF-8, e.g. in a dataset's name, are replaced.
std::string json_line(const nlohmann::json& json);

/// State shared by all connections.
struct Hub {
  ServerOptions options;
  std::vector<NodeInfo> nodes;
  RunCalls calls;
  std::size_t connections = 0;  ///< HTTP and WebSocket
  std::set<std::shared_ptr<Client>> clients;
  net::io_context io{1};        // declared after the members that its handlers use in their destructors
  net::thread_pool workers{1};  ///< for requests to the run, which may wait for a frame
  std::atomic<std::uint64_t> wanted_planes{0}, wanted_coded{0};
  std::atomic<std::size_t> client_count{0};
  std::shared_ptr<Picture> last;
  bool ended = false;

  /// Sets the nodes that clients wait for.
  void want(const Wanted& nodes);
  /// Sends a frame to a client that waits for it, and adds the codes that it needs.
  void send(Picture& picture, Client& client) const;
  /// Determines the nodes that clients wait for. After the end of the run waiting clients get the last frame.
  void update_wanted();
  /// Sends a request to the run on the worker thread. @param done called with the answer, JSON, on the server's thread
  void ask(std::function<std::string()> question, std::function<void(std::string, std::string problem)> done);
};

/// Message protocol of one client.
class Protocol {
 public:
  explicit Protocol(Client& client) : client_(client) {}
  Protocol(const Protocol&) = delete;
  Protocol& operator=(const Protocol&) = delete;
  virtual ~Protocol() = default;
  virtual void opened() = 0;
  virtual void received(std::string_view message, bool binary) = 0;
  /// Nodes that the client has requested.
  virtual Wanted wanted() const = 0;
  virtual void show(const Picture& picture) = 0;
  virtual void ended() {}

 protected:
  Client& client_;
};

/// The project's own protocol: docs/live_view.md.
std::unique_ptr<Protocol> view_protocol(Client& client);
/// Foxglove's WebSocket protocol, version 1.
std::unique_ptr<Protocol> foxglove_protocol(Client& client);

class Client : public std::enable_shared_from_this<Client> {
 public:
  using Request = beast::http::request<beast::http::string_body>;
  Client(beast::tcp_stream stream, Hub& hub);
  ~Client();

  /// Accepts the upgrade. @param protocol the chosen sub-protocol, empty: the project's own
  void open(const Request& request, const std::string& protocol);
  using Values = std::vector<std::shared_ptr<const CodedChannels>>;
  void send_text(std::string text) { send({std::move(text), {}, false}); }
  /// @param values follow the bytes in the same message
  void send_binary(std::string bytes, Values values = {}) { send({std::move(bytes), std::move(values), true}); }
  void close(const std::string& reason);
  /// Calls a function, e.g. a method of the protocol. An exception closes this connection, not the server.
  template <class Call> void guarded(Call&& call, const char* reason = "this message cannot be sent") {
    try {
      call();
    } catch (const std::exception&) {
      close(reason);
    }
  }
  /// Nodes of which it is ready for a frame: everything has been sent and the rate allows another one.
  Wanted wanted() const;
  void frame_sent();
  void set_rate(double frames_per_s);
  Protocol& protocol() { return *protocol_; }
  Hub& hub() { return hub_; }

 private:
  struct Message {
    std::string bytes;
    Values values;
    bool binary;
  };
  void send(Message message);
  void read();
  void write();
  void gone();
  bool too_many_messages();

  using Clock = std::chrono::steady_clock;
  Hub& hub_;
  beast::websocket::stream<beast::tcp_stream> socket_;
  std::unique_ptr<Protocol> protocol_;
  beast::flat_buffer buffer_;
  std::deque<Message> queue_;
  bool writing_ = false, closing_ = false;
  Clock::time_point next_frame_{}, second_{};
  int messages_ = 0;  ///< since second_
  double rate_;
  net::steady_timer timer_;
};

}  // namespace tofgraph::live
