// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/commands.hpp"

#include "config/json_text.hpp"
#include "config/quantity.hpp"
#include "io/profile.hpp"
#include "simulation/files/camera_assembly.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdio>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct CameraArguments {
  std::string name, profile, folder, serial;  ///< arguments of `new`
  std::vector<std::string> calibrations;
  std::string date, valid_until, temperature;
  bool force = false, other_serial = false, as_json = false;
};

[[noreturn]] void refuse(const std::string& problem) { throw config::ConfigurationError(problem); }

/// Folder of an existing name or path.
fs::path existing_folder(const std::string& name) {
  fs::path folder = io::find_camera_folder(name, fs::current_path());
  if (!folder.empty()) return folder;
  const std::vector<std::string> names = io::camera_folder_names();
  refuse(fmt::format("error: there is no camera '{}' in {}\n         {}; tofgraph camera new {} --profile P makes one",
                     name, io::cameras_folder().string(),
                     names.empty() ? "there is none yet" : config::suggestion(name, names, "cameras"), name));
}

void check_name(const std::string& name) {
  const bool word = !name.empty() && name.front() != '.' && std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.';
  });
  if (!word || name.ends_with(".yaml"))
    refuse(
        fmt::format("error: '{}' cannot be a camera's name: letters, digits, _ and - are allowed\n         example: "
                    "tofgraph camera new lab7 --profile camcube2",
                    name));
  const std::vector<std::string> profiles = io::profile_names();
  if (std::ranges::find(profiles, name) != profiles.end())
    refuse(fmt::format("error: '{0}' is the name of a profile: choose another one for the device, e.g. {0}_1", name));
}

int new_camera(const CameraArguments& arguments, const Common& common) {
  check_name(arguments.name);
  const fs::path base = io::find_profile(arguments.profile, fs::current_path());
  if (base.empty())
    refuse(fmt::format("--profile: error: there is no camera profile '{}'\n         {} (or a path to a .yaml file)",
                       arguments.profile, config::suggestion(arguments.profile, io::profile_names(), "profiles")));
  const io::CameraPtr profile = io::load_profile(base);
  const fs::path folder = arguments.folder.empty() ? io::cameras_folder() / arguments.name : fs::path(arguments.folder);
  const io::CameraFolder made = simulation::make_camera_folder(folder, arguments.name, *profile, arguments.serial,
                                                               graph::PluginRegistry(common.plugin_folders));
  if (!common.quiet)
    print_message(fmt::format("made {}\n  in a pipeline: camera: {}", made.folder.string(),
                              arguments.folder.empty() ? arguments.name : made.folder.string()));
  return done;
}

/// Parses "15degC..35degC", K. @throws config::ConfigurationError
std::optional<std::array<double, 2>> temperature_range(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const std::size_t dots = text.find("..");
  std::array<config::Quantity, 2> ends;
  if (dots != std::string::npos)
    ends = {config::parse_quantity(text.substr(0, dots), "K"), config::parse_quantity(text.substr(dots + 2), "K")};
  if (dots == std::string::npos || !ends[0].ok() || !ends[1].ok() || !(ends[0].value < ends[1].value))
    refuse(fmt::format("--temperature: error: '{}' must be two temperatures, e.g. --temperature 15degC..35degC", text));
  return std::array<double, 2>{ends[0].value, ends[1].value};
}

std::string checked_date(const std::string& option, const std::string& text) {
  int year = 0;
  unsigned month = 0, day = 0;
  const bool read = text.size() == 10 && std::sscanf(text.c_str(), "%4d-%2u-%2u", &year, &month, &day) == 3;
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(month), std::chrono::day(day)};
  // Written again, so that blanks and signs are refused.
  if (!text.empty() && (!read || !date.ok() || fmt::format("{:04}-{:02}-{:02}", year, month, day) != text))
    refuse(fmt::format("{0}: error: '{1}' is not a date, e.g. {0} 2026-11-26", option, text));
  return text;
}

int add_to_camera(const CameraArguments& arguments, const Common& common) {
  io::CameraFolder folder = io::read_camera_folder(existing_folder(arguments.name));
  const simulation::AddOptions options{.replace = arguments.force,
                                       .other_serial = arguments.other_serial,
                                       .date = checked_date("--date", arguments.date),
                                       .valid_until = checked_date("--valid-until", arguments.valid_until),
                                       .temperature = temperature_range(arguments.temperature)};
  const std::vector<std::string> before = folder.notes;
  const std::vector<fs::path> files(arguments.calibrations.begin(), arguments.calibrations.end());
  const std::vector<std::string> remarks =
      simulation::add_calibrations(folder, files, options, graph::PluginRegistry(common.plugin_folders));
  if (common.quiet) return done;
  for (const std::string& remark : remarks) print_message("note: " + remark);
  for (const std::string& note : folder.notes)
    if (std::ranges::find(before, note) == before.end()) print_message("note: " + note);
  print_message(
      fmt::format("{} has {}", folder.folder.string(), config::counted(folder.entries.size() - 1, "calibration")));
  return done;
}

json entry_json(const io::FolderEntry& entry) {
  json files = json::array();
  for (const io::FolderFile& file : entry.files)
    files.push_back({{"file", file.file.generic_string()}, {"sha256", file.sha256}});
  json result = {{"kind", entry.kind},
                 {"serial", entry.serial},
                 {"date", entry.date},
                 {"valid_until", entry.valid_until},
                 {"files", std::move(files)}};
  if (entry.temperature) result["temperature"] = *entry.temperature;
  return result;
}

