// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/files/calibration_copies.hpp"

#include "io/image_file.hpp"
#include "io/intrinsics_calibration.hpp"
#include "io/noise_calibration.hpp"
#include "io/offset_calibration.hpp"
#include "io/output_file.hpp"
#include "io/response_calibration.hpp"
#include "simulation/files/model.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <sys/stat.h>
#include <algorithm>

namespace tofgraph::simulation {
namespace {

namespace fs = std::filesystem;

class CalibrationCheck {
 public:
  CalibrationCheck(const io::Camera& camera, const AddOptions& options, const graph::PluginRegistry& registry)
      : camera_(camera), options_(options), registry_(registry) {}

  /// Entry of a file; appends the files to copy. @throws config::ConfigurationError
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
    if (const fs::path model = model_beside(file); is_there(model)) copy_model(model, entry.kind, entry, copies);
    const fs::path maps = maps_beside(file);
    if (!is_there(maps)) return;
    if (entry.kind == "noise") check_size(maps, bad_pixel_dataset);
    add(maps, entry.kind, "", entry, copies);
  }

  /// Checks values that stages and simulations would reject later.
  void check_values(const fs::path& file, const config::Value& document, const std::string& kind) const {
    tofgraph_camera view = camera_.view();
    if (kind == "intrinsics") {
      io::read_intrinsics_calibration(file, view);
    } else if (kind == "noise") {
      io::read_noise_calibration(file, view.name);
    } else if (kind == "offset") {
      io::read_offset_calibration(file, view);
    } else if (kind == "response") {
      io::read_response_calibration(file, view.name);
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
    const tofgraph_camera& camera = camera_.view();
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

  /// Adds a model with the maps and tables that it names, which are copied beside it.
  void copy_model(const fs::path& file, const std::string& kind, io::FolderEntry& entry,
                  std::vector<FolderCopy>& copies) const {
    config::Diagnostics diagnostics;
    const Model model = load_model(file, registry_, diagnostics);
    if (diagnostics.ok() && !is_for(model, camera_))
      diagnostics.error(model.camera_at, fmt::format("the model is for the camera '{}', the folder is of '{}'",
                                                     model.camera, camera_.view().name));
    make_effects(model, camera_.view(), diagnostics);  // detects maps of the wrong size
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    const config::Value document = config::load_document(file);
    const config::Entry* list = document.find("effects");
    const config::Value effects = list != nullptr ? config::with_absolute_paths(list->value) : config::Value{};
    std::set<std::string> files;
    collect_files(effects, files);
    std::map<std::string, std::string> names;
    for (const std::string& named : files) names[named] = fs::path(named).filename().string();
    add(file, kind, model_text(document, effects.items, camera_.view().name, names), entry, copies);
    for (const std::string& named : files) add(named, kind, "", entry, copies);
  }

  void add(const fs::path& file, const std::string& kind, std::string text, io::FolderEntry& entry,
           std::vector<FolderCopy>& copies) const {
    const fs::path to = fs::path(kind) / file.filename();
    const auto same = std::ranges::find(copies, to, &FolderCopy::to);
    if (same != copies.end() && same->from == fs::absolute(file)) return;  // referenced twice
    if (same != copies.end())
      throw config::ConfigurationError(
          fmt::format("{}: error: has the name of {}: rename one of them\n", file.string(), same->from.string()));
    entry.files.push_back({to, ""});
    copies.push_back({fs::absolute(file), to, std::move(text)});
  }

  const io::Camera& camera_;
  const AddOptions& options_;
  const graph::PluginRegistry& registry_;
};

}  // namespace

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

fs::path maps_beside(const fs::path& calibration) { return fs::path(calibration).replace_extension(".maps.h5"); }

bool is_there(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error);
}

std::string date_of(const fs::path& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return {};
  return fmt::format("{:%Y-%m-%d}", fmt::gmtime(status.st_mtime));
}

void collect_files(const config::Value& value, std::set<std::string>& files) {
  for (const config::Value& item : value.items) collect_files(item, files);
  for (const config::Entry& entry : value.entries) {
    if (entry.key != "camera" && entry.value.is_scalar() && entry.value.text.starts_with('/'))
      files.insert(entry.value.text);
    collect_files(entry.value, files);
  }
}

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

io::FolderEntry entry_of(const fs::path& file, const io::Camera& camera, const AddOptions& options,
                         const graph::PluginRegistry& registry, std::vector<FolderCopy>& copies) {
  return CalibrationCheck(camera, options, registry).entry_of(file, copies);
}

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

}  // namespace tofgraph::simulation
