// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// `tofgraph plugin new`: creates a folder with a plugin that builds, from the installed templates.
#include "cli/plugin.hpp"
#include "config/paths.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

/// Template file and the file created from it.
struct Copy {
  std::string from, to;
};

void check_plugin_name(const std::string& name, const Common& common) {
  const bool first = !name.empty() && name.front() >= 'a' && name.front() <= 'z';
  const bool word =
      std::ranges::all_of(name, [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; });
  constexpr const char* example = "example: tofgraph plugin new edge_mask --kind filter";
  if (!first || !word || name.size() > 60)
    throw config::ConfigurationError(
        fmt::format("error: '{}' cannot be a plugin's name: small letters, digits and _, a letter first\n         {}",
                    name, example));
  const graph::PluginRegistry registry(common.plugin_folders);
  if (const graph::PluginFile* other = registry.find(name))
    throw config::ConfigurationError(fmt::format("error: there is a {} '{}' already: {}\n         {}", other->kind,
                                                 name, other->path.string(), example));
}

/// "edge_mask" as EdgeMask.
std::string class_name(const std::string& name) {
  std::string result;
  bool start = true;
  for (const char c : name) {
    if (c != '_') result += start && c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c;
    start = c == '_';
  }
  return result;
}

std::string replaced(std::string text, std::string_view word, const std::string& by) {
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + by.size()))
    text.replace(at, word.size(), by);
  return text;
}

/// Text of a template for this plugin, without its licence header.
std::string filled(const fs::path& file, const std::vector<std::pair<std::string, std::string>>& words) {
  std::ifstream in(file);
  if (!in)
    throw std::runtime_error(
        fmt::format("the template {} is not there: the installation of tofgraph is incomplete", file.string()));
  std::string text;
  for (std::string line; std::getline(in, line);) {
    if (line.find("SPDX-") == std::string::npos) text += line + '\n';
  }
  for (const auto& [word, by] : words) text = replaced(std::move(text), word, by);
  return text;
}

std::vector<Copy> files_of(const NewPlugin& plugin, const std::string& source) {
  const std::string &kind = plugin.kind, &name = plugin.name;
  if (plugin.language == "python")
    return {{"python/" + kind + ".py", source},
            {"python/" + kind + "_test.py", "test_" + name + ".py"},
            {"project_python/readme.md", "README.md"},
            {"project_python/ci.yml", ".github/workflows/test.yml"}};
  return {{fmt::format("{}/{}.{}", plugin.language, kind, plugin.language == "c" ? "c" : "cpp"), source},
          {"test/" + kind + "_test.cpp", name + "_test.cpp"},
          {"project/CMakeLists.txt", "CMakeLists.txt"},
          {"project/readme.md", "README.md"},
          {"project/clang-format", ".clang-format"},
          {"project/ci.yml", ".github/workflows/test.yml"}};
}

}  // namespace

int new_plugin(const NewPlugin& plugin, const Common& common) {
  check_plugin_name(plugin.name, common);
  if (plugin.language == "python" && plugin.kind == "effect")
    throw config::ConfigurationError(
        "--language: error: an effect is evaluated for every ray, and is written in C++ or C\n         "
        "example: tofgraph plugin new ripple --kind effect --language c");
  const fs::path folder = plugin.folder.empty() ? fs::path(plugin.name) : fs::path(plugin.folder);
  std::error_code error;
  if (fs::exists(folder, error) && !(fs::is_directory(folder, error) && fs::is_empty(folder, error)))
    throw config::ConfigurationError(
        fmt::format("error: {} exists already, and nothing is overwritten\n         --out FOLDER takes another place",
                    folder.string()));
  const char* ending = plugin.language == "python" ? "py" : plugin.language == "c" ? "c" : "cpp";
  const std::string source = fmt::format("{}.{}", plugin.name, ending);
  const std::vector<std::pair<std::string, std::string>> words = {{"my_source", source},
                                                                  {"my_kind", plugin.kind},
                                                                  {"my_plugin", plugin.name},
                                                                  {"MyPlugin", class_name(plugin.name)}};
  for (const Copy& copy : files_of(plugin, source)) {
    const fs::path target = folder / copy.to;
    fs::create_directories(target.parent_path());
    io::write_file(target, filled(config::template_folder() / copy.from, words));
  }
  if (common.quiet) return done;
  const std::string build = plugin.language == "python"
                                ? "python3 -m unittest"
                                : "cmake -B build && cmake --build build && ctest --test-dir build";
  print_message(fmt::format("made {}\n  next: cd {} && {}", folder.string(), folder.string(), build));
  return done;
}

}  // namespace tofgraph::cli
