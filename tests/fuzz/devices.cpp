// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/fuzz/target.hpp"

#include "config/diagnostics.hpp"
#include "devices/camcube/frame_assembler.hpp"
#include "devices/camcube/protocol.hpp"
#include "graph/plugin.hpp"
#include "live/server.hpp"
#include "tests/live_view/web_client.hpp"

#include <cmath>
#include <cstdlib>
#include <cstring>

namespace tofgraph::fuzz {
namespace {

void protocol(std::string_view bytes) {
  try {
    camcube::read_protocol(file_of(bytes, "protocol.yaml"));
  } catch (const config::ConfigurationError&) {
  }
}

/// Transfers of a camera of 2 x 3 pixels: one byte determines whether the next one is short, lost, or complete.
void usb_packets(std::string_view bytes) {
  camcube::Protocol protocol;
  protocol.magic = camcube::Magic{0, {0x7f}};
  protocol.image = camcube::Field{1, {1, false}};
  protocol.number = camcube::Field{2, {1, false}};
  protocol.integration_time = camcube::Field{4, {4, true}};
  protocol.modulation_frequency = camcube::Field{8, {8, false}};
  RawSourceData layout;
  layout.rows = 2;
  layout.columns = 3;
  if (!bytes.empty()) protocol.whole_frames = (bytes[0] & 1) != 0;
  camcube::FrameExchange frames(2, layout.frame_bytes());
  camcube::FrameAssembler assembler(protocol, layout, {NAN, 20e6}, frames);
  std::vector<std::uint8_t> transfer;
  for (std::size_t at = 1; at < bytes.size();) {
    const unsigned choice = static_cast<unsigned char>(bytes[at++]);
    if (choice % 16 == 15) {
      assembler.interrupted();
      continue;
    }
    // The first 16 bytes of the header are from the input; the rest repeats its last byte.
    const std::size_t given = std::min<std::size_t>(16, bytes.size() - at);
    transfer.assign(choice % 16 == 14 ? choice : assembler.message_bytes(), static_cast<std::uint8_t>(choice));
    std::memcpy(transfer.data(), bytes.data() + at, std::min(given, transfer.size()));
    at += given;
    assembler.message(transfer);
    camcube::RawFrame frame;
    frame.bytes.resize(layout.frame_bytes());
    try {
      while (frames.take(frame, std::chrono::milliseconds(0)))
        if (frame.bytes.size() != layout.frame_bytes()) std::abort();
    } catch (const camcube::Fault&) {
    }
  }
}

/// A descriptor as returned by a library: numbers and the choice of texts are from the input.
void plugin_descriptor(std::string_view bytes) {
  static const std::string texts[] = {"", "depth", "a\nb", std::string(5000, 'x'), "\xff\xfe", "filter", "effect", "m"};
  const auto number = [&]() -> std::uint32_t {
    std::uint32_t value = 0;
    const std::size_t count = std::min<std::size_t>(bytes.size(), 4);
    std::memcpy(&value, bytes.data(), count);
    bytes.remove_prefix(count);
    return value;
  };
  const auto text = [&]() -> const char* {
    const std::uint32_t choice = number() % (std::size(texts) + 1);
    return choice == std::size(texts) ? nullptr : texts[choice].c_str();
  };
  // Sizes are correct, or too small for anything: another stride between two ports would interpret texts as pointers.
  const auto size = [&](std::size_t own) {
    const std::uint32_t choice = number();
    return static_cast<std::uint32_t>(choice % 8 == 7 ? choice % 32 / 8 : own);
  };
  std::vector<tofgraph_parameter> parameters(number() % 4);
  for (tofgraph_parameter& parameter : parameters) {
    std::memset(&parameter, 0, sizeof parameter);
    parameter.name = text();
    parameter.kind = number();
    parameter.flags = number();
    parameter.unit = text();
    parameter.default_value = text();
    parameter.choices = text();
    parameter.text = text();
    parameter.minimum = static_cast<double>(number()) - 10;
    parameter.maximum = static_cast<double>(number());
  }
  std::vector<tofgraph_port> ports(number() % 4);
  for (tofgraph_port& port : ports) {
    std::memset(&port, 0, sizeof port);
    port.name = text();
    port.channel = text();
    port.shape = text();
    port.unit = text();
    port.type = number();
    port.direction = number() % 4;
    port.flags = number();
    port.needs = text();
    port.refuses = text();
    port.from = text();
    port.adds = text();
    port.of = text();
    port.text = text();
  }
  tofgraph_descriptor given{};
  given.size = size(sizeof given);
  given.api_major = number() % 4;
  given.api_minor = number() % 4;
  given.flags = number();
  given.kind = text();
  given.name = text();
  given.summary = text();
  given.version = text();
  given.author = text();
  given.licence = text();
  given.parameter_size = size(sizeof(tofgraph_parameter));
  given.port_size = size(sizeof(tofgraph_port));
  given.parameters = parameters.data();
  given.parameter_count = parameters.size();
  given.ports = ports.data();
  given.port_count = ports.size();
  given.create = [](const tofgraph_host*, void*, const tofgraph_value*, void**) { return 0; };
  given.prepare = [](void*, const tofgraph_stream* const*, std::uint64_t) { return 0; };
  given.process = [](void*, tofgraph_frame* const*, std::uint64_t) { return 0; };
  given.destroy = [](void*) {};
  graph::Plugin plugin;
  plugin.file = {"filter", "input", "tofgraph_filter_input.so"};
  try {
    graph::read_descriptor(&given, plugin);
    graph::describe(plugin).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  } catch (const graph::PluginError&) {
  }
}

/// A connection that sends the bytes unchanged, or, after a first byte of 1 or 2, as messages of a WebSocket, one per
/// line.
void live_view(std::string_view bytes) {
  static live::Server server(
      [] {
        live::ServerOptions options;
        options.port = 0;
        return options;
      }(),
      {},
      {[] { return std::string(R"({"frames":1})"); },
       [](const std::string&, const std::string&, const std::string&) -> std::string {
         throw std::runtime_error("no such node");
       }});
  static const std::string port = std::to_string(server.port());
  if (bytes.empty()) return;
  if (bytes[0] != 1 && bytes[0] != 2) {
    tests::raw_exchange(port, std::string(bytes), std::chrono::milliseconds(1));
    return;
  }
  try {
    tests::WebClient client(port, bytes[0] == 1 ? "tofgraph.v1" : "foxglove.sdk.v1");
    for (bytes.remove_prefix(1); !bytes.empty();) {
      const std::size_t end = std::min(bytes.find('\n'), bytes.size());
      const std::string message(bytes.substr(0, end));
      end % 2 == 0 ? client.send(message) : client.send_binary(message);
      bytes.remove_prefix(std::min(end + 1, bytes.size()));
    }
    client.cut();
  } catch (const std::exception&) {  // the server has closed the connection, which is allowed
  }
}

}  // namespace

std::vector<Target> device_targets() {
  return {{"protocol", "protocol descriptions of USB cameras", protocol},
          {"usb_packets", "transfers of a USB camera", usb_packets},
          {"plugin_descriptor", "descriptors of plugins", plugin_descriptor},
          {"live_view", "requests and messages to the live view", live_view}};
}

}  // namespace tofgraph::fuzz
