// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Server of the live view: HTTP, WebSocket and the page on one port.
#pragma once

#include "live/picture.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::live {

struct ServerOptions {
  std::string address = "127.0.0.1";  ///< numeric address to listen on
  std::uint16_t port = 8765;          ///< 0: a free one
  std::string token;                  ///< empty: none is asked for
  std::vector<std::string> origins;   ///< further origins, e.g. https://app.foxglove.dev
  std::size_t max_clients = 16;       ///< WebSocket clients at once
  double max_rate = 30;               ///< frames per second that a client gets at most
};

/// Questions of the server to the run. Both may be called on any thread, give JSON as text and throw
/// std::runtime_error in words.
struct RunCalls {
  std::function<std::string()> state;
  std::function<std::string(const std::string& node, const std::string& parameter, const std::string& value)> change;
};

/// Server with a thread of its own. A client gets a frame when it has asked for one and the frame before it has left;
/// what comes meanwhile is passed over. So a slow client costs nothing but the memory of one frame.
class Server {
 public:
  /// Listens at once. @throws std::runtime_error in words, e.g. when the port is taken
  Server(const ServerOptions& options, std::vector<NodeInfo> nodes, RunCalls calls);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;
  /// Address of the page, with the token if there is one.
  std::string url() const;
  /// Nodes that a client waits for now, as bits. [any thread]
  std::uint64_t wanted() const;
  std::size_t clients() const;  ///< [any thread]
  /// Sends a frame to the clients that wait for it. [any thread]
  void show(std::shared_ptr<const Picture> picture);
  /// Tells the clients that no more frames come. Those that come later get `last`, which may be null.
  void end(std::shared_ptr<const Picture> last);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Random token of 128 bits, as 32 hexadecimal digits.
std::string random_token();

}  // namespace tofgraph::live
