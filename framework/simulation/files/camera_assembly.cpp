// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/files/camera_assembly.hpp"

#include "io/intrinsics_calibration.hpp"
#include "io/noise_calibration.hpp"
#include "io/output_file.hpp"
#include "io/profile.hpp"
#include "io/response_calibration.hpp"
#include "io/serial.hpp"
#include "simulation/files/calibration_copies.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace tofgraph::simulation {
namespace {

namespace fs = std::filesystem;

/// Text of a document, one key per line.
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

/// Keys of the profile that were measured by calibrations, in addition to its own.
void add_measured(config::Value& document, const std::vector<std::string>& keys) {
  std::vector<std::string> measured;
  if (const config::Entry* entry = document.find("measured"))
    for (const config::Value& item : entry->value.items) measured.push_back(item.text);
  for (const std::string& key : keys)
    if (std::ranges::find(measured, key) == measured.end()) measured.push_back(key);
  set_entry(document, "measured", fmt::format("[{}]", fmt::join(measured, ", ")));
}

/// Profile of the folder: the copied one with the calibrated lens, noise and response, the bad pixels and the model.
std::string assembled_profile(const io::CameraFolder& folder, const io::Camera& base, bool with_model) {
  config::Value document = config::with_absolute_paths(config::load_document(folder.file_of("profile")));
  std::vector<std::string> measured;
  if (const fs::path lens = folder.file_of("intrinsics"); !lens.empty()) {
    tofgraph_camera view = base.view();
    io::read_intrinsics_calibration(lens, view);
    set_entry(document, "focal_length", fmt::format("[{} px, {} px]", view.focal_px[0], view.focal_px[1]));
    set_entry(document, "principal_point", fmt::format("[{}, {}]", view.principal_point[0], view.principal_point[1]));
    set_entry(document, "distortion", fmt::format("[{}]", fmt::join(io::distortion_of(view), ", ")));
    set_entry(document, "skew", fmt::format("{}", view.skew));
    const bool fisheye = view.lens_model == TOFGRAPH_LENS_FISHEYE;
    if (fisheye || document.find("lens") != nullptr) set_entry(document, "lens", fisheye ? "fisheye" : "opencv");
    measured.insert(measured.end(), {"focal_length", "principal_point", "distortion", "skew"});
  }
  if (const fs::path noise = folder.file_of("noise"); !noise.empty()) {
    const physics::TapNoise tap = io::read_noise_calibration(noise, base.view().name).noise;
    set_entry(document, "read_noise", fmt::format("{} counts", tap.read_noise));
    set_entry(document, "shot_noise", fmt::format("{} counts", tap.shot_noise));
    measured.insert(measured.end(), {"read_noise", "shot_noise"});
    if (const fs::path maps = maps_beside(folder.find("noise")->files.front().file); is_there(folder.folder / maps))
      set_entry(document, "bad_pixels",
                fmt::format("{{file: {}, dataset: {}}}", config::yaml_word(maps.generic_string()), bad_pixel_dataset));
  }
  if (const fs::path response = folder.file_of("response"); !response.empty()) {
    const io::ResponseCalibration light = io::read_response_calibration(response, base.view().name);
    set_entry(document, "contrast", fmt::format("{}", light.contrast));
    measured.emplace_back("contrast");
    if (std::isfinite(light.gain)) {
      set_entry(document, "gain", fmt::format("{} counts m^2/s", light.gain));
      measured.emplace_back("gain");
    }
  }
  add_measured(document, measured);
  set_entry(document, "model", with_model ? io::folder_model_name : "");
  // Paths are relative to the folder, so that it can be moved as a whole.
  std::set<std::string> files;
  collect_files(document, files);
  std::map<std::string, std::string> names;
  for (const std::string& file : files) names[file] = fs::path(file).lexically_relative(folder.folder).generic_string();
  return document_text(with_paths(document, names));
}

/// Backup of files in a folder, which are restored on destruction unless keep() was called.
class FilesBefore {
 public:
  /// @param changing relative to the folder @throws std::filesystem::filesystem_error
  FilesBefore(fs::path folder, const std::vector<fs::path>& changing) : folder_(std::move(folder)) {
    for (const fs::path& file : changing) {
      const bool there = is_there(folder_ / file);
      if (there) fs::copy_file(folder_ / file, copy_of(file), fs::copy_options::overwrite_existing);
      files_[file] = there;
    }
  }
  FilesBefore(const FilesBefore&) = delete;
  FilesBefore& operator=(const FilesBefore&) = delete;
  ~FilesBefore() {
    std::error_code error;
    for (const auto& [file, was_there] : files_) {
      if (kept_)
        fs::remove(copy_of(file), error);
      else if (was_there)
        fs::rename(copy_of(file), folder_ / file, error);
      else
        fs::remove(folder_ / file, error);
      // Removes the new folder of a calibration that was not added; non-empty folders remain.
      if (!kept_ && file.has_parent_path()) fs::remove((folder_ / file).parent_path(), error);
    }
  }
  void keep() { kept_ = true; }

