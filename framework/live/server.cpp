// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "live/server.hpp"

#include "live/http.hpp"

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>

#include <fmt/format.h>

#include <random>
#include <stdexcept>
#include <thread>

namespace tofgraph::live {

using tcp = net::ip::tcp;

struct Server::Impl {
  Hub hub;
  tcp::acceptor acceptor{hub.io};
  net::steady_timer pause{hub.io};  ///< after a failed accept
  net::executor_work_guard<net::io_context::executor_type> work{net::make_work_guard(hub.io)};
  std::thread thread;

  void listen();
  void accept();
  void run();
};

void Server::Impl::listen() {
  beast::error_code error;
  const auto address = net::ip::make_address(hub.options.address, error);
  if (error)
    throw std::runtime_error(fmt::format(
        "'{}' is not an address: write 127.0.0.1, 0.0.0.0 for all, or one of this computer", hub.options.address));
  const tcp::endpoint endpoint(address, hub.options.port);
  acceptor.open(endpoint.protocol());
  acceptor.set_option(net::socket_base::reuse_address(true));
  acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(64, error);
  if (error == net::error::address_in_use)
    throw std::runtime_error(fmt::format("port {} is taken by another program: choose another one, e.g. port={}",
                                         hub.options.port, hub.options.port + 1));
  if (error)
    throw std::runtime_error(
        fmt::format("cannot listen on {}:{}: {}", hub.options.address, hub.options.port, error.message()));
  hub.options.port = acceptor.local_endpoint().port();
}

void Server::Impl::accept() {
  acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
    if (error == net::error::operation_aborted) return;
    if (error) {  // e.g. out of file descriptors, which closing connections release
      pause.expires_after(std::chrono::milliseconds(100));
      return pause.async_wait([this](beast::error_code stopped) {
        if (!stopped) accept();
      });
    }
    if (hub.connections < max_connections) {
      beast::error_code ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      std::make_shared<HttpSession>(std::move(socket), hub)->read();
    }
    accept();
  });
}

/// An exception in a handler closes its connection, not the others.
void Server::Impl::run() {
  for (bool over = false; !over;) {
    try {
      hub.io.run();
      over = true;
    } catch (const std::exception&) {  // the handler is destroyed, and with it the connection
    }
  }
}

Server::Server(const ServerOptions& options, std::vector<NodeInfo> nodes, RunCalls calls)
    : impl_(std::make_unique<Impl>()) {
  impl_->hub.options = options;
  impl_->hub.nodes = std::move(nodes);
  impl_->hub.calls = std::move(calls);
  impl_->listen();
  impl_->accept();
  impl_->thread = std::thread([this] { impl_->run(); });
}

Server::~Server() {
  impl_->hub.workers.join();
  impl_->hub.io.stop();
  impl_->thread.join();
  impl_->hub.clients.clear();
}

std::uint16_t Server::port() const { return impl_->hub.options.port; }

std::string Server::url() const {
  const ServerOptions& options = impl_->hub.options;
  const bool local = options.address == "127.0.0.1" || options.address == "::1";
  const std::string host = local                                            ? "localhost"
                           : options.address.find(':') != std::string::npos ? fmt::format("[{}]", options.address)
                                                                            : options.address;
  return fmt::format("http://{}:{}/{}", host, options.port,
                     options.token.empty() ? "" : fmt::format("?token={}", options.token));
}

Wanted Server::wanted() const {
  return {.planes = impl_->hub.wanted_planes.load(std::memory_order_relaxed),
          .coded = impl_->hub.wanted_coded.load(std::memory_order_relaxed)};
}
std::size_t Server::clients() const { return impl_->hub.client_count.load(std::memory_order_relaxed); }

void Server::show(std::shared_ptr<Picture> picture) {
  impl_->hub.want({});  // until the clients are ready again
  net::post(impl_->hub.io, [&hub = impl_->hub, picture = std::move(picture)] {
    Wanted shown;
    for (const NodePicture& node : picture->nodes) {
      const std::uint64_t bit = std::uint64_t{1} << node.node;
      shown.planes |= node.planes ? bit : 0;
      shown.coded |= bit;  // from the planes, if need be
    }
    for (const auto& client : std::set(hub.clients)) {
      const Wanted wants = client->wanted();
      const bool all_there = (wants.planes & ~shown.planes) == 0 && (wants.coded & ~shown.coded) == 0;
      if (wants.any() && all_there) client->guarded([&] { hub.send(*picture, *client); });
    }
    hub.update_wanted();
  });
}

void Server::end(std::shared_ptr<Picture> last) {
  net::post(impl_->hub.io, [&hub = impl_->hub, last = std::move(last)] {
    hub.ended = true;
    hub.last = last;
    for (const auto& client : std::set(hub.clients)) client->guarded([&] { client->protocol().ended(); });
    hub.update_wanted();
  });
}

std::string random_token() {
  std::random_device device;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", device());
  return token;
}

}  // namespace tofgraph::live
