// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "python/stage.hpp"

#include "graph/instance.hpp"
#include "python/arrays.hpp"
#include "python/run_lock.hpp"

#include <tofgraph/array.hpp>
#include <tofgraph/channels.hpp>

#include <pybind11/stl.h>

#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

namespace tofgraph::python {
namespace {

struct ClassPlugin : graph::Plugin {
  py::object stage_class;
  std::deque<std::string> texts;  ///< strings referenced by the declaration

  const char* text(const py::handle& value) { return texts.emplace_back(py::str(value).cast<std::string>()).c_str(); }
  const char* text(const py::dict& from, const char* key, const char* otherwise = "") {
    return from.contains(key) && !from[key].is_none() ? text(from[key]) : otherwise;
  }
};

/// Instance of a stage.
struct Working {
  py::object self;
  const tofgraph_host* host;
  void* context;
  Outputs outputs;
};

/// Channels of a plugin's output ports.
Outputs outputs_of(const graph::Plugin& plugin) {
  Outputs outputs;
  for (const tofgraph_port& port : plugin.own_ports) {
    if (port.direction == TOFGRAPH_DIRECTION_OUT) outputs[port.channel] = port.unit;
    if (port.direction != TOFGRAPH_DIRECTION_INOUT) continue;
    std::istringstream alternatives(port.channel);
    for (std::string channel; std::getline(alternatives, channel, '|');) outputs[channel] = std::nullopt;
  }
  return outputs;
}

/// Formats an exception as "ValueError: text (file.py, line 12)".
std::string described(const py::error_already_set& error) {
  std::string text =
      py::str(error.type().attr("__name__")).cast<std::string>() + ": " + py::str(error.value()).cast<std::string>();
  py::object trace = error.trace();
  if (!trace || trace.is_none()) return text;
  while (!trace.attr("tb_next").is_none()) trace = trace.attr("tb_next");
  const auto file = trace.attr("tb_frame").attr("f_code").attr("co_filename").cast<std::string>();
  return text + " (" + file + ", line " + std::to_string(trace.attr("tb_lineno").cast<int>()) + ")";
}

/// Calls a function under the GIL; an exception becomes the call's failure.
template <class Call> int guarded(const tofgraph_host* host, void* context, Call&& call) {
  const RunLock lock;
  try {
    return call();
  } catch (py::error_already_set& error) {
    const bool names_one =
        py::isinstance(error.value(), py::module_::import("tofgraph._errors").attr("ParameterError"));
    const std::string parameter = names_one ? py::str(error.value().attr("parameter")).cast<std::string>() : "";
    const std::string text = names_one ? py::str(error.value()).cast<std::string>() : described(error);
    host->fail(context, names_one ? parameter.c_str() : nullptr, text.c_str());
  } catch (const std::exception& error) {
    host->fail(context, nullptr, error.what());
  }
  return TOFGRAPH_STATUS_ERROR;
}

py::object value_of(const tofgraph_parameter& parameter, const tofgraph_value& value) {
  switch (parameter.kind) {
    case TOFGRAPH_KIND_BOOL:
      return py::bool_(value.integer != 0);
    case TOFGRAPH_KIND_INTEGER:
      return py::int_(value.integer);
    case TOFGRAPH_KIND_NUMBER:
      return py::float_(value.number);
    case TOFGRAPH_KIND_NUMBERS:
      return py::cast(std::vector<double>(value.numbers, value.numbers + value.count));
    default:
      return py::str(value.text);
  }
}

int create(const tofgraph_host* host, void* context, const tofgraph_value* values, void** self) {
  return guarded(host, context, [&] {
    const auto& plugin = static_cast<const ClassPlugin&>(static_cast<const graph::Instance*>(context)->plugin());
    auto made = std::make_unique<Working>(Working{plugin.stage_class(), host, context, outputs_of(plugin)});
    const std::size_t stride = plugin.parameter_count != 0 ? values->size : 0;
    const Strided<const tofgraph_value> given{values, stride, plugin.parameter_count};
    for (std::size_t i = 0; i < plugin.parameter_count; ++i) {
      const tofgraph_parameter& parameter = plugin.own_parameters[i];
      const bool unset = given[i].given == 0 && parameter.default_value == nullptr;
      py::setattr(made->self, parameter.name, unset ? py::object(py::none()) : value_of(parameter, given[i]));
    }
    *self = made.release();
    return TOFGRAPH_STATUS_OK;
  });
}

py::dict described(const tofgraph_channel& channel) {
  py::dict result;
  result["name"] = channel.name;
  result["dtype"] = channel.type == TOFGRAPH_TYPE_ANY ? py::object(py::none()) : py::object(dtype_of(channel.type));
  result["shape"] = std::vector<std::uint64_t>(channel.extent, channel.extent + channel.rank);
  result["unit"] = channel.unit;
  return result;
}

py::object described(const tofgraph_camera* camera) {
  if (camera == nullptr) return py::none();
  py::dict result;
  result["name"] = camera->name;
  result["width"] = camera->width;
  result["height"] = camera->height;
  result["focal_length"] = camera->focal_length;
  result["focal_px"] = py::make_tuple(camera->focal_px[0], camera->focal_px[1]);
  result["principal_point"] = py::make_tuple(camera->principal_point[0], camera->principal_point[1]);
  result["modulation_frequency"] = camera->modulation_frequency;
  result["rays"] = py::array_t<float>(
      {static_cast<py::ssize_t>(camera->height), static_cast<py::ssize_t>(camera->width), py::ssize_t{3}},
      camera->rays);
  return result;
}

/// Input and declarations of a stage before the first frame.
class PythonSetup {
 public:
  PythonSetup(Working& stage, const tofgraph_stream& stream) : stage_(&stage), stream_(&stream) {}
  void end() { stream_ = nullptr; }
  const tofgraph_stream& stream() const {
    if (stream_ == nullptr) throw std::runtime_error("the setup is valid only until prepare() returns");
    return *stream_;
  }
  py::object camera() const { return described(stream().camera); }
  py::list channels() const {
    py::list result;
    const Strided<const tofgraph_channel> all{stream().channels, stream().channel_size, stream().channel_count};
    for (std::size_t i = 0; i < all.size; ++i) result.append(described(all[i]));
    return result;
  }
  std::uint64_t frames() const { return stream().frames; }
  void provide(const std::string& name, const py::object& dtype, const std::vector<std::uint64_t>& shape,
               const std::optional<std::string>& given_unit) const {
    static_cast<void>(stream());
    const std::string unit = given_unit.value_or(unit_of(name));
    tofgraph_channel channel{};
    channel.size = sizeof channel;
    channel.name = name.c_str();
    channel.unit = unit.c_str();
    channel.of = channel.applied = channel.from = "";
    if (dtype.is_none()) throw py::type_error("channel '" + name + "' needs a dtype, e.g. numpy.float32");
    channel.type = type_of(py::dtype::from_args(dtype));
    if (shape.empty() || shape.size() > 4) throw py::value_error("a channel has one to four dimensions");
    channel.rank = static_cast<std::uint32_t>(shape.size());
    std::ranges::copy(shape, channel.extent);
    stage_->host->provide(stage_->context, &channel);
    stage_->outputs[name] = unit;
  }
  void use_profile(const std::string& name) const {
    static_cast<void>(stream());
    if (stage_->host->use_profile(stage_->context, name.c_str(), nullptr) != TOFGRAPH_STATUS_OK)
      throw py::value_error("there is no camera profile '" + name + "'");
  }
  void set_frames(std::uint64_t frames, const std::vector<std::string>& known) const {
    static_cast<void>(stream());
    stage_->host->set_frames(stage_->context, frames, metadata_bits(known));
  }

