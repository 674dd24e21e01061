// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Files of a search for other commands: the extended model with its maps, and a scene of the next condition to measure.
#include "config/quantity.hpp"
#include "diagnosis/report/diagnosis.hpp"
#include "diagnosis/report/gap_report_parts.hpp"
#include "io/captures/capture_map.hpp"
#include "io/output_files.hpp"
#include "simulation/board.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

/// Name of the camera; a path becomes absolute, because the extended model is in another folder.
std::string camera_of(const simulation::Model& model) {
  const bool path = model.camera.find('/') != std::string::npos || model.camera.ends_with(".yaml");
  if (!path || !model.camera_at.source) return model.camera;
  return std::filesystem::absolute(model.camera_at.source->base / model.camera).lexically_normal().string();
}

/// Tied alternatives to a term, as YAML comments.
std::string ties_of(const Diagnosis& d, const Term& term) {
  std::string text;
  for (const EffectFinding& found : d.search.found) {
    if (found.name != term.candidate->name()) continue;
    for (const Rival& rival : found.rivals) {
      if (!rival.tied || !rival.is_listed_at(found.name)) continue;
      const std::size_t at = term_of(rival.state, *rival.candidate);
      if (at == rival.state.terms.size()) continue;
      const Term& other = rival.state.terms[at];
      const std::string of_all =
          rival.of_several() ? fmt::format(" in the place of {}", fmt::join(rival.in_place_of, " and ")) : "";
      text += fmt::format("  # or{}, which these data cannot distinguish ({:.1f} of deviance worse):\n  # - {}\n",
                          of_all, std::round(10 * rival.deviance) / 10 + 0.0,
                          other.candidate->yaml(other.values, other.maps.get(), map_file_name));
    }
  }
  return text;
}

}  // namespace

void write_maps(const Diagnosis& d, const std::filesystem::path& folder, io::OutputFiles& files) {
  std::vector<io::PixelMapData> data;
  for (const PixelMap& map : d.maps) data.push_back({map.dataset, map.unit, map.values});
  if (data.empty()) return files.drop(folder / map_file_name);
  const io::OutputFile& file = files.add(folder / map_file_name);
  const tofgraph_camera& camera = d.measurements.design->camera();
  io::write_pixel_maps(file.temporary_path().string(), data, camera.height, camera.width);
}

std::string model_yaml(const Diagnosis& d) {
  std::string text = fmt::format("model: 1\ncamera: {}\nlight: {}\n", config::yaml_word(camera_of(d.model)),
                                 d.model.physical ? "physical" : "reference");
  const std::string& serial = d.measurements.serial.empty() ? d.model.serial : d.measurements.serial;
  if (!serial.empty()) text += fmt::format("serial: {}\n", config::yaml_word(serial));
  text += d.search.after.state.terms.empty() ? "effects: []\n" : "effects:\n";
  for (const Term& term : d.search.after.state.terms)
    text += "  - " + term.candidate->yaml(term.values, term.maps.get(), map_file_name) + "\n" + ties_of(d, term);
  return text;
}

std::string next_condition_yaml(const Diagnosis& d) {
  const NextCondition* const first = best_condition(d.next);
  if (first == nullptr) return "";
  const NextCondition& next = *first;
  const io::Condition& c = next.condition;
  std::string text =
      fmt::format("# {}\n# tofgraph simulate {} -o next_condition.h5\nscene: 1\ncamera: {}\nmodel: model.yaml\n",
                  sentence(next), next_condition_name, config::yaml_word(camera_of(d.model)));
  text += fmt::format("integration_time: {:.9g} s\n", c.integration_time);
  if (!c.target.empty()) text += fmt::format("target: {}\n", config::yaml_word(c.target));
  if (!c.sources.empty()) {
    std::vector<std::string> words;
    for (const std::string& name : c.sources) words.push_back(config::yaml_word(name));
    text += fmt::format("sources: [{}]\n", fmt::join(words, ", "));
  }
  if (c.ambient != "dark") text += fmt::format("ambient: {}\n", config::yaml_word(c.ambient));
  if (std::isfinite(c.time_since_power_on))
    text += fmt::format("time_since_power_on: {:.9g} s\n", c.time_since_power_on);
  if (c.rail == "covered") text += "rail: covered\n";
  if (c.reference == "laser") text += "reference: laser\n";
  if (c.roll != 0) text += fmt::format("roll: {:.9g} rad\n", c.roll);
  if (c.is_capped())
    return text + "lens: capped\nobjects:\n  - {name: board, type: board, distance: 1 m}  # not visible\n";
  const simulation::BoardPose pose = pose_of(c);
  return text +
         fmt::format(
             "objects:\n  - {{name: board, type: board, distance: {:.9g} m, tilt_x: {:.9g} rad, tilt_y: {:.9g} rad, "
             "reflectivity: {:.4g}}}\n",
             pose.distance, pose.tilt_x, pose.tilt_y, std::min(next.reflectivity, 1.0));
}

}  // namespace tofgraph::diagnosis
