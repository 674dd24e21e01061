// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/files/camera_assembly.hpp"

#include "io/image_file.hpp"
#include "io/intrinsics_calibration.hpp"
#include "io/noise_calibration.hpp"
#include "io/offset_calibration.hpp"
#include "io/output_file.hpp"
#include "io/profile.hpp"
#include "io/serial.hpp"
#include "simulation/files/model.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <sys/stat.h>
#include <algorithm>
#include <set>

namespace tofgraph::simulation {
namespace {

namespace fs = std::filesystem;

constexpr const char* bad_pixel_dataset = "bad";

fs::path maps_beside(const fs::path& calibration) { return fs::path(calibration).replace_extension(".maps.h5"); }

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

/// Day of the file's last change, as 2026-11-26.
std::string date_of(const fs::path& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return {};
  return fmt::format("{:%Y-%m-%d}", fmt::gmtime(status.st_mtime));
}

/// A file to copy, and the text in its place where paths in it change.
struct FolderCopy {
  fs::path from, to;  ///< to: relative to the folder
  std::string text;   ///< empty: as it is
};

/// The paths of a value, absolute, that with_absolute_paths() has changed.
void collect_files(const config::Value& value, std::set<std::string>& files) {
  for (const config::Value& item : value.items) collect_files(item, files);
  for (const config::Entry& entry : value.entries) {
    if (entry.key != "camera" && entry.value.is_scalar() && entry.value.text.starts_with('/'))
      files.insert(entry.value.text);
    collect_files(entry.value, files);
  }
}

/// The same value with paths below `from` to the names in `names`.
config::Value with_paths(config::Value value, const std::map<std::string, std::string>& names) {
  for (config::Value& item : value.items) item = with_paths(std::move(item), names);
  for (config::Entry& entry : value.entries) {
    const auto name = names.find(entry.value.text);
    if (entry.value.is_scalar() && name != names.end())
      entry.value.text = name->second;
    else
      entry.value = with_paths(std::move(entry.value), names);
  }
  return value;
}

/// A model as a file, one effect a line. @param names of its files, by their absolute path
std::string model_text(const config::Value& head, const std::vector<config::Value>& effects, const std::string& camera,
                       const std::map<std::string, std::string>& names) {
  std::string text = fmt::format("model: 1\ncamera: {}\n", config::yaml_word(camera));
  for (const config::Entry& entry : head.entries)
    if (entry.key == "serial" || entry.key == "light" || entry.key == "name" || entry.key == "comment")
      text += fmt::format("{}: {}\n", entry.key, config::yaml_text(entry.value));
  text += effects.empty() ? "effects: []\n" : "effects:\n";
  for (const config::Value& effect : effects)
    text += fmt::format("  - {}\n", config::yaml_text(with_paths(effect, names)));
  return text;
}

class CalibrationCheck {
 public:
  CalibrationCheck(io::CameraPtr camera, const AddOptions& options, const graph::PluginRegistry& registry)
      : camera_(std::move(camera)), options_(options), registry_(registry) {}

  /// The entry of a file and what is to be copied. @throws config::ConfigurationError
  io::FolderEntry entry_of(const fs::path& file, std::vector<FolderCopy>& copies) const {
    const config::Value document = config::load_document(file);
    const std::string first = document.entries.empty() ? "" : document.entries.front().key;
    if (first != "model") config::refuse_other_kind(document, "calibration");
    io::FolderEntry entry;
    const auto word = [&](const char* key) {
      const config::Entry* found = document.find(key);
      return found != nullptr ? found->value.text : std::string();
    };
    entry.kind = first == "model" ? "model" : word("kind");
    entry.serial = word("serial");
    entry.date = options_.date.empty() ? date_of(file) : options_.date;
    entry.valid_until = options_.valid_until;
    entry.temperature = options_.temperature;
    if (entry.kind == "model")
      copy_model(file, entry.kind, entry, copies);
    else
      copy_calibration(file, document, entry, copies);
    return entry;
  }

