// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Reference pages, schemas and type stubs, generated from the declarations of commands and plugins.
#include "cli/manual.hpp"
#include "config/json_text.hpp"
#include "config/paths.hpp"
#include "config/quantity.hpp"
#include "io/output_file.hpp"
#include "io/profile.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* made_note = "<!-- Made from the declarations by `tofgraph manual`; do not edit. -->\n";

std::string text_at(const json& object, const char* key) {
  return object.contains(key) && object[key].is_string() ? object[key].get<std::string>() : "";
}

/// Escapes text for a table cell.
std::string table_cell(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '|' ? "\\|" : c == '\n' ? " " : std::string(1, c);
  return result;
}

/// Built-in plugins of a kind, by name.
std::vector<json> plugins_of(const std::string& kind) {
  const graph::PluginRegistry registry({config::plugin_folder()});
  std::vector<graph::PluginFile> files;
  std::ranges::copy_if(registry.files(), std::back_inserter(files), [&](const auto& f) { return f.kind == kind; });
  const auto described = registry.describe(files);
  std::vector<json> plugins;
  for (const graph::PluginFile& file : files) plugins.push_back(described.at(file.path.string()));
  return plugins;
}

std::string range_text(const json& p) {
  const auto shown = [&](const char* key) {
    return p[key].is_null() ? std::string() : config::format_quantity(p[key].get<double>(), text_at(p, "unit"));
  };
  const std::string low = shown("minimum"), high = shown("maximum");
  if (low.empty() && high.empty()) return "";
  return low.empty() ? "at most " + high : high.empty() ? "at least " + low : low + " to " + high;
}

std::string parameters_table(const json& plugin) {
  if (plugin["parameters"].empty()) return "";
  std::string text = "\n| parameter | type | unit | range | default | |\n| --- | --- | --- | --- | --- | --- |\n";
  for (const json& p : plugin["parameters"]) {
    const bool required = p["required"].get<bool>();
    std::string about = text_at(p, "text");
    if (p.contains("off")) about += fmt::format("; off at {}", config::format_quantity(p["off"], text_at(p, "unit")));
    if (p.contains("typical"))
      about += fmt::format("; typically {}", config::format_quantity(p["typical"], text_at(p, "unit")));
    text +=
        fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", text_at(p, "name"),
                    table_cell(text_at(p, "type") + (p.contains("choices") ? " (" + text_at(p, "choices") + ")" : "")),
                    table_cell(text_at(p, "unit")), range_text(p),
                    required ? "required" : table_cell(text_at(p, "default")), table_cell(about));
  }
  return text;
}

std::string ports_table(const json& plugin) {
  if (plugin["ports"].empty()) return "";
  std::string text = "\n| | channel | type, shape, unit | |\n| --- | --- | --- | --- |\n";
  for (const json& port : plugin["ports"]) {
    const std::string direction = text_at(port, "direction");
    text += fmt::format(
        "| {} | `{}` | {} | {}{} |\n",
        direction == "in"    ? "reads"
        : direction == "out" ? "makes"
                             : "changes",
        table_cell(text_at(port, "channel")),
        table_cell(fmt::format("{} [{}] {}", text_at(port, "type"), text_at(port, "shape"), text_at(port, "unit"))),
        port["optional"].get<bool>() ? "optional; " : "", table_cell(text_at(port, "text")));
  }
  return text;
}

std::string page_of(const std::string& kind, const std::string& title) {
  std::string text = fmt::format("{}# {}\n", made_note, title);
  for (const json& plugin : plugins_of(kind)) {
    if (plugin.contains("error")) throw std::runtime_error(plugin["error"].get<std::string>());
    text += fmt::format("\n## {}\n\n{}.\n", text_at(plugin, "name"), text_at(plugin, "summary"));
    if (plugin.contains("level"))
      text += fmt::format(
          "\nActs on the {}; belongs to the {}; touches {}.{}{}\n", text_at(plugin, "level"),
          text_at(plugin, "belongs_to"), text_at(plugin, "touches"),
          text_at(plugin, "confused_with").empty() ? "" : " Confused with: " + text_at(plugin, "confused_with") + ".",
          text_at(plugin, "experiment").empty() ? "" : " Separated by: " + text_at(plugin, "experiment") + ".");
    if (plugin.contains("endings")) text += fmt::format("\nUsual endings: {}.\n", text_at(plugin, "endings"));
    text += ports_table(plugin) + parameters_table(plugin);
  }
  return text;
}

std::string options_table(const CLI::App& command) {
  std::string text;
  for (const CLI::Option* option : shown_options(command)) {
    if (option == command.get_help_ptr()) continue;
    text += fmt::format("| `{}` | {}{} |\n", table_cell(option_words(*option)), table_cell(option->get_description()),
                        option->get_required() ? " (required)" : "");
  }
  return text.empty() ? "" : "\n| option | |\n| --- | --- |\n" + text;
}

