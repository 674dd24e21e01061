// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "python/run.hpp"

#include "config/document.hpp"
#include "python/run_lock.hpp"

#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <chrono>
#include <utility>

namespace tofgraph::python {
namespace {

/// Returns the node whose frames are requested: the named one, or the last that is not a sink.
std::string node_of(const graph::Graph& graph, const std::string& wanted) {
  std::string last;
  for (const auto& node : graph.nodes()) {
    if (!wanted.empty() && node->name == wanted) {
      if (node->is_sink()) throw py::value_error("node '" + wanted + "' is a sink: no frames leave it");
      return wanted;
    }
    if (!node->is_sink()) last = node->name;
  }
  if (!wanted.empty()) throw py::key_error("there is no node '" + wanted + "'");
  return last;
}

}  // namespace

std::unique_ptr<graph::Graph> build(const Description& description, std::vector<std::string>& warnings) {
  graph::GraphOptions options;
  options.plugin_folders = graph::plugin_path({description.plugin_folders.begin(), description.plugin_folders.end()});
  for (const OwnStage& stage : description.stages) options.own_stages.push_back(stage.plugin);
  options.overwrite = description.overwrite;
  if (description.message) {
    options.message = [tell = description.message](const std::string& node, const std::string& text, bool warning) {
      if (Py_IsInitialized() == 0) return;
      const RunLock lock;
      try {
        tell(node, text, warning);
      } catch (py::error_already_set& error) {
        error.discard_as_unraisable("a message of tofgraph");
      }
    };
  }
  config::Diagnostics diagnostics;
  const config::Value document =
      description.is_yaml ? config::parse_document("pipeline", description.text, std::filesystem::current_path())
                          : graph::document_of(description.text, description.camera);
  auto built = graph::build_graph(document, description.settings, options, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  for (const config::Diagnostic& mistake : diagnostics.all()) {
    if (!mistake.message.starts_with("nothing reads node")) warnings.push_back(mistake.message);
  }
  return built;
}

Run::Run(const Description& description, const std::string& node, bool keep_frames, std::uint64_t frames,
         unsigned threads, std::size_t capacity)
    : capacity_(capacity) {
  const Inside inside;
  {
    const py::gil_scoped_release unlocked;
    graph_ = build(description, warnings_);
  }
  if (ending_ != std::thread::id() && ending_ != std::this_thread::get_id()) {
    PyErr_SetNone(PyExc_SystemExit);
    throw py::error_already_set();
  }
  graph::RunOptions options;
  if (frames != 0) options.frames = frames;
  options.threads = threads;
  if (keep_frames) options.receivers[node_of(*graph_, node)] = [this](tofgraph_frame& frame) { receive(frame); };
  runner_ = std::make_unique<graph::Runner>(*graph_, options);
  thread_ = std::thread([this] {
    graph::RunResult result;
    try {
      result = runner_->run();
    } catch (const std::exception& error) {
      result.error = error.what();
    }
    const std::scoped_lock lock(mutex_);
    result_ = std::move(result);
    over_ = true;
    changed_.notify_all();
  });
}

void Run::discard(Run* run) {
  if (!RunLock::held()) {
    delete run;
    return;
  }
  run->close();
  ++discarding_;
  std::thread([run] {
    const py::gil_scoped_acquire lock;
    delete run;
    --discarding_;
  }).detach();
}

void Run::leave_all() {
  ending_ = std::this_thread::get_id();
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(2);
  while (discarding_ > 0 || (Inside::count > 0 && std::chrono::steady_clock::now() < limit)) {
    const py::gil_scoped_release unlocked;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

std::shared_ptr<HeldFrame> Run::next() {
  const Inside inside;
  std::shared_ptr<HeldFrame> frame;
  bool half_empty = false;
  wait([&] {
    if (queue_.empty()) return over_;
    frame = std::move(queue_.front());
    queue_.pop_front();
    half_empty = queue_.size() == capacity_ / 2;
    return true;
  });
  if (half_empty) room_.notify_one();  // no earlier: else a full queue would wake the run's thread for each frame
  if (!frame) end();
  return frame;
}

void Run::finish() {
  const Inside inside;
  wait([&] { return over_; });
  end();
}

void Run::close() {
  const Inside inside;
  const py::gil_scoped_release unlocked;
  std::deque<std::shared_ptr<HeldFrame>> dropped;  // destroyed without the mutex: arrays wait for the GIL
  {
    const std::scoped_lock lock(mutex_);
    closing_ = true;
    dropped.swap(queue_);
    room_.notify_all();
    if (runner_) runner_->stop();
  }
  if (RunLock::held()) return;  // the caller may be this run's own thread; discard() waits on another one
  join();
  std::unique_ptr<graph::Graph> graph;
  std::unique_ptr<graph::Runner> runner;
  const std::scoped_lock lock(mutex_);
  graph.swap(graph_);
  runner.swap(runner_);
}

py::dict Run::result() const {
  const std::scoped_lock lock(mutex_);
  py::dict result;
  result["frames"] = result_.frames;
  result["dropped"] = result_.dropped;
  result["seconds"] = result_.wall_s;
  result["interrupted"] = result_.interrupted;
  result["warnings"] = result_.warnings;
  return result;
}

void Run::receive(tofgraph_frame& frame) {
  auto held = std::make_shared<HeldFrame>(frame);
  {
    std::unique_lock lock(mutex_);
    room_.wait(lock, [this] { return queue_.size() < capacity_ || closing_; });
    if (closing_) return;
    queue_.push_back(std::move(held));
  }
  changed_.notify_one();  // without the mutex, for which the woken thread would wait again
}

/// Waits without the GIL and checks for Ctrl-C meanwhile.
template <class Condition> void Run::wait(const Condition& condition) {
  for (bool there = false; !there;) {
    {
      const py::gil_scoped_release unlocked;
      std::unique_lock lock(mutex_);
      there = changed_.wait_for(lock, std::chrono::milliseconds(100), condition);
    }
    if (!there && PyErr_CheckSignals() != 0) {
      py::error_already_set interrupt;
      RunLock::interrupt();
      close();
      throw interrupt;
    }
  }
}

/// Joins the run's thread. Several threads may call it: Python's own, and the one that ends the interpreter.
void Run::join() {
  const std::scoped_lock lock(join_mutex_);
  if (thread_.joinable()) thread_.join();
}

void Run::end() {
  {
    const py::gil_scoped_release unlocked;
    join();
  }
  if (!result_.error.empty()) throw std::runtime_error(std::exchange(result_.error, {}));
}

}  // namespace tofgraph::python
