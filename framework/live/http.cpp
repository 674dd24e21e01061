// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "live/http.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tofgraph::live {
namespace {

namespace http = beast::http;

constexpr std::uint32_t max_header = 8U << 10;
constexpr std::size_t max_body = std::size_t{64} << 10, max_waiting_reads = 10;

std::string_view text_of(beast::string_view text) { return {text.data(), text.size()}; }

bool same_text(std::string_view a, std::string_view b) {  // constant-time comparison
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

bool is_loopback_name(std::string_view host) { return host == "localhost" || host == "127.0.0.1" || host == "[::1]"; }

/// Value of a key in a query, "" if absent.
std::string_view query_value(std::string_view target, std::string_view key) {
  const std::size_t mark = target.find('?');
  std::string_view rest = mark == std::string_view::npos ? "" : target.substr(mark + 1);
  while (!rest.empty()) {
    const std::string_view part = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(rest.size(), part.size() + 1));
    if (part.starts_with(key) && part.size() > key.size() && part[key.size()] == '=')
      return part.substr(key.size() + 1);
  }
  return {};
}

/// Preferred sub-protocol among those a client offers; none if it offers none.
std::optional<std::string> chosen_protocol(std::string_view offered) {
  if (offered.empty()) return "";
  for (const std::string_view known : {"tofgraph.v1", "foxglove.sdk.v1", "foxglove.websocket.v1"}) {
    for (std::string_view rest = offered; !rest.empty();) {
      std::string_view word = rest.substr(0, rest.find(','));
      rest.remove_prefix(std::min(rest.size(), word.size() + 1));
      while (!word.empty() && word.front() == ' ') word.remove_prefix(1);
      while (!word.empty() && word.back() == ' ') word.remove_suffix(1);
      if (word == known) return std::string(known);
    }
  }
  return std::nullopt;
}

}  // namespace

HttpSession::HttpSession(net::ip::tcp::socket socket, Hub& hub) : hub_(hub), stream_(std::move(socket)) {
  ++hub_.connections;
}
HttpSession::~HttpSession() { --hub_.connections; }

void HttpSession::read() {
  parser_.emplace();
  parser_->header_limit(max_header);
  parser_->body_limit(max_body);
  stream_.expires_after(std::chrono::seconds(max_waiting_reads));
  http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    if (error == http::error::body_limit) return self->problem(413, "the body is longer than 64 KiB");
    if (error == http::error::header_limit) return self->problem(431, "the header is longer than 8 KiB");
    if (error == http::error::end_of_stream || error == beast::error::timeout) return;
    if (error && error.category() == http::make_error_code(http::error::bad_method).category())
      return self->problem(400, "this is not HTTP");
    if (error) return;
    self->handle();
  });
}

void HttpSession::handle() {
  const Request& request = parser_->get();
  const std::string_view target = text_of(request.target()), path = target.substr(0, target.find('?'));
  version_ = request.version();
  keep_ = request.keep_alive();
  head_ = request.method() == http::verb::head;
  if (const auto refused = refusal(request)) return problem(refused->first, refused->second);
  if (beast::websocket::is_upgrade(request)) return upgrade(request);
  const bool get = head_ || request.method() == http::verb::get;
  if (const auto file = page_files().find(path); file != page_files().end() && get)
    return answer(200, file->second.type, std::string(file->second.content));
  if (path == "/state" && get) {
    return hub_.ask(hub_.calls.state, [self = shared_from_this()](std::string state, const std::string& why) {
      why.empty() ? self->answer(200, "application/json", std::move(state)) : self->problem(503, why);
    });
  }
  if (path == "/parameters" && request.method() == http::verb::put) return change(request);
  if (path == "/parameters" || path == "/state" || page_files().contains(path))
    return problem(405, "this method is not allowed here");
  problem(404, "there is no such page; there are: / (the page), /state, /parameters (PUT)");
}