std::string entry_line(const io::FolderEntry& entry) {
  std::string line = fmt::format("{:16} {:12} {:10}  {}  {}", entry.kind, entry.serial.empty() ? "-" : entry.serial,
                                 entry.date.empty() ? "-" : entry.date, entry.files.front().sha256.substr(0, 12),
                                 entry.files.front().file.generic_string());
  if (!entry.valid_until.empty()) line += fmt::format(", until {}", entry.valid_until);
  if (entry.temperature)
    line +=
        fmt::format(", {:.4g} to {:.4g} degC", entry.temperature->at(0) - 273.15, entry.temperature->at(1) - 273.15);
  return line;
}

int show_camera(const CameraArguments& arguments, const Common&) {
  const io::CameraFolder folder = io::read_camera_folder(existing_folder(arguments.name));
  const std::vector<std::string> problems = io::folder_problems(folder);
  if (arguments.as_json) {
    json entries = json::array();
    for (const io::FolderEntry& entry : folder.entries) entries.push_back(entry_json(entry));
    const json shown = {{"name", folder.name}, {"serial", folder.serial}, {"folder", folder.folder.string()},
                        {"entries", entries},  {"notes", folder.notes},   {"problems", problems}};
    fmt::print("{}\n", config::json_text(shown, 2));
  } else {
    fmt::print("{}: {}{}{}\n{:16} {:12} {:10}  {:12}  file\n", folder.name, folder.folder.string(),
               folder.serial.empty() ? "" : ", serial ", folder.serial, "kind", "serial", "date", "SHA-256");
    for (const io::FolderEntry& entry : folder.entries) fmt::print("{}\n", entry_line(entry));
    for (const std::string& note : folder.notes) fmt::print("{}\n", note);
  }
  if (problems.empty()) return done;
  std::string text;
  for (const std::string& problem : problems) text += fmt::format("{}error: {}", text.empty() ? "" : "\n", problem);
  refuse(text);
}

using Action = int (*)(const CameraArguments&, const Common&);

CLI::App* add_action(CLI::App& command, const char* name, const char* text, const char* example, Action action,
                     const std::shared_ptr<CameraArguments>& arguments, Common& common) {
  CLI::App* sub = command.add_subcommand(name, text);
  sub->footer(std::string("Example: ") + example);
  sub->callback([arguments, action, &common] {
    common.command = [arguments, action, &common] { return action(*arguments, common); };
  });
  return sub;
}

}  // namespace

void add_camera(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<CameraArguments>();
  CLI::App* command = app.add_subcommand("camera", "Keep the profile and calibrations of one device in one folder");
  command->require_subcommand(1);
  command->footer(
      "The folder is $XDG_DATA_HOME/tofgraph/cameras/NAME, by default ~/.local/share/tofgraph/cameras/NAME, or that "
      "of\n"
      "`camera new --folder`. In a pipeline, campaign or scene, `camera: NAME`, or a path to the folder, takes all of "
      "it.\n"
      "Examples: tofgraph camera new lab7 --profile camcube2\n"
      "          tofgraph camera add lab7 lens.yaml noise.yaml pattern.yaml offset.yaml\n"
      "          tofgraph camera show lab7");
  CLI::App* make = add_action(*command, "new", "Make the folder of a device from a profile",
                              "tofgraph camera new lab7 --profile camcube2", new_camera, arguments, common);
  make->add_option("NAME", arguments->name, "The name of the device")->required();
  make->add_option("--profile", arguments->profile, "Camera profile by name or path; it is copied")
      ->option_text("P")
      ->required();
  make->add_option("--folder", arguments->folder, "The folder to make; default: see `camera --help`")
      ->option_text("FOLDER");
  make->add_option("--serial", arguments->serial, "Serial number; default: that of the first calibration")
      ->option_text("S");
  CLI::App* add =
      add_action(*command, "add", "Copy calibrations and models into the folder of a device",
                 "tofgraph camera add lab7 lens.yaml noise.yaml offset.yaml", add_to_camera, arguments, common);
  add->add_option("NAME", arguments->name, "The name of the device, or a path to its folder")->required();
  add->add_option("CALIBRATION", arguments->calibrations,
                  "Files of `calibrate`, and models of `diagnose` or by hand; none: make the profile and model again");
  add->add_flag("--force", arguments->force, "Replace calibrations of the same kind");
  add->add_flag("--other-serial", arguments->other_serial, "Add a calibration of another serial number, with a note");
  add->add_option("--date", arguments->date, "Their date; default: that of the files")->option_text("DATE");
  add->add_option("--valid-until", arguments->valid_until, "Later recordings use them with a warning")
      ->option_text("DATE");
  add->add_option("--temperature", arguments->temperature, "Recordings at others use them with a warning")
      ->option_text("FROM..TO");
  CLI::App* show = add_action(*command, "show", "List the folder of a device, and check its files",
                              "tofgraph camera show lab7", show_camera, arguments, common);
  show->add_option("NAME", arguments->name, "The name of the device, or a path to its folder")->required();
  show->add_flag("--json", arguments->as_json, "As JSON");
}

}  // namespace tofgraph::cli