std::string commands_page(const CLI::App& app) {
  std::string text = fmt::format("{}# Commands\n\n{}\n", made_note, app.get_description());
  text += options_table(app);
  const auto add = [&](const std::string& name, const CLI::App& command) {
    text += fmt::format("\n## tofgraph {}\n\n{}.\n{}", name, command.get_description(), options_table(command));
    if (!command.get_footer().empty()) text += fmt::format("\n```\n{}\n```\n", command.get_footer());
  };
  for (const CLI::App* command : shown_commands(app)) {
    add(command->get_name(), *command);
    for (const CLI::App* sub : shown_commands(*command)) add(command->get_name() + " " + sub->get_name(), *sub);
  }
  return text;
}

/// Schema of the values of a parameter.
json value_schema(const json& p) {
  const std::string type = text_at(p, "type"), unit = text_at(p, "unit");
  json schema = json::object();
  if (type == "bool") schema["type"] = {"boolean", "string"};
  if (type == "integer") schema["type"] = "integer";
  if (type == "number") schema["type"] = unit.empty() ? json{"number", "string"} : json("string");
  if (type == "choice") {
    std::vector<json> words;
    for (const std::string& one : graph::split_words(text_at(p, "choices"))) {
      const bool digits = std::ranges::all_of(one, [](unsigned char c) { return std::isdigit(c) != 0; });
      words.push_back(digits ? json(std::stoll(one)) : json(one));
    }
    schema["enum"] = words;
  }
  for (const auto& [key, bound] : {std::pair("minimum", "minimum"), std::pair("maximum", "maximum")})
    if (type == "integer" && !p[key].is_null()) schema[bound] = p[key];
  std::string about = text_at(p, "text");
  if (!unit.empty()) about += fmt::format(" [{}]", unit);
  if (const std::string range = range_text(p); !range.empty()) about += ", " + range;
  if (!p["default"].is_null()) about += fmt::format("; default {}", text_at(p, "default"));
  schema["description"] = about;
  return schema;
}

/// Parameters of the plugin named by `key`, in addition to the keys that every entry has.
json entry_schema(const json& plugin, const std::string& key, const json& always) {
  json properties = always, required = json::array({key});
  properties[key] = {{"const", plugin["name"]}};
  for (const json& p : plugin["parameters"]) {
    properties[text_at(p, "name")] = value_schema(p);
    if (p["required"].get<bool>()) required.push_back(p["name"]);
  }
  return {{"properties", properties}, {"required", required}, {"additionalProperties", false}};
}

json list_schema(const std::vector<json>& plugins, const std::string& key, const json& always) {
  json names = json::array(), rules = json::array();
  for (const json& plugin : plugins) {
    names.push_back({{"const", plugin["name"]}, {"description", plugin["summary"]}});
    rules.push_back({{"if", {{"properties", {{key, {{"const", plugin["name"]}}}}}, {"required", {key}}}},
                     {"then", entry_schema(plugin, key, always)}});
  }
  // Third-party plugins may have any name.
  return {
      {"type", "object"},
      {"properties", {{key, {{"anyOf", json::array({json{{"anyOf", names}}, json{{"type", {"string", "null"}}}})}}}}},
      {"required", {key}},
      {"allOf", rules}};
}

/// Python type of a parameter.
std::string python_type(const json& p) {
  const std::string type = text_at(p, "type");
  if (type == "bool") return "bool";
  if (type == "integer") return "int";
  if (type == "number") return text_at(p, "unit").empty() ? "float | str" : "str";
  if (type == "numbers") return "Sequence[float | str]";
  if (type == "input file" || type == "output file") return "str | PathLike[str]";
  if (type != "choice") return "Any";
  std::string words;
  const json schema = value_schema(p);
  for (const json& word : schema["enum"]) words += (words.empty() ? "" : ", ") + word.dump();
  return fmt::format("Literal[{}]", words);
}

/// Stage as a Python function of its parameters. Parameters named like Python keywords are left to `**more`.
std::string python_stub(const json& stage) {
  static constexpr std::string_view keywords[] = {"as", "from", "in", "is", "not", "with", "lambda", "class", "global"};
  std::string arguments, about;
  for (const json& p : stage["parameters"]) {
    const std::string name = text_at(p, "name");
    about += fmt::format("        @param {} {}\n", name, text_at(value_schema(p), "description"));
    if (std::ranges::find(keywords, name) == std::end(keywords))
      arguments += fmt::format(", {}: {}{}", name, python_type(p), p["required"].get<bool>() ? "" : " = ...");
  }
  return fmt::format(
      "    def {}(self, *, name: str = ...{}, **more: Any) -> Node:\n        \"\"\"{}.\n{}        \"\"\"\n",
      text_at(stage, "name"), arguments, text_at(stage, "summary"), about.empty() ? "" : "\n" + about);
}