 private:
  void copy_calibration(const fs::path& file, const config::Value& document, io::FolderEntry& entry,
                        std::vector<FolderCopy>& copies) const {
    check_values(file, document, entry.kind);
    add(file, entry.kind, "", entry, copies);
    if (const fs::path model = model_beside(file); is_file(model)) copy_model(model, entry.kind, entry, copies);
    const fs::path maps = maps_beside(file);
    if (!is_file(maps)) return;
    if (entry.kind == "noise") check_size(maps, bad_pixel_dataset);
    add(maps, entry.kind, "", entry, copies);
  }

  /// What stages and simulations will refuse, found now.
  void check_values(const fs::path& file, const config::Value& document, const std::string& kind) const {
    tofgraph_camera view = camera_->view();
    if (kind == "intrinsics") {
      io::read_intrinsics_calibration(file, view);
    } else if (kind == "noise") {
      io::read_noise_calibration(file, view.name);
    } else if (kind == "offset") {
      io::read_offset_calibration(file, view);
    } else {
      const config::Entry* name = document.find("camera");
      if (name == nullptr || name->value.text != view.name)
        refuse(name != nullptr ? name->value.at : document.at,
               fmt::format("the calibration is of another camera than '{}'", view.name));
    }
  }

  void check_size(const fs::path& maps, const std::string& dataset) const {
    const io::ImageFile image("bad_pixels", maps.string(), dataset, "", "");
    const tofgraph_view& view = image.view();
    const tofgraph_camera& camera = camera_->view();
    if (view.extent[0] == camera.height && view.extent[1] == camera.width) return;
    throw config::ConfigurationError(
        fmt::format("{}: error: the map is {} x {} px, the camera '{}' has {} x {} (width x height)\n", maps.string(),
                    view.extent[1], view.extent[0], camera.name, camera.width, camera.height));
  }

  [[noreturn]] static void refuse(const config::Position& at, const std::string& problem) {
    config::Diagnostics diagnostics;
    diagnostics.error(at, problem);
    throw config::ConfigurationError(diagnostics);
  }

  /// A model with the maps and tables that it names, which become its neighbours.
  void copy_model(const fs::path& file, const std::string& kind, io::FolderEntry& entry,
                  std::vector<FolderCopy>& copies) const {
    config::Diagnostics diagnostics;
    const Model model = load_model(file, registry_, diagnostics);
    if (diagnostics.ok() && !is_for(model, *camera_))
      diagnostics.error(model.camera_at, fmt::format("the model is for the camera '{}', the folder is of '{}'",
                                                     model.camera, camera_->view().name));
    make_effects(model, camera_->view(), diagnostics);  // maps of another size
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    const config::Value document = config::with_absolute_paths(config::load_document(file));
    std::set<std::string> files;
    collect_files(document, files);
    std::map<std::string, std::string> names;
    for (const std::string& named : files) names[named] = fs::path(named).filename().string();
    const config::Entry* effects = document.find("effects");
    add(file, kind,
        model_text(document, effects != nullptr ? effects->value.items : std::vector<config::Value>{},
                   camera_->view().name, names),
        entry, copies);
    for (const std::string& named : files) add(named, kind, "", entry, copies);
  }

  void add(const fs::path& file, const std::string& kind, std::string text, io::FolderEntry& entry,
           std::vector<FolderCopy>& copies) const {
    const fs::path to = fs::path(kind) / file.filename();
    const auto same = std::ranges::find(copies, to, &FolderCopy::to);
    if (same != copies.end() && same->from == fs::absolute(file)) return;  // named twice
    if (same != copies.end())
      throw config::ConfigurationError(
          fmt::format("{}: error: has the name of {}: rename one of them\n", file.string(), same->from.string()));
    entry.files.push_back({to, ""});
    copies.push_back({fs::absolute(file), to, std::move(text)});
  }

