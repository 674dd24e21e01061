// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// tofgraph._core: pipelines, their frames, stages written in Python. What users call is in tofgraph/*.py.
#include "config/document.hpp"
#include "config/json_text.hpp"
#include "graph/runner.hpp"
#include "python/arrays.hpp"
#include "python/run_lock.hpp"
#include "python/stage.hpp"

#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>

namespace tofgraph::python {
namespace {

struct OwnStage {
  const graph::Plugin* plugin;
};

/// A pipeline as Python describes it.
struct Description {
  std::string text;      ///< file, one-line form, or YAML
  bool is_yaml = false;  ///< `text` is the document itself
  std::string camera;    ///< profile's name or path, or empty
  std::vector<std::string> settings, plugin_folders;
  std::vector<OwnStage> stages;
  bool overwrite = false;
  std::function<void(const std::string&, const std::string&, bool)> message;  ///< node, text, warning
};

/// Builds and checks. Called without the interpreter's lock. @throws config::ConfigurationError
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

/// The node whose frames are wanted: the named one, or the last that is not a sink.
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

/// A pipeline that runs on a thread of its own; frames of one node wait in a queue until Python takes them.
class Run {
 public:
  Run(const Description& description, const std::string& node, bool keep_frames, std::uint64_t frames, unsigned threads,
      std::size_t capacity)
      : capacity_(capacity) {
    {
      const py::gil_scoped_release unlocked;
      graph_ = build(description, warnings_);
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
  ~Run() { close(); }

  /// Destroys a run; within a call that a run made, on a thread of its own.
  static void discard(Run* run) {
    if (!RunLock::held()) {
      delete run;
      return;
    }
    run->close();
    discarding().emplace_back([run] {
      const py::gil_scoped_acquire lock;
      delete run;
    });
  }
  /// Waits for runs that are still being destroyed: before the interpreter ends.
  static void finish_discarding() {
    std::vector<std::thread> threads = std::exchange(discarding(), {});
    const py::gil_scoped_release unlocked;
    for (std::thread& thread : threads) thread.join();
  }
  /// Waits, before the interpreter ends, until no thread is within a call: it would never get the interpreter's lock
  /// back.
  static void leave_all() {
    finish_discarding();
    for (int i = 0; i < 2000 && Inside::count > 0; ++i) {
      const py::gil_scoped_release unlocked;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  /// The next frame, or null at the end. @throws RunError
  std::shared_ptr<HeldFrame> next() {
    const Inside inside;
    std::shared_ptr<HeldFrame> frame;
    wait([&] { return !queue_.empty() || over_; });
    {
      const std::scoped_lock lock(mutex_);
      if (!queue_.empty()) {
        frame = std::move(queue_.front());
        queue_.pop_front();
        changed_.notify_all();
      }
    }
    if (!frame) end();
    return frame;
  }

  /// Waits for the end. @throws std::runtime_error
  void finish() {
    const Inside inside;
    wait([&] { return over_; });
    end();
  }

  /// Ends the run in order; frames that wait are dropped. Does not wait for the end within a call that a run made.
  void close() {
    const Inside inside;
    const py::gil_scoped_release unlocked;
    std::deque<std::shared_ptr<HeldFrame>> dropped;  // destroyed without the mutex: arrays wait for the interpreter
    {
      const std::scoped_lock lock(mutex_);
      closing_ = true;
      dropped.swap(queue_);
      changed_.notify_all();
      if (runner_) runner_->stop();
    }
    if (RunLock::held()) return;  // this run may be the caller: discard() waits elsewhere
    join();
    std::unique_ptr<graph::Graph> graph;
    std::unique_ptr<graph::Runner> runner;
    const std::scoped_lock lock(mutex_);
    graph.swap(graph_);
    runner.swap(runner_);
  }

  py::dict result() const {
    const std::scoped_lock lock(mutex_);
    py::dict result;
    result["frames"] = result_.frames;
    result["dropped"] = result_.dropped;
    result["seconds"] = result_.wall_s;
    result["interrupted"] = result_.interrupted;
    result["warnings"] = result_.warnings;
    return result;
  }
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  /// A call that waits without the interpreter's lock, which guards the count.
  struct Inside {
    Inside() { ++count; }
    ~Inside() { --count; }
    Inside(const Inside&) = delete;
    Inside& operator=(const Inside&) = delete;
    inline static int count = 0;
  };

  /// Threads that destroy runs; the interpreter's lock guards the list.
  static std::vector<std::thread>& discarding() {
    static std::vector<std::thread> threads;
    return threads;
  }

  void receive(tofgraph_frame& frame) {
    auto held = std::make_shared<HeldFrame>(frame);
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return queue_.size() < capacity_ || closing_; });
    if (closing_) return;
    queue_.push_back(std::move(held));
    changed_.notify_all();
  }

  /// Waits without the interpreter's lock, and looks for Ctrl-C meanwhile.
  template <class Condition> void wait(const Condition& condition) {
    for (bool there = false; !there;) {
      {
        const py::gil_scoped_release unlocked;
        std::unique_lock lock(mutex_);
        there = changed_.wait_for(lock, std::chrono::milliseconds(100), condition);
      }
      if (!there && PyErr_CheckSignals() != 0) {
        py::error_already_set interrupt;
        close();
        throw interrupt;
      }
    }
  }

  /// Waits for the run's thread. Several threads may: of Python, and the one that ends the interpreter.
  void join() {
    const std::scoped_lock lock(join_mutex_);
    if (thread_.joinable()) thread_.join();
  }

  void end() {
    {
      const py::gil_scoped_release unlocked;
      join();
    }
    if (!result_.error.empty()) throw std::runtime_error(std::exchange(result_.error, {}));
  }

  std::size_t capacity_;
  std::vector<std::string> warnings_;
  std::unique_ptr<graph::Graph> graph_;
  std::unique_ptr<graph::Runner> runner_;
  std::thread thread_;
  mutable std::mutex mutex_;
  std::mutex join_mutex_;
  std::condition_variable changed_;
  std::deque<std::shared_ptr<HeldFrame>> queue_;
  graph::RunResult result_;
  bool over_ = false, closing_ = false;
};

/// {text, mistakes: [{file, line, column, severity, message, hint}]}: what ConfigurationError is made from.
py::list mistakes_of(const config::ConfigurationError& error) {
  py::list mistakes;
  for (const config::Diagnostic& mistake : error.mistakes()) {
    py::dict one;
    one["file"] = mistake.at.source ? mistake.at.source->name : "";
    one["line"] = mistake.at.line;
    one["column"] = mistake.at.column;
    one["severity"] = mistake.severity == config::Severity::error ? "error" : "warning";
    one["message"] = mistake.message;
    one["hint"] = mistake.hint;
    mistakes.append(one);
  }
  return mistakes;
}

void translate(std::exception_ptr thrown) {  // NOLINT(performance-unnecessary-value-param): pybind11's signature
  const auto raise = [](const char* name, const py::object& arguments) {
    const py::object type = py::module_::import("tofgraph._errors").attr(name);
    const py::object error = type(*arguments);
    PyErr_SetObject(type.ptr(), error.ptr());
  };
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const py::builtin_exception&) {
    throw;  // KeyError, TypeError, ..: pybind11's own
  } catch (const config::ConfigurationError& error) {
    raise("ConfigurationError", py::make_tuple(error.what(), mistakes_of(error)));
  } catch (const graph::PluginError& error) {
    raise("ConfigurationError", py::make_tuple(error.what(), py::list()));
  } catch (const std::runtime_error& error) {
    raise("RunError", py::make_tuple(error.what()));
  }
}

std::string describe(const std::string& name, const std::vector<std::string>& folders) {
  const graph::PluginRegistry registry(graph::plugin_path({folders.begin(), folders.end()}));
  const graph::PluginFile* file = registry.find(name);
  if (file == nullptr)
    throw config::ConfigurationError("there is no stage or effect '" + name + "'\n         " +
                                     config::suggestion(name, registry.names(), "stages"));
  return config::json_text(registry.describe({*file}).at(file->path.string()));
}

std::vector<std::string> stages(const std::vector<std::string>& folders) {
  return graph::PluginRegistry(graph::plugin_path({folders.begin(), folders.end()})).names();
}

}  // namespace
}  // namespace tofgraph::python

PYBIND11_MODULE(_core, module) {
  using namespace tofgraph::python;
  namespace py = pybind11;
  module.doc() = "Pipelines of tofgraph and their frames";
  module.attr("version") = TOFGRAPH_VERSION;
  py::register_local_exception_translator(translate);
  add_frames(module);
  add_setup(module);
  const py::class_<OwnStage> own_stage(module, "OwnStage");
  module.def("plugin_of", [](const py::object& stage_class, const py::dict& declaration) {
    return OwnStage{&plugin_of(stage_class, declaration)};
  });
  py::class_<Description>(module, "Description")
      .def(py::init<>())
      .def_readwrite("text", &Description::text)
      .def_readwrite("is_yaml", &Description::is_yaml)
      .def_readwrite("camera", &Description::camera)
      .def_readwrite("settings", &Description::settings)
      .def_readwrite("plugin_folders", &Description::plugin_folders)
      .def_readwrite("stages", &Description::stages)
      .def_readwrite("overwrite", &Description::overwrite)
      .def_readwrite("message", &Description::message);
  module.def("check", [](const Description& description) {
    std::vector<std::string> warnings;
    const py::gil_scoped_release unlocked;
    static_cast<void>(build(description, warnings));
    return warnings;
  });
  py::class_<Run, std::shared_ptr<Run>>(module, "Run")
      .def(py::init([](const Description& description, const std::string& node, bool keep_frames, std::uint64_t frames,
                       unsigned threads, std::size_t capacity) {
             if (!RunLock::held()) Run::finish_discarding();
             return std::shared_ptr<Run>(new Run(description, node, keep_frames, frames, threads, capacity),
                                         &Run::discard);
           }),
           py::arg("description"), py::arg("node"), py::arg("keep_frames"), py::arg("frames"), py::arg("threads"),
           py::arg("capacity"))
      .def("next", &Run::next)
      .def("finish", &Run::finish)
      .def("close", &Run::close)
      .def("result", &Run::result)
      .def_property_readonly("warnings", &Run::warnings);
  module.def("leave_all", &Run::leave_all);
  module.def("describe", &describe, py::arg("name"), py::arg("plugin_folders"),
             py::call_guard<py::gil_scoped_release>());
  module.def("stages", &stages, py::arg("plugin_folders"), py::call_guard<py::gil_scoped_release>());
}