/// Stages by kind and name.
std::vector<json> all_stages() {
  std::vector<json> stages;
  for (const char* kind : {"source", "filter", "sink"}) std::ranges::move(plugins_of(kind), std::back_inserter(stages));
  return stages;
}

}  // namespace

void write_stubs(const fs::path& folder) {
  fs::create_directories(folder);
  std::string text =
      "# SPDX-FileCopyrightText: 2026 The tofgraph authors\n# SPDX-License-Identifier: BSD-3-Clause\n"
      "# Made from the declarations by `tofgraph manual`; do not edit.\n"
      "\"\"\"Stages of the program's own plugins, as nodes of a pipeline. `more`: name, inputs, queue, "
      "overwrite.\"\"\"\n\n"
      "from os import PathLike\nfrom typing import Any, Callable, Literal, Sequence\n\nfrom ._pipeline import Node\n\n"
      "class Stages:\n";
  for (const json& stage : all_stages()) text += python_stub(stage);
  io::write_file(folder / "_stages.pyi", text +
                                             "    def __getattr__(self, name: str) -> Callable[..., Node]:\n"
                                             "        \"\"\"Returns a stage of another plugin.\"\"\"\n\n"
                                             "stage: Stages\n");
}

void write_reference(const CLI::App& app, const fs::path& folder) {
  fs::create_directories(folder);
  io::write_file(folder / "commands.md", commands_page(app));
  for (const auto& [kind, title] :
       {std::pair("source", "Sources"), std::pair("filter", "Filters"), std::pair("sink", "Sinks"),
        std::pair("effect", "Effects"), std::pair("format", "File formats")})
    io::write_file(folder / fmt::format("{}s.md", kind), page_of(kind, title));
}

void write_schemas(const fs::path& folder) {
  fs::create_directories(folder);
  const auto write = [&](const char* file, const char* title, json schema) {
    schema["$schema"] = "http://json-schema.org/draft-07/schema#";
    schema["title"] = title;
    io::write_file(folder / file, config::json_text(schema, 1) + "\n");
  };
  const std::vector<json> stages = all_stages();
  const json of_nodes = {
      {"name", {{"type", "string"}, {"description", "default: the stage's name"}}},
      {"inputs", {{"description", "nodes whose frames arrive; default: the node above"}}},
      {"queue", {{"description", "{capacity: 4, policy: block or drop_oldest}, on a source"}}},
      {"overwrite", {{"type", {"boolean", "string"}}, {"description", "existing files may be replaced"}}}};
  write("pipeline.json", "Pipeline of tofgraph",
        {{"type", "object"},
         {"properties",
          {{"pipeline", {{"const", 1}}},
           {"name", {{"type", "string"}}},
           {"camera", {{"type", "string"}, {"description", "a profile by name, or a path to one"}}},
           {"nodes", {{"type", "array"}, {"items", list_schema(stages, "stage", of_nodes)}}}}},
         {"required", {"pipeline", "nodes"}},
         {"additionalProperties", false}});
  write("model.json", "Model of tofgraph: light and effects of a camera",
        {{"type", "object"},
         {"properties",
          {{"model", {{"const", 1}}},
           {"name", {{"description", "free text"}}},
           {"comment", {{"description", "free text"}}},
           {"camera", {{"type", "string"}, {"description", "the profile that it belongs to, by name or path"}}},
           {"serial", {{"type", {"string", "number"}}, {"description", "of the device that it belongs to"}}},
           {"light", {{"enum", {"reference", "physical"}}, {"description", "default reference"}}},
           {"effects", {{"type", "array"}, {"items", list_schema(plugins_of("effect"), "effect", json::object())}}}}},
         {"required", {"model"}},
         {"additionalProperties", false}});
}

void add_manual(CLI::App& app, Common& common) {
  auto what = std::make_shared<std::string>();
  auto folder = std::make_shared<std::filesystem::path>();
  CLI::App* command = app.add_subcommand("manual", "Write files that follow from the declarations");
  command->group("");  // for packages and the documentation
  command->add_option("WHAT", *what, "pages (man pages and completions), reference, schemas or stubs (of Python)")
      ->required();
  command->add_option("-o,--out", *folder, "The folder; files are replaced")->option_text("FOLDER")->required();
  command->callback([=, &app, &common] {
    common.command = [=, &app] {
      if (*what == "pages")
        write_manual(app, *folder);
      else if (*what == "reference")
        write_reference(app, *folder);
      else if (*what == "schemas")
        write_schemas(*folder);
      else if (*what == "stubs")
        write_stubs(*folder);
      else
        throw config::ConfigurationError("error: expected pages, reference, schemas or stubs");
      return done;
    };
  });
}

}  // namespace tofgraph::cli