  io::CameraPtr camera_;
  const AddOptions& options_;
  const graph::PluginRegistry& registry_;
};

void copy_into(const io::CameraFolder& folder, const std::vector<FolderCopy>& copies) {
  for (const FolderCopy& copy : copies) {
    const fs::path to = folder.folder / copy.to;
    fs::create_directories(to.parent_path());
    if (!copy.text.empty())
      io::write_file(to, copy.text);
    else if (std::error_code error; !fs::equivalent(copy.from, to, error))
      fs::copy_file(copy.from, to, fs::copy_options::overwrite_existing);
  }
}

/// A document, one key a line.
std::string document_text(const config::Value& document) {
  std::string text;
  for (const config::Entry& entry : document.entries)
    text += fmt::format("{}: {}\n", entry.key, config::yaml_text(entry.value));
  return text;
}

void set_entry(config::Value& document, const std::string& key, const std::string& yaml) {
  std::erase_if(document.entries, [&](const config::Entry& entry) { return entry.key == key; });
  if (!yaml.empty()) document.entries.push_back({key, document.at, config::parse_document(key, yaml)});
}

/// Keys of the profile that calibrations have measured, added to its own.
void add_measured(config::Value& document, const std::vector<std::string>& keys) {
  std::vector<std::string> measured;
  if (const config::Entry* entry = document.find("measured"))
    for (const config::Value& item : entry->value.items) measured.push_back(item.text);
  for (const std::string& key : keys)
    if (std::ranges::find(measured, key) == measured.end()) measured.push_back(key);
  set_entry(document, "measured", fmt::format("[{}]", fmt::join(measured, ", ")));
}

/// The folder's profile: the copied one with the calibrated lens and noise, the bad pixels and the model.
std::string profile_of(const io::CameraFolder& folder, const io::Camera& base, bool with_model) {
  config::Value document = config::with_absolute_paths(config::load_document(folder.file_of("profile")));
  std::vector<std::string> measured;
  if (const fs::path lens = folder.file_of("intrinsics"); !lens.empty()) {
    tofgraph_camera view = base.view();
    io::read_intrinsics_calibration(lens, view);
    set_entry(document, "focal_length", fmt::format("[{} px, {} px]", view.focal_px[0], view.focal_px[1]));
    set_entry(document, "principal_point", fmt::format("[{}, {}]", view.principal_point[0], view.principal_point[1]));
    set_entry(document, "distortion", fmt::format("[{}]", fmt::join(view.distortion, ", ")));
    measured.insert(measured.end(), {"focal_length", "principal_point", "distortion"});
  }
  if (const fs::path noise = folder.file_of("noise"); !noise.empty()) {
    const physics::TapNoise tap = io::read_noise_calibration(noise, base.view().name).noise;
    set_entry(document, "read_noise", fmt::format("{} counts", tap.read_noise));
    set_entry(document, "shot_noise", fmt::format("{} counts", tap.shot_noise));
    measured.insert(measured.end(), {"read_noise", "shot_noise"});
    if (const fs::path maps = maps_beside(folder.find("noise")->files.front().file); is_file(folder.folder / maps))
      set_entry(document, "bad_pixels",
                fmt::format("{{file: {}, dataset: {}}}", config::yaml_word(maps.generic_string()), bad_pixel_dataset));
  }
  add_measured(document, measured);
  set_entry(document, "model", with_model ? io::folder_model_name : "");
  return document_text(document);
}

/// Removes files of entries that were replaced.
void remove_stale(const io::CameraFolder& before, const io::CameraFolder& now) {
  std::set<fs::path> kept;
  for (const io::FolderEntry& entry : now.entries)
    for (const io::FolderFile& file : entry.files) kept.insert(file.file);
  std::error_code error;
  for (const io::FolderEntry& entry : before.entries)
    for (const io::FolderFile& file : entry.files)
      if (!kept.contains(file.file)) fs::remove(before.folder / file.file, error);
}

/// @throws config::ConfigurationError where another device's calibration is added
void check_serial(io::CameraFolder& folder, const io::FolderEntry& entry, const fs::path& file,
                  const AddOptions& options, std::vector<std::string>& remarks) {
  const std::string problem = io::serial_problem(entry.serial, folder.serial, "the folder's other calibrations");
  if (folder.serial.empty()) folder.serial = entry.serial;
  if (problem.empty()) return;
  if (!options.other_serial)
    throw config::ConfigurationError(
        fmt::format("{}: error: {}\n         --other-serial adds it nevertheless\n", file.string(), problem));
  remarks.push_back(fmt::format("{} {}: it is added nevertheless", file.string(), problem));
}

}  // namespace

io::CameraFolder make_camera_folder(const fs::path& folder, const std::string& name, const io::Camera& profile,
                                    const std::string& serial, const graph::PluginRegistry& registry) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_empty(folder, error))
    throw config::ConfigurationError(fmt::format("{}: error: the folder exists and is not empty\n", folder.string()));
  io::CameraFolder made{.folder = fs::absolute(folder).lexically_normal(),
                        .name = name,
                        .serial = serial,
                        .entries = {},
                        .made = {},
                        .notes = {}};
  const fs::path to = fs::path("profile") / profile.file.filename();
  // The model is an entry of its own: a path to it would lead nowhere from here.
  config::Value document = config::with_absolute_paths(config::load_document(profile.file));
  const bool names_model = document.find("model") != nullptr;
  set_entry(document, "model", "");
  std::vector<FolderCopy> copies = {{profile.file, to, names_model ? document_text(document) : ""}};
  made.entries.push_back({.kind = "profile",
                          .files = {{to, ""}},
                          .serial = {},
                          .date = date_of(profile.file),
                          .valid_until = {},
                          .temperature = {}});
  copy_into(made, copies);
  made.entries.front().files.front() = io::hashed_file(made.folder, to);
  assemble_camera(made, registry);
  if (profile.view().model != nullptr) add_calibrations(made, {profile.view().model}, {}, registry);
  return made;
}

