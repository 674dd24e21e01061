// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Camera named by a document: a profile, or the folder of a device.
#include "io/camera_folder.hpp"
#include "io/profile.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tofgraph::io {
namespace {

bool is_profile_name(const std::string& name) {
  const std::vector<std::string> names = profile_names();
  return std::ranges::find(names, name) != names.end();
}

std::vector<std::string> known_cameras() {
  std::vector<std::string> names = profile_names();
  for (std::string& name : camera_folder_names()) names.push_back(std::move(name));
  return names;
}

CameraPtr camera_of_folder(const std::filesystem::path& path, const config::Value& name,
                           config::Diagnostics& diagnostics) {
  try {
    auto folder = std::make_shared<const CameraFolder>(read_camera_folder(path));
    const std::size_t before = diagnostics.errors();
    for (const std::string& problem : folder_problems(*folder)) diagnostics.error(name.at, problem);
    if (diagnostics.errors() != before) return nullptr;
    CameraPtr camera = load_profile(folder->folder / folder_profile_name);
    std::const_pointer_cast<Camera>(camera)->folder = std::move(folder);
    return camera;
  } catch (const config::ConfigurationError& failure) {
    diagnostics.add(failure, name.at);
    return nullptr;
  }
}

}  // namespace

io::CameraPtr find_camera(const config::Value& name, config::Diagnostics& diagnostics) {
  const auto base = name.at.source ? name.at.source->base : std::filesystem::path{};
  if (const auto folder = find_camera_folder(name.text, base); !folder.empty() && !is_profile_name(name.text))
    return camera_of_folder(folder, name, diagnostics);
  const auto file = find_profile(name.text, base);
  std::error_code error;
  if (file.empty() || !std::filesystem::exists(file, error)) {
    const std::string what = file.empty() ? fmt::format("'{}'", name.text) : file.string();
    diagnostics.error(
        name.at, fmt::format("there is no camera profile {}", what),
        std::filesystem::is_regular_file(base / name.text, error)
            ? fmt::format("a file is named ./NAME.yaml; a camera file of OpenCV, ROS or a vendor becomes a "
                          "profile: tofgraph convert {} -o my_camera.yaml",
                          name.text)
            : config::suggestion(name.text, known_cameras(), "profiles") + " (or a path to a .yaml file)");
    return nullptr;
  }
  config::Diagnostics own;
  try {
    CameraPtr camera = load_profile(file, own);
    if (!camera) throw config::ConfigurationError(own);
    diagnostics.add(own.all());  // warnings
    return camera;
  } catch (const config::ConfigurationError& failure) {
    diagnostics.add(failure, name.at);
    return nullptr;
  }
}

std::string camera_name_in(const config::Value& name, const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const auto is_path = [](const std::string& text) {
    return text.find('/') != std::string::npos || text.ends_with(".yaml");
  };
  if (!is_path(name.text)) return name.text;
  fs::path file = fs::absolute(config::path_at(name.text, name.at)).lexically_normal();
  if (!file.has_filename()) file = file.parent_path();
  // Without symbolic links, because '..' after a link leads out of the folder that it points to.
  const fs::path real = fs::weakly_canonical(file.parent_path()) / file.filename();
  const std::string text = real.lexically_proximate(fs::weakly_canonical(fs::absolute(folder))).generic_string();
  return is_path(text) ? text : "./" + text;
}

}  // namespace tofgraph::io