std::optional<std::pair<unsigned, std::string>> HttpSession::refusal(const Request& request) const {
  const std::string_view host = text_of(request[http::field::host]);
  if (!host_allowed(host)) return std::pair{403U, std::string("the host name of this request is not allowed")};
  const std::string_view origin = text_of(request[http::field::origin]);
  if (!origin.empty() && !origin_allowed(origin, host))
    return std::pair{403U, std::string("pages of other origins may not connect; the parameter `origins` allows them")};
  const std::string_view target = text_of(request.target());
  const bool is_page = page_files().contains(target.substr(0, target.find('?')));
  if (is_page && !beast::websocket::is_upgrade(request)) return std::nullopt;  // the page itself contains no data
  if (!token_given(request))
    return std::pair{401U, std::string("a token is needed: open the address that tofgraph printed at its start")};
  return std::nullopt;
}

/// Rejects other host names, which a foreign page may have resolved to this address (DNS rebinding).
bool HttpSession::host_allowed(std::string_view host) const {
  if (!hub_.options.token.empty()) return true;  // the token is sufficient protection
  const std::string port = fmt::format(":{}", hub_.options.port);
  return host.ends_with(port) && is_loopback_name(host.substr(0, host.size() - port.size()));
}

bool HttpSession::origin_allowed(std::string_view origin, std::string_view host) const {
  if (std::ranges::find(hub_.options.origins, origin) != hub_.options.origins.end()) return true;
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme) && origin.substr(scheme.size()) == host) return true;
  }
  return false;
}

bool HttpSession::token_given(const Request& request) const {
  if (hub_.options.token.empty()) return true;
  const std::string_view header = text_of(request[http::field::authorization]);
  return same_text(query_value(text_of(request.target()), "token"), hub_.options.token) ||
         same_text(header, "Bearer " + hub_.options.token);
}

void HttpSession::upgrade(const Request& request) {
  const auto protocol = chosen_protocol(text_of(request[http::field::sec_websocket_protocol]));
  keep_ = false;
  if (!protocol) return problem(400, "known protocols: tofgraph.v1, foxglove.websocket.v1, foxglove.sdk.v1");
  if (hub_.clients.size() >= hub_.options.max_clients)
    return problem(503, fmt::format("{} clients are connected, no more are allowed", hub_.clients.size()));
  std::make_shared<Client>(std::move(stream_), hub_)->open(request, *protocol);
}

void HttpSession::change(const Request& request) {
  const auto body = nlohmann::json::parse(request.body(), nullptr, false);
  const auto is_text = [&](const char* key) { return body.contains(key) && body[key].is_string(); };
  if (!body.is_object() || !is_text("node") || !is_text("parameter") || !is_text("value"))
    return problem(400, R"(expected JSON, e.g. {"node": "denoise", "parameter": "strength", "value": "4 mm"})");
  hub_.ask([&calls = hub_.calls, body] { return calls.change(body["node"], body["parameter"], body["value"]); },
           [self = shared_from_this()](std::string done, const std::string& why) {
             why.empty() ? self->answer(200, "application/json", std::move(done)) : self->problem(422, why);
           });
}

void HttpSession::answer(unsigned status, std::string_view type, std::string body) {
  response_ = std::make_shared<Response>(static_cast<http::status>(status), version_);
  response_->set(http::field::server, "tofgraph");
  response_->set(http::field::content_type, beast::string_view(type.data(), type.size()));
  response_->set(http::field::cache_control, "no-store");
  response_->set("Content-Security-Policy",
                 "default-src 'self'; img-src 'self' blob: data:; connect-src 'self' ws: wss:; base-uri 'none'; "
                 "form-action 'none'; frame-ancestors 'none'");
  response_->set("X-Content-Type-Options", "nosniff");
  response_->set("Referrer-Policy", "no-referrer");
  keep_ = keep_ && status < 400;
  response_->keep_alive(keep_);
  response_->body() = std::move(body);
  response_->prepare_payload();
  if (head_) response_->body().clear();
  stream_.expires_after(std::chrono::seconds(max_waiting_reads));
  http::async_write(stream_, *response_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    if (error) return;
    if (self->keep_) return self->read();
    beast::error_code ignored;
    self->stream_.socket().shutdown(net::ip::tcp::socket::shutdown_send, ignored);
  });
}

}  // namespace tofgraph::live
