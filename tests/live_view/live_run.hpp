// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A pipeline with a live view in this process.
#pragma once

#include "graph/runner.hpp"

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace tofgraph::tests {

/// A pipeline that runs until stopped. Its sink live_view listens on a free port.
class LiveRun {
 public:
  explicit LiveRun(const std::string& pipeline, graph::RunOptions options = {}) {
    graph::GraphOptions graph_options;
    graph_options.plugin_folders = graph::plugin_path({});
    graph_options.message = [this](const std::string&, const std::string& text, bool) {
      const std::scoped_lock lock(mutex_);
      messages_.push_back(text);
      changed_.notify_all();
    };
    config::Diagnostics diagnostics;
    graph_ = graph::build_graph(config::parse_document("test", pipeline), {}, graph_options, diagnostics);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    runner_ = std::make_unique<graph::Runner>(*graph_, options);
    thread_ = std::thread([this] {
      result_ = runner_->run();
      const std::scoped_lock lock(mutex_);
      over_ = true;
      changed_.notify_all();
    });
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::seconds(30), [this] { return over_ || !messages_.empty(); });
    if (messages_.empty()) throw std::runtime_error("no live view: " + (over_ ? result_.error : "it does not start"));
    url_ = messages_.front().substr(messages_.front().find("http://"));
  }
  ~LiveRun() { stop(); }

  graph::RunResult stop() {
    if (!thread_.joinable()) return result_;
    runner_->stop();
    thread_.join();
    return result_;
  }
  graph::RunResult wait() {
    if (thread_.joinable()) thread_.join();
    return result_;
  }
  std::string port() const {
    const std::size_t begin = url_.find(':', 7) + 1;
    return url_.substr(begin, url_.find('/', begin) - begin);
  }
  const std::string& url() const { return url_; }
  std::uint64_t frames_done() const { return runner_->frames_done(); }
  graph::Graph& graph() { return *graph_; }
  const std::vector<std::string>& messages() const { return messages_; }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> messages_;
  bool over_ = false;
  std::string url_;
  std::unique_ptr<graph::Graph> graph_;
  std::unique_ptr<graph::Runner> runner_;
  graph::RunResult result_;
  std::thread thread_;
};

}  // namespace tofgraph::tests
