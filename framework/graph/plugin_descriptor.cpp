// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Reads the descriptor of a plugin: converts it to the host's struct sizes and checks the rules of the plugin
// interface, so that a defect is reported as the plugin's when it is loaded, not as the user's when it is used.
#include "config/quantity.hpp"
#include "graph/parameters.hpp"
#include "graph/plugin.hpp"
#include "graph/stream.hpp"
#include "io/border.hpp"

#include <fmt/format.h>

#include <tofgraph/array.hpp>

#include <cmath>
#include <limits>
#include <set>
#include <span>

namespace tofgraph::graph {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();
constexpr std::string_view reserved[] = {"name", "stage", "inputs", "queue", "overwrite", "effect"};

/// Reports a defect of the plugin itself; its users can only remove it.
class Inspection {
 public:
  explicit Inspection(const PluginFile& file) : file_(file) {}

  [[noreturn]] void refuse(const std::string& reason, const std::string& advice) const {
    throw PluginError(fmt::format("plugin {}: {}\n         {}", file_.path.string(), reason, advice));
  }
  [[noreturn]] void defect(const std::string& reason) const { refuse(reason, "this is a bug in the plugin"); }

  void not_null(const void* pointer, std::string_view what) const {
    if (pointer == nullptr) defect(fmt::format("its {} is null", what));
  }
  void need(bool right, const std::string& what) const {
    if (!right) defect(what);
  }

  /// Elements of an array, independent of their struct size.
  template <class T> std::vector<T> copied(const T* first, std::uint32_t bytes, std::uint64_t count,
                                           std::string_view what, const T& absent = {}) const {
    std::vector<T> all;
    if (count == 0) return all;
    not_null(first, fmt::format("array of {}", what));
    need(bytes >= io::first_size<T>,
         fmt::format("its {} have {} bytes each, expected at least {}", what, bytes, io::first_size<T>));
    need(bytes % 8 == 0 && bytes <= 4096, fmt::format("its {} have {} bytes each: is the size set?", what, bytes));
    need(count <= 4096, fmt::format("it has {} {}: is the count set?", count, what));
    for (const T& element : Strided<const T>{first, bytes, count})
      all.push_back(io::host_sized<T>(&element, bytes, absent));
    return all;
  }

