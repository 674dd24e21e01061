// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/files/effect.hpp"

#include "config/log.hpp"
#include "graph/running_call.hpp"

#include <tofgraph/physics/exposures.hpp>

#include <fmt/format.h>

#include <utility>

namespace tofgraph::simulation {
namespace {

std::shared_ptr<graph::Host> standard_host() {
  static const std::shared_ptr<graph::Host> host = [] {
    auto made = std::make_shared<graph::Host>();
    made->message = [](const std::string& name, const std::string& text, bool warning) {
      config::print_message(fmt::format("effect {}: {}{}", name, warning ? "warning: " : "", text));
    };
    return made;
  }();
  return host;
}

}  // namespace

Effect::Effect(const graph::Plugin& plugin, const tofgraph_value* values, const tofgraph_camera& camera,
               std::shared_ptr<const void> keeps, std::shared_ptr<graph::Host> host)
    : keeps_(std::move(keeps)),
      host_(host != nullptr ? std::move(host) : standard_host()),
      instance_(plugin, plugin.name, *host_) {
  const auto check = [&](const std::optional<graph::Failure>& failure) {
    if (failure) throw EffectError(name(), failure->parameter, failure->message(plugin), failure->defect);
  };
  check(instance_.create(values));
  tofgraph_stream stream{};
  stream.size = sizeof stream;
  stream.channel_size = sizeof(tofgraph_channel);
  stream.exposure_size = sizeof(tofgraph_exposure);
  stream.node = "";
  stream.source = "{}";
  stream.camera = &camera;
  const physics::Exposures exposures = physics::exposures_of(camera);
  stream.exposures = exposures.data();
  stream.exposure_count = exposures.size();
  const tofgraph_stream* const streams[] = {&stream};
  check(instance_.prepare(streams, 0, nullptr));
}

void Effect::apply(tofgraph_light_state& state) const {
  graph::Failure& failure = graph::last_failure();
  if (!failure.text.empty()) failure = {};
  const graph::RunningCall call(instance_, "apply");
  if (border().apply(instance_.self(), &state) == TOFGRAPH_STATUS_OK && failure.text.empty()) return;
  const graph::Failure thrown = std::exchange(failure, {});
  throw EffectError(name(), thrown.parameter,
                    thrown.text.empty() ? "failed without an error message" : thrown.message(descriptor()),
                    thrown.defect);
}

}  // namespace tofgraph::simulation