 private:
  Working* stage_;
  const tofgraph_stream* stream_;
};

/// Invalidates an object lent for a call, also if the call raised: Python may have kept a reference.
template <class T> class Ending {
 public:
  explicit Ending(T& lent) : lent_(lent) {}
  ~Ending() { lent_.end(); }
  Ending(const Ending&) = delete;
  Ending& operator=(const Ending&) = delete;

 private:
  T& lent_;
};

Working& working(void* self) { return *static_cast<Working*>(self); }

int prepare(void* self, const tofgraph_stream* const* streams, std::uint64_t /*count*/) {
  Working& stage = working(self);
  return guarded(stage.host, stage.context, [&] {
    if (!py::hasattr(stage.self, "prepare")) return TOFGRAPH_STATUS_OK + 0;
    const py::object setup = py::cast(PythonSetup(stage, **streams));
    const Ending end(setup.cast<PythonSetup&>());
    stage.self.attr("prepare")(setup);
    return TOFGRAPH_STATUS_OK + 0;
  });
}

int process(void* self, tofgraph_frame* const* frames, std::uint64_t /*count*/) {
  Working& stage = working(self);
  return guarded(stage.host, stage.context, [&] {
    const py::object frame = py::cast(StageFrame(*frames, stage.outputs));
    const Ending end(frame.cast<StageFrame&>());
    const py::object result = stage.self.attr("process")(frame);
    if (result.is_none()) return TOFGRAPH_STATUS_OK + 0;
    if (!py::isinstance<py::bool_>(result) && !py::isinstance(result, py::module_::import("numpy").attr("bool_")))
      throw py::type_error("process() returns True, False or nothing, not " +
                           py::str(py::type::of(result).attr("__name__")).cast<std::string>());
    return result.cast<bool>() ? TOFGRAPH_STATUS_OK + 0 : TOFGRAPH_STATUS_END + 0;
  });
}

int finish(void* self) {
  Working& stage = working(self);
  return guarded(stage.host, stage.context, [&] {
    if (py::hasattr(stage.self, "finish")) stage.self.attr("finish")();
    return TOFGRAPH_STATUS_OK + 0;
  });
}

void destroy(void* self) {
  if (Py_IsInitialized() == 0) return;  // the interpreter has ended and freed the object
  const RunLock lock;
  delete static_cast<Working*>(self);
}

std::vector<tofgraph_port> ports_of(ClassPlugin& plugin, const py::list& declared) {
  std::vector<tofgraph_port> ports;
  for (const py::handle item : declared) {
    const auto port = py::reinterpret_borrow<py::dict>(item);
    tofgraph_port& made = ports.emplace_back(tofgraph_port{});
    made.channel = plugin.text(port, "channel");
    made.name = plugin.text(port, "name", made.channel);
    const std::string first = std::string(made.channel).substr(0, std::string_view(made.channel).find('|'));
    const ChannelInfo* known = known_channel(first);
    made.shape = plugin.text(port, "shape", known != nullptr ? known->shape : "");
    made.unit = plugin.text(port, "unit", known != nullptr ? known->unit : "");
    made.text = plugin.text(port, "text", known != nullptr ? known->text : "");
    if (!port["dtype"].is_none())
      made.type = port["dtype"].cast<std::uint32_t>();
    else
      made.type = known != nullptr ? known->type : TOFGRAPH_TYPE_ANY + 0U;
    made.direction = port["direction"].cast<std::uint32_t>();
    made.flags = (port["optional"].cast<bool>() ? TOFGRAPH_PORT_OPTIONAL + 0U : 0U) |
                 (std::string_view(made.channel) == "*" ? TOFGRAPH_PORT_EVERY + 0U : 0U);
    made.needs = plugin.text(port, "needs");
    made.refuses = plugin.text(port, "refuses");
    made.adds = plugin.text(port, "adds");
    made.from = made.of = "";
  }
  return ports;
}

std::vector<tofgraph_parameter> parameters_of(ClassPlugin& plugin, const py::list& declared) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  std::vector<tofgraph_parameter> parameters;
  for (const py::handle item : declared) {
    const auto parameter = py::reinterpret_borrow<py::dict>(item);
    tofgraph_parameter& made = parameters.emplace_back(tofgraph_parameter{});
    made.name = plugin.text(parameter, "name");
    made.kind = parameter["kind"].cast<std::uint32_t>();
    made.flags = parameter["required"].cast<bool>() ? TOFGRAPH_PARAMETER_REQUIRED + 0U : 0U;
    made.unit = plugin.text(parameter, "unit");
    made.default_value = plugin.text(parameter, "default", nullptr);
    made.minimum = parameter["minimum"].is_none() ? none : parameter["minimum"].cast<double>();
    made.maximum = parameter["maximum"].is_none() ? none : parameter["maximum"].cast<double>();
    made.choices = plugin.text(parameter, "choices");
    made.text = plugin.text(parameter, "text");
    made.off = made.typical = none;
  }
  return parameters;
}

}  // namespace

