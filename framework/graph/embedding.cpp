// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/instance.hpp"
#include "graph/runner.hpp"

#include <tofgraph/pipeline.hpp>

#include <fmt/format.h>

#include <atomic>
#include <mutex>

namespace tofgraph {

using namespace graph;

struct Pipeline::Impl {
  std::string pipeline, camera;
  std::vector<std::string> settings;
  GraphOptions options;
  std::map<std::string, std::function<void(tofgraph_frame&)>> receivers;
  std::mutex mutex;  // guards `runner`: stop() may be called from another thread
  Runner* runner = nullptr;

  std::unique_ptr<Graph> build() const {
    config::Diagnostics diagnostics;
    GraphOptions complete = options;
    complete.plugin_folders = graph::plugin_path(options.plugin_folders);
    auto graph = build_graph(document_of(pipeline, camera), settings, complete, diagnostics);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    for (const auto& [node, receive] : receivers) {
      const auto named = [&wanted = node](const auto& other) { return other->name == wanted; };
      if (!std::ranges::any_of(graph->nodes(), named))
        throw std::runtime_error(fmt::format("on_frame: there is no node '{}'", node));
    }
    return graph;
  }

  /// Runs the graph; stop() reaches the runner from another thread meanwhile.
  RunResult run(Runner& now) {
    struct Published {
      Published(Impl& all, Runner& shown) : impl(all) { show(&shown); }
      ~Published() { show(nullptr); }
      void show(Runner* shown) const {
        const std::scoped_lock lock(impl.mutex);
        impl.runner = shown;
      }
      Impl& impl;
    };
    const Published published(*this, now);
    return now.run();
  }
};

Pipeline::Pipeline(std::string pipeline, std::string camera) : impl_(std::make_unique<Impl>()) {
  impl_->pipeline = std::move(pipeline);
  impl_->camera = std::move(camera);
}
Pipeline::~Pipeline() = default;

void Pipeline::set(const std::string& parameter, const std::string& value) {
  impl_->settings.push_back(parameter + "=" + value);
}
void Pipeline::plugin_path(const std::vector<std::string>& folders) {
  impl_->options.plugin_folders.assign(folders.begin(), folders.end());
}
void Pipeline::overwrite(bool allowed) { impl_->options.overwrite = allowed; }

void Pipeline::on_frame(const std::string& node, std::function<void(const Frame&)> receive) {
  impl_->receivers[node] = [receive = std::move(receive)](tofgraph_frame& frame) {
    receive(Frame(&host_table(), &frame));
  };
}

void Pipeline::check() { impl_->build(); }

Pipeline::Result Pipeline::run(std::uint64_t frames, unsigned threads) {
  const auto graph = impl_->build();
  RunOptions options;
  if (frames != 0) options.frames = frames;
  options.threads = threads;
  options.receivers = impl_->receivers;
  Runner runner(*graph, options);
  const RunResult result = impl_->run(runner);
  if (!result.error.empty()) throw std::runtime_error(result.error);
  return {result.frames, result.dropped, result.wall_s, result.interrupted};
}

void Pipeline::stop() {
  const std::scoped_lock lock(impl_->mutex);
  if (impl_->runner != nullptr) impl_->runner->stop();
}

}  // namespace tofgraph