 private:
  fs::path copy_of(const fs::path& file) const {
    fs::path copy = folder_ / file;
    return copy += ".before";
  }

  fs::path folder_;
  std::map<fs::path, bool> files_;  ///< relative; true if it existed
  bool kept_ = false;
};

/// Removes the files of replaced entries.
void remove_stale(const io::CameraFolder& before, const io::CameraFolder& now) {
  std::set<fs::path> kept;
  for (const io::FolderEntry& entry : now.entries)
    for (const io::FolderFile& file : entry.files) kept.insert(file.file);
  std::error_code error;
  for (const io::FolderEntry& entry : before.entries)
    for (const io::FolderFile& file : entry.files)
      if (!kept.contains(file.file)) fs::remove(before.folder / file.file, error);
}

/// @throws config::ConfigurationError for the calibration of another device
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
  // The model is a separate entry: a relative path to it would be invalid here.
  config::Value document = config::with_absolute_paths(config::load_document(profile.file));
  const bool names_model = document.find("model") != nullptr;
  set_entry(document, "model", "");
  std::set<std::string> files;
  collect_files(document, files);
  std::map<std::string, std::string> names;
  for (const std::string& file : files) names[file] = fs::path(file).filename().string();
  const bool other_paths = names_model || !files.empty();
  std::vector<FolderCopy> copies = {{profile.file, to, other_paths ? document_text(with_paths(document, names)) : ""}};
  std::vector<io::FolderFile> held = {{to, ""}};
  for (const auto& [file, name] : names) {
    held.push_back({fs::path("profile") / name, ""});
    copies.push_back({file, held.back().file, ""});
  }
  made.entries.push_back({.kind = "profile",
                          .files = std::move(held),
                          .serial = {},
                          .date = date_of(profile.file),
                          .valid_until = {},
                          .temperature = {}});
  try {
    copy_into(made, copies);
    for (io::FolderFile& file : made.entries.front().files) file = io::hashed_file(made.folder, file.file);
    assemble_camera(made, registry);
    if (profile.view().model != nullptr) add_calibrations(made, {profile.view().model}, {}, registry);
  } catch (...) {
    fs::remove_all(made.folder, error);  // it was empty or did not exist before
    throw;
  }
  return made;
}

std::vector<std::string> add_calibrations(io::CameraFolder& folder, const std::vector<fs::path>& files,
                                          const AddOptions& options, const graph::PluginRegistry& registry) {
  const io::CameraPtr camera = io::load_profile(folder.file_of("profile"));
  io::CameraFolder changed = folder;
  std::vector<std::string> remarks;
  std::vector<FolderCopy> copies;
  for (const fs::path& file : files) {
    io::FolderEntry entry = entry_of(file, *camera, options, registry, copies);
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
  std::vector<fs::path> changing = {io::folder_index_name, io::folder_profile_name, io::folder_model_name};
  for (const FolderCopy& copy : copies) changing.push_back(copy.to);
  FilesBefore before(changed.folder, changing);
  copy_into(changed, copies);
  for (io::FolderEntry& entry : changed.entries)
    for (io::FolderFile& file : entry.files)
      if (file.sha256.empty()) file = io::hashed_file(changed.folder, file.file);
  assemble_camera(changed, registry);
  before.keep();
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
  std::error_code error;
  if (!with_model) fs::remove(folder.folder / io::folder_model_name, error);
  io::write_file(folder.folder / io::folder_profile_name, assembled_profile(folder, *base, with_model));
  io::load_profile(folder.folder / io::folder_profile_name);  // verifies that the result can be read
  folder.notes = joined.notes;
  folder.made = {io::hashed_file(folder.folder, io::folder_profile_name)};
  if (with_model) folder.made.push_back(io::hashed_file(folder.folder, io::folder_model_name));
  io::write_camera_folder(folder);
}

}  // namespace tofgraph::simulation