 private:
  const PluginFile& file_;
};

void or_empty(std::initializer_list<const char**> texts) {
  for (const char** text : texts) {
    if (*text == nullptr) *text = "";
  }
}

bool is_unit(std::string_view unit) {
  const std::string one = unit.empty() ? "1" : fmt::format("1 {}", unit);
  const config::Quantity quantity = config::parse_quantity(one, unit);
  return quantity.ok() && quantity.value == 1;  // bounds and values are in this SI unit
}

/// Checks each alternative of "m|counts|1".
bool are_units(std::string_view units) {
  for (bool first = true; first || !units.empty(); first = false) {
    const std::string_view unit = units.substr(0, units.find('|'));
    units.remove_prefix(std::min(units.size(), unit.size() + 1));
    if (!is_unit(unit == "1" ? "" : unit)) return false;
  }
  return true;
}

bool is_shape_word(std::string_view word) {
  if (word == "H" || word == "W" || word == "N" || word == "P") return true;
  return !word.empty() && word.find_first_not_of("0123456789") == std::string_view::npos && word != "0";
}

void check_version(const Inspection& read, const tofgraph_descriptor& d) {
  if (d.api_major == TOFGRAPH_API_MAJOR && d.api_minor <= TOFGRAPH_API_MINOR) return;
  const bool newer = d.api_major >= TOFGRAPH_API_MAJOR;
  read.refuse(fmt::format("was built for plugin API {}.{}, this program has {}.{}", d.api_major, d.api_minor,
                          TOFGRAPH_API_MAJOR, TOFGRAPH_API_MINOR),
              newer ? "install a newer tofgraph, or build the plugin against this one"
                    : "rebuild the plugin against this tofgraph");
}

void check_calls(const Inspection& read, const PluginFile& file, const tofgraph_descriptor& d) {
  if (file.kind == "format") {
    read.need(d.port_count == 0 && d.parameter_count == 0, "it has ports or parameters, but a format has neither");
    return;
  }
  read.not_null(reinterpret_cast<const void*>(d.create), "create()");
  read.not_null(reinterpret_cast<const void*>(d.prepare), "prepare()");
  read.not_null(reinterpret_cast<const void*>(d.destroy), "destroy()");
  if (file.is_stage()) read.not_null(reinterpret_cast<const void*>(d.process), "process()");
}

void check_name(const Inspection& read, const PluginFile& file, const tofgraph_descriptor& d) {
  read.not_null(d.kind, "kind");
  read.not_null(d.name, "name");
  if (file.kind != d.kind || file.name != d.name)
    read.refuse(fmt::format("calls itself {} '{}'", d.kind, d.name),
                "name the file tofgraph_KIND_NAME.so after what is in it");
  constexpr std::uint32_t known = TOFGRAPH_STAGE_STATELESS | TOFGRAPH_STAGE_MANY_INPUTS | TOFGRAPH_STAGE_STEADY;
  read.need((d.flags & ~known) == 0, fmt::format("its flags are {}, which has unknown bits", d.flags));
  if ((d.flags & TOFGRAPH_STAGE_MANY_INPUTS) != 0 && file.kind != "sink") {
    read.refuse(fmt::format("is a {} that takes any number of streams: only a sink can, a {} has one frame to pass on",
                            d.kind, d.kind),
                "take one frame: process(Frame&); streams that belong together are joined with inputs: [a, b]");
  }
}

void check_port(const Inspection& read, const Plugin& plugin, tofgraph_port& port, std::set<std::string>& names) {
  read.not_null(port.name, "port's name");
  read.not_null(port.channel, fmt::format("channel of port '{}'", port.name));
  or_empty({&port.shape, &port.unit, &port.needs, &port.refuses, &port.from, &port.adds, &port.of, &port.text});
  const auto wrong = [&](const std::string& what) { read.defect(fmt::format("its port '{}' {}", port.name, what)); };
  if (*port.name == 0) wrong("has no name");
  if (*port.channel == 0) wrong("has no channel");
  if (is_alias(port.channel)) wrong(fmt::format("has the channel '{}', but @ is reserved for the host", port.channel));
  if (port.direction < TOFGRAPH_DIRECTION_IN || port.direction > TOFGRAPH_DIRECTION_INOUT)
    wrong(fmt::format("has the invalid direction {}", port.direction));
  if (port.type > TOFGRAPH_TYPE_I32) wrong(fmt::format("has the invalid element type {}", port.type));
  constexpr std::uint32_t known = TOFGRAPH_PORT_OPTIONAL | TOFGRAPH_PORT_EVERY;
  if ((port.flags & ~known) != 0) wrong(fmt::format("has the flags {}, some of which are unknown", port.flags));
  if ((std::string_view(port.channel) == "*") != ((port.flags & TOFGRAPH_PORT_EVERY) != 0))
    wrong("has the channel '*' without the flag EVERY, or the flag without it");
  if (!is_unit(port.unit)) wrong(fmt::format("has the invalid unit '{}'; SI is expected, e.g. m, counts", port.unit));
  const std::vector<std::string> shape = split_words(port.shape);
  if (shape.size() > 4 || !std::ranges::all_of(shape, is_shape_word))
    wrong(fmt::format("has the shape '{}', expected up to four of H, W, N, P and numbers, e.g. H W 3", port.shape));
  if (!names.insert(fmt::format("{} {}", port.direction == TOFGRAPH_DIRECTION_OUT ? "out" : "in", port.name)).second)
    wrong("is declared twice");
  if (plugin.file.kind == "source" && port.direction != TOFGRAPH_DIRECTION_OUT)
    wrong("reads a channel, but nothing arrives at a source");
  if (plugin.file.kind == "sink" && port.direction != TOFGRAPH_DIRECTION_IN)
    wrong("makes or changes a channel, but nothing leaves a sink");
  if (plugin.file.kind == "effect") wrong("is a port, but an effect has parameters only");
}

/// Checks the declaration of a parameter, except for its default.
void check_parameter(const Inspection& read, const Plugin& plugin, tofgraph_parameter& p,
                     std::set<std::string>& names) {
  read.not_null(p.name, "parameter's name");
  or_empty({&p.unit, &p.choices, &p.text});
  const auto wrong = [&](const std::string& what) { read.defect(fmt::format("its parameter '{}' {}", p.name, what)); };
  const std::string_view name = p.name;
  if (name.empty() || name.find_first_of(" .:=!{}[],#\"'\n\t") != std::string_view::npos)
    wrong("has a name that cannot be written as a key");
  if (std::ranges::find(reserved, name) != std::end(reserved)) wrong("has a name that is reserved: every node has it");
  if (!names.insert(p.name).second) wrong("is declared twice");
  const auto chooses = [](const tofgraph_port& port) { return alternatives(port).size() > 1; };
  if (name == "channel" && p.kind != TOFGRAPH_KIND_CHOICE && std::ranges::any_of(plugin.own_ports, chooses))
    wrong("chooses among the channels of a port, so it must be a choice");
  if (p.kind < TOFGRAPH_KIND_BOOL || p.kind > TOFGRAPH_KIND_IMAGE)
    wrong(fmt::format("has the invalid kind {}", p.kind));
  constexpr std::uint32_t known =
      TOFGRAPH_PARAMETER_REQUIRED | TOFGRAPH_PARAMETER_LIVE | TOFGRAPH_PARAMETER_IN_PLACE | TOFGRAPH_PARAMETER_NESTED;
  if ((p.flags & ~known) != 0) wrong(fmt::format("has the flags {}, some of which are unknown", p.flags));
  if ((p.flags & TOFGRAPH_PARAMETER_LIVE) != 0 && plugin.change == nullptr) wrong("may change, but change() is null");
  if ((p.flags & TOFGRAPH_PARAMETER_REQUIRED) != 0 && p.default_value != nullptr)
    wrong("is required and has a default");
  if (!are_units(p.unit)) wrong(fmt::format("has the invalid unit '{}'; SI is expected, e.g. m, s, rad, px", p.unit));
  if (p.minimum > p.maximum) wrong(fmt::format("has bounds of {} to {}", p.minimum, p.maximum));
  if (p.kind == TOFGRAPH_KIND_CHOICE && split_words(p.choices).empty()) wrong("is a choice but lists no choices");
  const auto outside = [&](double value) { return value < p.minimum || value > p.maximum; };
  if (outside(p.off)) wrong(fmt::format("is off at {}, which is outside its bounds", p.off));
  if ((p.flags & TOFGRAPH_PARAMETER_NESTED) != 0 && std::isnan(p.typical))
    wrong("is nested, so a search varies it, and has no typical value");
  if (p.typical == 0) wrong("is typically 0: a search has no step for it");
  if (outside(p.typical)) wrong(fmt::format("is typically {}, which is outside its bounds", p.typical));
}

/// Parses a default like a user's value.
void check_defaults(const Inspection& read, const Plugin& plugin) {
  config::Diagnostics diagnostics;
  Plugin optional;  // a required parameter has no default
  static_cast<tofgraph_descriptor&>(optional) = static_cast<const tofgraph_descriptor&>(plugin);
  optional.own_parameters = plugin.own_parameters;
  for (tofgraph_parameter& p : optional.own_parameters) p.flags = 0;
  optional.parameters = optional.own_parameters.data();
  const ParameterValues values(optional, {}, {}, diagnostics);
  if (diagnostics.ok()) return;
  const config::Diagnostic& first = diagnostics.all().front();
  read.defect(fmt::format("the default of a parameter cannot be used: {}{}", first.message,
                          first.hint.empty() ? "" : "; " + first.hint));
}

/// Copies version 1 of an extension's data. @param macro that exports it
template <class T> void read_extension(const Inspection& read, const tofgraph_descriptor& given, std::string_view name,
                                       std::string_view macro, T& own, const T*& pointer) {
  const tofgraph_extension absent{};
  for (const tofgraph_extension& extension :
       read.copied(given.extensions, given.extension_size, given.extension_count, "extensions", absent)) {
    read.not_null(extension.name, "extension's name");
    if (std::string_view(extension.name) != name || extension.version != 1) continue;
    read.not_null(extension.data, fmt::format("{}'s data", name));
    const auto* data = static_cast<const T*>(extension.data);
    read.need(data->size >= io::first_size<T>,
              fmt::format("its {} has {} bytes, expected at least {}", name, data->size, io::first_size<T>));
    own = io::host_sized(*data);
    pointer = &own;
  }
  if (pointer == nullptr)
    read.refuse(fmt::format("has no extension \"{}\" of version 1", name),
                fmt::format("end the file with {}(Class, \"text\")", macro));
}

void read_format(const Inspection& read, const tofgraph_descriptor& given, Plugin& plugin) {
  read_extension(read, given, "format", "TOFGRAPH_FORMAT", plugin.own_format, plugin.format);
  tofgraph_format& f = plugin.own_format;
  or_empty({&f.endings});
  read.not_null(reinterpret_cast<const void*>(f.recognises), "recognises()");
  read.not_null(reinterpret_cast<const void*>(f.open), "open()");
  read.not_null(reinterpret_cast<const void*>(f.read), "read()");
  read.not_null(reinterpret_cast<const void*>(f.close), "close()");
}

void read_effect(const Inspection& read, const tofgraph_descriptor& given, Plugin& plugin) {
  read_extension(read, given, "effect", "TOFGRAPH_EFFECT", plugin.own_effect, plugin.effect);
  tofgraph_effect& e = plugin.own_effect;
  read.not_null(reinterpret_cast<const void*>(e.apply), "apply()");
  read.not_null(e.touches, "effect's touches");
  or_empty({&e.confused_with, &e.experiment});
  read.need(e.level >= TOFGRAPH_LEVEL_GEOMETRY && e.level <= TOFGRAPH_LEVEL_TAPS,
            fmt::format("it acts on the invalid level {}", e.level));
  read.need(e.scope <= TOFGRAPH_SCOPE_SETUP, fmt::format("its scope {} is invalid", e.scope));
  constexpr std::uint32_t known = TOFGRAPH_EFFECT_LATE | TOFGRAPH_EFFECT_IMAGE;
  read.need((e.flags & ~known) == 0, fmt::format("its effect has the flags {}, some of which are unknown", e.flags));
  constexpr std::string_view observables[] = {"distance", "amplitude", "intensity", "null1", "null2", "variance"};
  for (const std::string& word : split_words(e.touches))
    read.need(std::ranges::find(observables, word) != std::end(observables),
              fmt::format("it touches '{}', expected distance, amplitude, intensity, null1, null2, variance", word));
}

}  // namespace