std::vector<std::string> add_calibrations(io::CameraFolder& folder, const std::vector<fs::path>& files,
                                          const AddOptions& options, const graph::PluginRegistry& registry) {
  const io::CameraPtr camera = io::load_profile(folder.file_of("profile"));
  const CalibrationCheck check(camera, options, registry);
  io::CameraFolder changed = folder;
  std::vector<std::string> remarks;
  std::vector<FolderCopy> copies;
  for (const fs::path& file : files) {
    io::FolderEntry entry = check.entry_of(file, copies);
    check_serial(changed, entry, file, options, remarks);
    const auto same = std::ranges::find(changed.entries, entry.kind, &io::FolderEntry::kind);
    if (same == changed.entries.end()) {
      changed.entries.push_back(std::move(entry));
      continue;
    }
    const std::string there = same->files.front().file.generic_string();
    if (!options.replace)
      throw config::ConfigurationError(fmt::format(
          "{}: error: the folder has a calibration of the kind {} already: {}{}{}\n         --force replaces it\n",
          file.string(), entry.kind, there, same->date.empty() ? "" : " of ", same->date));
    remarks.push_back(fmt::format("{} replaces {}", file.string(), there));
    *same = std::move(entry);
  }
  copy_into(changed, copies);
  for (io::FolderEntry& entry : changed.entries)
    for (io::FolderFile& file : entry.files)
      if (file.sha256.empty()) file = io::hashed_file(changed.folder, file.file);
  assemble_camera(changed, registry);
  remove_stale(folder, changed);
  folder = std::move(changed);
  return remarks;
}

void assemble_camera(io::CameraFolder& folder, const graph::PluginRegistry& registry) {
  const io::CameraPtr base = io::load_profile(folder.file_of("profile"));
  const JoinedModel joined = joined_model(folder, registry);
  const bool with_model = !joined.effects.empty();
  if (with_model) {
    std::map<std::string, std::string> names;
    for (const config::Value& effect : joined.effects) {
      std::set<std::string> files;
      collect_files(effect, files);
      for (const std::string& file : files)
        names[file] = fs::path(file).lexically_relative(folder.folder).generic_string();
    }
    const fs::path model = folder.file_of("model");
    const config::Value head = model.empty() ? config::Value{} : config::load_document(model);
    io::write_file(folder.folder / io::folder_model_name, model_text(head, joined.effects, base->view().name, names));
  }
  io::write_file(folder.folder / io::folder_profile_name, profile_of(folder, *base, with_model));
  io::load_profile(folder.folder / io::folder_profile_name);  // what was made can be read
  folder.notes = joined.notes;
  folder.made = {io::hashed_file(folder.folder, io::folder_profile_name)};
  if (with_model) folder.made.push_back(io::hashed_file(folder.folder, io::folder_model_name));
  io::write_camera_folder(folder);
}

}  // namespace tofgraph::simulation
