// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/effect.hpp"

#include "core/plugin.hpp"

namespace tofgraph::simulation {

struct Effect::Context {
  std::vector<std::string> files;
};

namespace {

/// What the running call of this thread said through fail().
struct Failure {
  std::string parameter, text;
};
thread_local Failure failure;

/// Of the host's services an effect has these; the others belong to frames and are not there.
const tofgraph_host& effect_host() {
  static const tofgraph_host host = [] {
    tofgraph_host h{};
    h.size = sizeof(tofgraph_host);
    h.api_major = TOFGRAPH_API_MAJOR;
    h.api_minor = TOFGRAPH_API_MINOR;
    h.fail = [](void*, const char* parameter, const char* text) {
      failure = {parameter != nullptr ? parameter : "", text};
    };
    h.message = [](void*, std::uint32_t, const char*) {};
    h.stopping = [](void*) { return 0; };
    h.overwrite = [](void*) { return 0; };
    h.uses_file = [](void* context, const char* path) {
      static_cast<std::vector<std::string>*>(context)->emplace_back(path);
    };
    h.provenance = [](void*) { return "{}"; };
    return h;
  }();
  return host;
}

}  // namespace

Effect::Effect(const tofgraph_descriptor& descriptor, const tofgraph_value* values, const tofgraph_camera& camera)
    : descriptor_(descriptor), border_(*core::effect_of(descriptor)), context_(std::make_unique<Context>()) {
  failure = {"", "failed and did not say why"};
  if (descriptor.create(&effect_host(), &context_->files, values, &self_) != TOFGRAPH_OK || self_ == nullptr)
    throw EffectError(descriptor.name, failure.parameter, failure.text);
  tofgraph_stream stream{};
  stream.size = sizeof stream;
  stream.channel_size = sizeof(tofgraph_channel);
  stream.node = "";
  stream.camera = &camera;
  const tofgraph_stream* const streams[] = {&stream};
  if (descriptor.prepare(self_, streams, 1) == TOFGRAPH_OK) return;
  descriptor.destroy(self_);
  throw EffectError(descriptor.name, failure.parameter, failure.text);
}

Effect::~Effect() { descriptor_.destroy(self_); }

const std::vector<std::string>& Effect::files() const { return context_->files; }

void Effect::apply(tofgraph_light_state& state) const {
  failure = {"", "failed and did not say why"};
  if (border_.apply(self_, &state) != TOFGRAPH_OK) throw EffectError(descriptor_.name, failure.parameter, failure.text);
}

}  // namespace tofgraph::simulation