void read_descriptor(const tofgraph_descriptor* given, Plugin& plugin) {
  const Inspection read(plugin.file);
  if (given == nullptr)
    read.refuse("its tofgraph_plugin() returned no descriptor",
                "build it with TOFGRAPH_STAGE, TOFGRAPH_EFFECT or TOFGRAPH_FORMAT");
  check_version(read, *given);
  read.need(given->size >= io::first_size<tofgraph_descriptor>,
            fmt::format("its descriptor has {} bytes, expected at least {}", given->size,
                        io::first_size<tofgraph_descriptor>));
  static_cast<tofgraph_descriptor&>(plugin) = io::host_sized(*given);
  check_name(read, plugin.file, plugin);
  read.not_null(plugin.summary, "summary");
  read.not_null(plugin.version, "version");
  or_empty({&plugin.author, &plugin.licence});
  check_calls(read, plugin.file, plugin);

  plugin.own_ports = read.copied(given->ports, given->port_size, given->port_count, "ports");
  tofgraph_parameter absent{};
  absent.minimum = absent.maximum = absent.off = absent.typical = none;
  plugin.own_parameters =
      read.copied(given->parameters, given->parameter_size, given->parameter_count, "parameters", absent);
  std::set<std::string> names;
  for (tofgraph_port& port : plugin.own_ports) check_port(read, plugin, port, names);
  names.clear();
  for (tofgraph_parameter& parameter : plugin.own_parameters) check_parameter(read, plugin, parameter, names);
  plugin.ports = plugin.own_ports.data();
  plugin.parameters = plugin.own_parameters.data();
  plugin.port_size = sizeof(tofgraph_port);
  plugin.parameter_size = sizeof(tofgraph_parameter);
  plugin.extensions = nullptr;  // the known ones are in `effect`
  plugin.extension_count = 0;
  if (plugin.file.kind == "effect") read_effect(read, *given, plugin);
  if (plugin.file.kind == "format") read_format(read, *given, plugin);
  check_defaults(read, plugin);
}

}  // namespace tofgraph::graph
