// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Active light sources of a camera.
#pragma once

#include <tofgraph/array.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Names of all light sources of a camera.
inline std::vector<std::string> source_names(const tofgraph_camera& camera) {
  std::vector<std::string> names;
  for (const tofgraph_light& light : lights_of(camera)) names.emplace_back(light.name);
  return names;
}

/// Names in a comma-separated text, as a capture states them.
inline std::vector<std::string> names_between_commas(const std::string& text) {
  std::vector<std::string> names;
  std::istringstream list(text);
  for (std::string name; std::getline(list >> std::ws, name, ',');) names.push_back(name);
  return names;
}

/// Light sources with one of these names, in the order of the camera. @param names empty: all sources
inline std::vector<tofgraph_light> lights_named(const tofgraph_camera& camera, const std::vector<std::string>& names) {
  std::vector<tofgraph_light> lights;
  for (const tofgraph_light& light : lights_of(camera)) {
    if (names.empty() || std::ranges::find(names, light.name) != names.end()) lights.push_back(light);
  }
  return lights;
}

/// True if two lists of names mean the same sources of a camera; an empty list means all sources.
inline bool same_sources(const tofgraph_camera& camera, const std::vector<std::string>& a,
                         const std::vector<std::string>& b) {
  const auto is_in = [](const std::vector<std::string>& names, const std::string& name) {
    return names.empty() || std::ranges::find(names, name) != names.end();
  };
  return std::ranges::all_of(source_names(camera), [&](const std::string& n) { return is_in(a, n) == is_in(b, n); });
}

/// Reason why a condition contradicts the sources stated by its capture, as the end of a sentence about the capture;
/// empty: it does not.
inline std::string sources_problem(const tofgraph_camera& camera, const std::vector<std::string>& recorded,
                                   const std::vector<std::string>& condition) {
  if (recorded.empty() || same_sources(camera, recorded, condition)) return {};
  return fmt::format("was recorded with {}, the condition has {}: write sources: [{}]", fmt::join(recorded, ", "),
                     condition.empty() ? "all sources" : fmt::format("{}", fmt::join(condition, ", ")),
                     fmt::join(recorded, ", "));
}

/// Replaces the camera by one with only these light sources, so that the distance models use no others.
/// @param setup of a stage @param names empty: all sources
template <class Setup> void use_sources(const Setup& setup, const std::vector<std::string>& names) {
  tofgraph_camera camera = setup.camera();
  const std::vector<tofgraph_light> lights = lights_named(camera, names);
  if (lights.size() == camera.light_count) return;
  camera.lights = lights.data();
  camera.light_count = lights.size();
  camera.light_size = sizeof(tofgraph_light);
  setup.set_camera(camera);
}

}  // namespace tofgraph::io
