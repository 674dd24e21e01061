// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// `tofgraph plugin check`: runs each check in a process of its own, with a time limit.
#include "cli/plugin.hpp"
#include "config/child_process.hpp"
#include "config/json_text.hpp"
#include "config/paths.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* check_example = "example: tofgraph plugin check build/tofgraph_filter_edge_mask.so";

/// Working folder of one check, removed together with the plugin's files in it.
class Scratch {
 public:
  Scratch() {
    std::string pattern = (fs::temp_directory_path() / "tofgraph-check-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder can be made");
    path_ = pattern;
  }
  ~Scratch() {
    std::error_code error;
    fs::remove_all(path_, error);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

json checks_table() {
  const config::ChildResult child = config::run_child({config::checker()});
  json list = json::parse(child.output, nullptr, false);
  if (!child.ok() || !list.is_array()) throw std::runtime_error("the program of the checks does not work");
  return list;
}

std::string names_of(const json& checks) {
  std::vector<std::string> names;
  for (const json& check : checks) names.push_back(check["name"]);
  return fmt::format("{}", fmt::join(names, ", "));
}

bool is_check_for(const json& check, const std::string& kind) {
  return (" " + check["kinds"].get<std::string>() + " ").find(" " + kind + " ") != std::string::npos;
}

/// Message that a crash wrote to standard error, without the text before it; empty if there is none.
std::string crash_message(const std::string& errors) {
  const auto start = errors.find("tofgraph: error: ");
  if (start == std::string::npos) return {};
  const std::string text = errors.substr(start + 17);
  return text.substr(0, text.find('\n'));
}

/// Describes the end of a process that reported no result.
std::string how_child_ended(const config::ChildResult& child, const json& check) {
  if (child.overtime) return fmt::format("does not end within {} s", check["seconds"].get<int>());
  std::string crash = crash_message(child.errors);
  if (!crash.empty()) return crash;
  if (child.signal != 0) return fmt::format("crashed (signal {}, {})", child.signal, strsignal(child.signal));
  return fmt::format("ended the process (exit code {})", child.exit_code);
}

json run_check(const json& check, const CheckedPlugin& plugin, const fs::path& file) {
  const Scratch scratch;
  std::vector<std::string> command = {
      "/usr/bin/env", "-C",          scratch.path().string(),       config::checker().string(),
      file.string(),  check["name"], fmt::format("{}", plugin.seed)};
  command.insert(command.end(), plugin.settings.begin(), plugin.settings.end());
  const auto start = std::chrono::steady_clock::now();
  const config::ChildResult child =
      config::run_child(command, {.keep_errors = true, .limit = std::chrono::seconds(check["seconds"].get<int>())});
  json outcome = json::parse(child.output, nullptr, false);
  if (!child.ok() || !outcome.is_object()) outcome = {{"result", "failed"}, {"text", how_child_ended(child, check)}};
  outcome["name"] = check["name"];
  outcome["sentence"] = check["sentence"];
  outcome["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return outcome;
}

void print_outcome(const json& outcome) {
  const std::string result = outcome["result"], text = outcome["text"];
  const bool failed = result == "failed";
  fmt::print("{:8} {:12} {}\n", failed ? "FAILED" : result, outcome["name"].get<std::string>(),
             outcome["sentence"].get<std::string>());
  for (std::string rest = text; !rest.empty();) {
    const std::string line = rest.substr(0, rest.find('\n'));
    fmt::print("{:22}{}\n", "", line.substr(std::min(line.find_first_not_of(' '), line.size())));
    rest = rest.size() > line.size() ? rest.substr(line.size() + 1) : "";
  }
  std::fflush(stdout);
}

fs::path checked_file(const CheckedPlugin& plugin) {
  if (plugin.file.empty())
    throw config::ConfigurationError(fmt::format("error: FILE is missing\n         {}", check_example));
  fs::path file = fs::absolute(plugin.file);
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    throw config::ConfigurationError(
        fmt::format("error: there is no file {}\n         {}", plugin.file, check_example));
  if (graph::plugin_file(file).kind.empty())
    throw config::ConfigurationError(
        fmt::format("error: {}: a plugin must be called tofgraph_KIND_NAME.so (KIND: source, filter, sink, effect, "
                    "format)\n         {}",
                    plugin.file, check_example));
  for (const std::string& setting : plugin.settings)
    if (setting.find('=') == std::string::npos)
      throw config::ConfigurationError(
          fmt::format("--set: error: '{}' is not PARAMETER=VALUE, e.g. --set file=board.h5", setting));
  return file;
}

void print_checks(const json& checks, bool as_json) {
  if (as_json) {
    fmt::print("{}\n", config::json_text(checks, 2));
    return;
  }
  fmt::print("strictness  check\n");
  for (const json& check : checks)
    fmt::print("{:10}  {:12} {}\n", check["strictness"].get<int>(), check["name"].get<std::string>(),
               check["sentence"].get<std::string>());
}

}  // namespace

int check_plugin(const CheckedPlugin& plugin) {
  const json checks = checks_table();
  if (plugin.list) {
    print_checks(checks, plugin.as_json);
    return done;
  }
  const fs::path file = checked_file(plugin);
  const std::string kind = graph::plugin_file(file).kind;
  const auto named = std::ranges::find(checks, plugin.only, [](const json& c) { return c["name"].get<std::string>(); });
  if (!plugin.only.empty() && named == checks.end())
    throw config::ConfigurationError(
        fmt::format("--only: error: there is no check '{}'\n         checks: {}", plugin.only, names_of(checks)));
  if (!plugin.only.empty() && !is_check_for(*named, kind))
    throw config::ConfigurationError(fmt::format("--only: error: the check '{}' is for {}, not for a {}", plugin.only,
                                                 (*named)["kinds"].get<std::string>(), kind));
  json outcomes = json::array();
  std::map<std::string, int> counts;
  for (const json& check : checks) {
    const bool chosen =
        plugin.only.empty() ? check["strictness"].get<unsigned>() <= plugin.strictness : check["name"] == plugin.only;
    if (!chosen || !is_check_for(check, kind)) continue;
    outcomes.push_back(run_check(check, plugin, file));
    if (!plugin.as_json) print_outcome(outcomes.back());
    ++counts[outcomes.back()["result"]];
    if (check["name"] == "descriptor" && outcomes.back()["result"] == "failed") break;  // the plugin cannot be loaded
  }
  const int code = counts["failed"] != 0 ? failed : done;
  if (plugin.as_json)
    fmt::print("{}\n", config::json_text({{"format", "tofgraph-plugin-check"},
                                          {"version", 1},
                                          {"file", file.string()},
                                          {"strictness", plugin.strictness},
                                          {"seed", plugin.seed},
                                          {"checks", outcomes},
                                          {"failed", counts["failed"]},
                                          {"exit_code", code}},
                                         2));
  else
    fmt::print("{} passed, {} failed, {} skipped; strictness {}, seed {}, exit code {}\n", counts["passed"],
               counts["failed"], counts["skipped"], plugin.strictness, plugin.seed, code);
  return code;
}

}  // namespace tofgraph::cli
