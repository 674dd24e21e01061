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
  std::uint16_t port = 8765;          ///< 0: any free port
  std::string token;                  ///< empty: none is required
  std::vector<std::string> origins;   ///< further origins, e.g. https://app.foxglove.dev
  std::size_t max_clients = 16;       ///< maximum number of WebSocket clients
  double max_rate = 30;               ///< maximum frames per second sent to a client
};

/// Requests of the server to the run. Both may be called on any thread, return JSON as text and throw
/// std::runtime_error with a readable message.
struct RunCalls {
  std::function<std::string()> state;
  std::function<std::string(const std::string& node, const std::string& parameter, const std::string& value)> change;
};

/// Server with its own thread. A client receives a frame when it has requested one and the previous one has been sent;
/// frames in between are skipped, so a slow client costs only the memory of one frame.
class Server {
 public:
  /// Starts listening. @throws std::runtime_error with a readable message, e.g. if the port is in use
  Server(const ServerOptions& options, std::vector<NodeInfo> nodes, RunCalls calls);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;
  /// Address of the page, with the token if there is one.
  std::string url() const;
  /// Nodes that clients are waiting for, and in which form. [any thread]
  Wanted wanted() const;
  std::size_t clients() const;  ///< [any thread]
  /// Sends a frame to the clients waiting for it. Codes that they need are added to it. [any thread]
  void show(std::shared_ptr<Picture> picture);
  /// Informs the clients that there are no more frames. Later clients get `last`, which may be null.
  void end(std::shared_ptr<Picture> last);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Random 128-bit token as 32 hexadecimal digits.
std::string random_token();

}  // namespace tofgraph::live
