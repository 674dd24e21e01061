// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/harness.hpp>

#include "config/paths.hpp"
#include "graph/node.hpp"
#include "graph/pipeline.hpp"
#include "graph/plugin.hpp"
#include "io/profile.hpp"

#include <tofgraph/channels.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tofgraph {

using namespace graph;

struct Harness::Impl {
  Host host;
  BufferPool pool;
  std::unique_ptr<Node> node;
  Stream input;
  tofgraph_frame in, out;
  bool prepared = false;
  std::vector<std::string> messages;

  void check(const config::Diagnostics& diagnostics) const {
    if (!diagnostics.ok()) throw std::runtime_error(diagnostics.text());
  }
};

Harness::Harness(const std::string& line, const std::vector<std::string>& plugin_folders)
    : impl_(std::make_unique<Impl>()) {
  Impl& self = *impl_;
  self.host.version = TOFGRAPH_VERSION;
  self.host.message = [&self](const std::string&, const std::string& text, bool) { self.messages.push_back(text); };
  config::Diagnostics diagnostics;
  const PipelineSpec pipeline = parse_pipeline(pipeline_from_line(line, ""), diagnostics);
  self.check(diagnostics);
  const NodeSpec& spec = pipeline.nodes.at(0);
  const PluginRegistry registry(plugin_path({plugin_folders.begin(), plugin_folders.end()}));
  self.host.plugin_path = config::joined_path(registry.folders());
  const PluginFile* file = registry.find(spec.stage);
  if (file == nullptr) throw std::runtime_error("there is no stage " + spec.stage);
  const Plugin& stage = load_plugin(*file);
  std::vector<const config::Entry*> entries;
  bool overwrite = false;
  for (const config::Entry& entry : spec.parameters) {
    if (entry.key == "overwrite" && file->kind == "sink")
      static_cast<void>(parse_bool(entry.value.text, overwrite));
    else
      entries.push_back(&entry);
  }
  ParameterValues values(stage, entries, spec.at, diagnostics);
  self.check(diagnostics);
  self.node = std::make_unique<Node>(0, spec.name, spec.at, stage, std::move(values), self.host);
  self.node->set_overwrite(overwrite);
  if (!self.node->create(diagnostics)) self.check(diagnostics);
  self.in.pool = self.out.pool = &self.pool;
  self.in.metadata.size = sizeof(tofgraph_metadata);
  self.in.metadata.integration_time = self.in.metadata.modulation_frequency = std::nan("");
  self.in.metadata.temperature = self.in.metadata.time_since_power_on = std::nan("");
  self.input.known = UINT64_MAX;
  self.node->set_provenance([] { return std::string("{}"); });
}

Harness::~Harness() = default;

void Harness::camera(const std::string& profile) {
  const auto file = io::find_profile(profile, std::filesystem::current_path());
  if (file.empty()) throw std::runtime_error("there is no camera profile " + profile);
  impl_->input.camera = io::load_profile(file);
  if (impl_->node->is_source()) return;
  const tofgraph_camera& c = impl_->input.camera->view();
  put<float>("rays", {c.height, c.width, 3}, std::vector<float>(c.rays, c.rays + std::size_t{c.height} * c.width * 3));
}

const tofgraph_camera& Harness::camera() const { return impl_->input.camera->view(); }
tofgraph_metadata& Harness::metadata() { return impl_->in.metadata; }
void Harness::known(std::uint64_t bits) { impl_->input.known = bits; }
void Harness::overwrite(bool allowed) { impl_->node->set_overwrite(allowed); }

void Harness::put_bytes(const std::string& name, std::uint32_t type, const std::vector<std::uint64_t>& extent,
                        const void* data, std::size_t bytes, const Meaning& meaning) {
  const ChannelInfo* known = known_channel(name);
  Channel channel;
  channel.name = name;
  channel.type = type;
  channel.rank = static_cast<std::uint32_t>(extent.size());
  std::ranges::copy(extent, channel.extent.begin());
  channel.unit = !meaning.unit.empty() || known == nullptr ? meaning.unit : known->unit;
  channel.of = meaning.of;
  channel.applied = split_words(meaning.applied);
  channel.from = split_words(meaning.from);
  channel.made_by = SIZE_MAX;
  std::string applied, from;
  tofgraph_view view = empty_view();
  const tofgraph_channel border = channel.view(applied, from);
  if (channel_bytes(type, channel.rank, extent.data()) != bytes)
    throw std::invalid_argument(name + ": extents and values differ");
  tofgraph_host host{};
  fill_frame_calls(host);
  if (host.write(&impl_->in, &border, &view) != TOFGRAPH_STATUS_OK)
    throw std::invalid_argument(name + ": cannot be written");
  if (bytes != 0) std::memcpy(view.data, data, bytes);
  if (impl_->prepared) return;
  if (Channel* existing = impl_->input.find(name))
    *existing = std::move(channel);
  else
    impl_->input.channels.push_back(std::move(channel));
}

void Harness::prepare() {
  config::Diagnostics diagnostics;
  if (!impl_->node->prepare({&impl_->input}, {"input"}, diagnostics)) impl_->check(diagnostics);
  for (const config::Diagnostic& d : diagnostics.all()) impl_->messages.push_back(d.message);
  impl_->prepared = true;
}

bool Harness::run() {
  if (!impl_->prepared) prepare();
  impl_->out.clear();
  impl_->out.channels = impl_->in.channels;
  impl_->out.metadata = impl_->in.metadata;
  tofgraph_frame* frames[] = {&impl_->out};
  const bool more = impl_->node->process(frames, 1);
  ++impl_->in.metadata.number;
  return more;
}

void Harness::finish() { impl_->node->finish(); }

bool Harness::has(const std::string& channel) const { return impl_->out.find(channel) != nullptr; }

tofgraph_view Harness::find(const std::string& name) const {
  const auto* channel = impl_->out.find(name);
  if (channel == nullptr) throw std::runtime_error("the frame has no " + name);
  return view_of(*channel);
}

std::vector<std::uint64_t> Harness::extent(const std::string& channel) const {
  const tofgraph_view view = find(channel);
  return {view.extent, view.extent + view.rank};
}

std::string Harness::applied(const std::string& channel) const {
  const Channel* found = impl_->node->output().find(channel);
  return found != nullptr ? join_words(found->applied) : "";
}

std::string Harness::of(const std::string& channel) const {
  const Channel* found = impl_->node->output().find(channel);
  return found != nullptr ? found->of : "";
}

const tofgraph_camera& Harness::camera_out() const { return impl_->node->output().camera->view(); }
const std::vector<std::string>& Harness::messages() const { return impl_->messages; }

}  // namespace tofgraph
