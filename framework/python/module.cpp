// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// tofgraph._core: pipelines, their frames, stages written in Python. The public interface is tofgraph/*.py.
#include "config/json_text.hpp"
#include "python/arrays.hpp"
#include "python/run.hpp"
#include "python/stage.hpp"

#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <memory>

namespace tofgraph::python {
namespace {

/// Converts the errors to {text, mistakes: [{file, line, column, severity, message, hint}]} for ConfigurationError.
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
    throw;  // KeyError, TypeError, ..: converted by pybind11
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
  module.def("type_of", [](const py::object& dtype) { return type_of(py::dtype::from_args(dtype)); });
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
    const Inside inside;
    const py::gil_scoped_release unlocked;
    static_cast<void>(build(description, warnings));
    return warnings;
  });
  py::class_<Run, std::shared_ptr<Run>>(module, "Run")
      .def(py::init([](const Description& description, const std::string& node, bool keep_frames, std::uint64_t frames,
                       unsigned threads, std::size_t capacity) {
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
             py::call_guard<Inside, py::gil_scoped_release>());
  module.def("stages", &stages, py::arg("plugin_folders"), py::call_guard<Inside, py::gil_scoped_release>());
}