const graph::Plugin& plugin_of(const py::object& stage_class, const py::dict& declaration) {
  auto plugin = std::make_unique<ClassPlugin>();
  plugin->stage_class = stage_class;
  plugin->hash = plugin->text(declaration, "hash");
  plugin->file = {plugin->text(declaration, "kind"), plugin->text(declaration, "name"),
                  plugin->text(declaration, "file")};
  const std::vector<tofgraph_port> ports = ports_of(*plugin, declaration["ports"]);
  const std::vector<tofgraph_parameter> parameters = parameters_of(*plugin, declaration["parameters"]);
  tofgraph_descriptor given{};
  given.size = sizeof given;
  given.api_major = TOFGRAPH_API_MAJOR;
  given.api_minor = TOFGRAPH_API_MINOR;
  given.kind = plugin->text(declaration, "kind");
  given.name = plugin->text(declaration, "name");
  given.summary = plugin->text(declaration, "summary");
  given.version = plugin->text(declaration, "version", "0");
  given.port_size = sizeof(tofgraph_port);
  given.parameter_size = sizeof(tofgraph_parameter);
  given.ports = ports.data();
  given.port_count = ports.size();
  given.parameters = parameters.data();
  given.parameter_count = parameters.size();
  given.create = create;
  given.prepare = prepare;
  given.process = process;
  given.finish = finish;
  given.destroy = destroy;
  graph::read_descriptor(&given, *plugin);
  return *plugin.release();
}

void add_setup(py::module_& module) {
  py::class_<PythonSetup> setup(module, "Setup", "Input and declarations of a stage before the first frame.");
  setup.def_property_readonly("camera", &PythonSetup::camera, "The camera as a dictionary, or None.");
  setup.def_property_readonly("channels", &PythonSetup::channels, "The channels that arrive, as dictionaries.");
  setup.def_property_readonly("frames", &PythonSetup::frames, "Number of frames that will come; 0: unknown.");
  setup.def("provide", &PythonSetup::provide, py::arg("name"), py::arg("dtype"), py::arg("shape"),
            py::arg("unit") = py::none(),
            "Announces a channel that no port declares. unit: by the table of channels unless given.");
  setup.def("use_profile", &PythonSetup::use_profile, py::arg("name"), "Sets the camera by the name of its profile.");
  setup.def("set_frames", &PythonSetup::set_frames, py::arg("frames"), py::arg("known") = std::vector<std::string>(),
            "States the number of frames that will come, and the metadata that each has, for sources.");
}

}  // namespace tofgraph::python
