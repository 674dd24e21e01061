// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file HTTP connection: the page, the state of the run, parameter changes, upgrades to WebSocket.
#pragma once

#include "live/client.hpp"

#include <map>
#include <optional>

namespace tofgraph::live {

constexpr std::size_t max_connections = 64;  ///< HTTP and WebSocket; further connections are closed immediately

/// File of the page, compiled into the program: no request reaches the file system.
struct PageFile {
  std::string_view type, content;
};
/// Files of the folder page/ by path, embedded by CMake.
std::map<std::string_view, PageFile> written_page_files();
/// The same, and colours.js with the colour maps.
const std::map<std::string_view, PageFile>& page_files();

class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(net::ip::tcp::socket socket, Hub& hub);
  ~HttpSession();
  void read();

 private:
  using Request = Client::Request;
  using Response = beast::http::response<beast::http::string_body>;

  void handle();
  void upgrade(const Request& request);
  void change(const Request& request);
  /// Reason and status for refusing the request; none: it is allowed.
  std::optional<std::pair<unsigned, std::string>> refusal(const Request& request) const;
  bool host_allowed(std::string_view host) const;
  bool origin_allowed(std::string_view origin, std::string_view host) const;
  bool token_given(const Request& request) const;
  void answer(unsigned status, std::string_view type, std::string body);
  void problem(unsigned status, const std::string& text) { answer(status, "text/plain; charset=utf-8", text + "\n"); }

  Hub& hub_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<beast::http::request_parser<beast::http::string_body>> parser_;
  std::shared_ptr<Response> response_;
  bool keep_ = false, head_ = false;
  unsigned version_ = 11;
};

}  // namespace tofgraph::live
