// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/campaign_checks.hpp"

#include "calibration/camera_identity.hpp"
#include "calibration/plausibility.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace tofgraph::calibration {
namespace {

constexpr std::size_t blocks = 8;                      ///< per row and per column
constexpr std::size_t min_plausible = 5;               ///< conditions; fewer cannot contradict each other
constexpr double usual_board = 0.5, usual_gain = 7e6;  ///< used if reflectivity or gain is unknown

/// Image block that contains a pixel.
std::size_t block_of(const tofgraph_camera& camera, std::size_t pixel) {
  const std::size_t u = pixel % camera.width, v = pixel / camera.width;
  return v * blocks / camera.height * blocks + u * blocks / camera.width;
}

std::size_t middle_of(const tofgraph_camera& camera, std::size_t block) {
  const std::size_t u = (2 * (block % blocks) + 1) * camera.width / (2 * blocks),
                    v = (2 * (block / blocks) + 1) * camera.height / (2 * blocks);
  return v * camera.width + u;
}

bool has_word(const std::string& words, const std::string& word) {
  return (" " + words + " ").find(" " + word + " ") != std::string::npos;
}

}  // namespace

CampaignChecks::CampaignChecks(const io::Campaign& campaign, const BoardModels& models)
    : campaign_(campaign), camera_(campaign.camera->view()), models_(models) {}

BoardPhasors::Phasors CampaignChecks::measured(const io::Condition& condition, const MeanImages& images) const {
  const std::vector<double> modelled = models_.of(condition).modelled(condition, images.pixels);
  std::vector<std::vector<double>> residual(blocks * blocks), amplitude(blocks * blocks);
  for (std::size_t k = 0; k < images.pixels.size(); ++k) {
    const std::size_t block = block_of(camera_, images.pixels[k]);
    residual[block].push_back(images.distance[k] - modelled[k]);
    if (!images.amplitude.empty()) amplitude[block].push_back(images.amplitude[k]);
  }
  const double scale = physics::metres_per_radian(camera_.modulation_frequency);
  BoardPhasors::Phasors phasors = ideal(condition);
  for (std::size_t b = 0; b < phasors.size(); ++b) {
    if (residual[b].empty()) {
      phasors[b] = {unknown, unknown};
      continue;
    }
    const double strength = amplitude[b].empty() ? 1 : physics::median(std::move(amplitude[b]));
    phasors[b] = std::polar(strength, std::arg(phasors[b]) + physics::median(std::move(residual[b])) / scale);
  }
  return phasors;
}

BoardPhasors::Phasors CampaignChecks::ideal(const io::Condition& c) const {
  const double lamps = c.sources.empty() || camera_.light_count == 0
                           ? 1
                           : static_cast<double>(c.sources.size()) / static_cast<double>(camera_.light_count);
  const double light = lamps * (camera_.gain > 0 ? camera_.gain : usual_gain) *
                       (std::isfinite(c.reflectivity) ? c.reflectivity : usual_board) * c.integration_time;
  std::vector<std::size_t> pixels;
  for (std::size_t b = 0; b < blocks * blocks; ++b) pixels.push_back(middle_of(camera_, b));
  BoardPhasors::Phasors phasors;
  for (const double d : models_.of(c).modelled(c, pixels))
    phasors.push_back(std::polar(light / (4 * d * d), d / physics::metres_per_radian(camera_.modulation_frequency)));
  return phasors;
}

void CampaignChecks::check_entries(const std::vector<ConditionEvidence>& evidence,
                                   config::Diagnostics& diagnostics) const {
  BoardPhasors data{.modulation_frequency = camera_.modulation_frequency, .min_distance = 1.01 * camera_.focal_length};
  bool shows_saturation = false;
  for (const ConditionEvidence& e : evidence) {
    if (e.phasors.empty()) continue;
    data.conditions.push_back(e.condition);
    data.measured.push_back(e.phasors);
    data.has_amplitude.push_back(e.has_amplitude ? 1 : 0);
    data.ideal.push_back(ideal(e.condition));
    data.recorded_times.push_back(e.recorded_time);
    shows_saturation = shows_saturation || e.shows_saturation;
  }
  if (data.size() < min_plausible) return;
  data.ideal_of = [this](const io::Condition& condition) { return ideal(condition); };
  // The largest mean of a tap is a / (2 contrast) + a / 2.
  if (!shows_saturation && camera_.full_well > 0 && camera_.contrast > 0)
    data.max_amplitude = camera_.full_well / (1 / (2 * camera_.contrast) + 0.5);
  for (const Contradiction& one : contradictions(data)) {
    const io::Condition& c = data.conditions[one.condition];
    config::Position at = c.place(one.key());
    at.column = std::max<std::size_t>(at.column, 1);
    diagnostics.error(at, fmt::format("condition '{}': {}", c.id, one.text), "correct it, or leave the condition out");
  }
}

void CampaignChecks::check_cameras(const std::vector<ConditionEvidence>& evidence,
                                   config::Diagnostics& diagnostics) const {
  std::map<std::string, std::size_t> names;
  for (const ConditionEvidence& e : evidence) {
    if (!e.camera.empty()) ++names[e.camera];
  }
  if (names.size() < 2) return;
  const auto usual = std::ranges::max_element(names, {}, [](const auto& name) { return name.second; });
  for (const ConditionEvidence& e : evidence) {
    if (!e.camera.empty() && e.camera != usual->first)
      diagnostics.error(place_of(e.condition),
                        fmt::format("the capture is of the camera '{}', {} others are of '{}'", e.camera, usual->second,
                                    usual->first),
                        "a calibration is of one camera: make a campaign for each");
  }
}

/// Reports campaigns that mix boards with and without a correction.
void CampaignChecks::check_applied(const std::vector<ConditionEvidence>& evidence,
                                   config::Diagnostics& diagnostics) const {
  for (const char* stage : {"model_correction", "offset_correction"}) {
    const std::vector<const io::Condition*> corrected = corrected_by(campaign_, evidence, stage);
    const auto all = static_cast<std::size_t>(std::ranges::count_if(evidence, &ConditionEvidence::read));
    if (corrected.empty() || corrected.size() == all) continue;
    diagnostics.error(
        place_of(*corrected.front()),
        fmt::format("{} of {} captures have {} applied to their distances, the first is that of '{}'; the "
                    "others have not",
                    corrected.size(), all, stage, corrected.front()->id),
        "give captures that were all processed in the same way");
  }
}

void CampaignChecks::check(const std::vector<ConditionEvidence>& evidence, std::vector<std::string>& notes,
                           config::Diagnostics& diagnostics) const {
  std::vector<double> recorded;
  std::vector<io::Condition> conditions;
  for (const ConditionEvidence& e : evidence) {
    recorded.push_back(e.recorded_time);
    conditions.push_back(e.condition);
  }
  for (const config::Diagnostic& warning : io::unlikely_integration_times(conditions, recorded, camera_))
    notes.push_back(warning.hint.empty() ? warning.message : fmt::format("{}: {}", warning.message, warning.hint));
  check_cameras(evidence, diagnostics);
  check_applied(evidence, diagnostics);
  check_entries(evidence, diagnostics);
}

std::vector<const io::Condition*> corrected_by(const io::Campaign& campaign,
                                               const std::vector<ConditionEvidence>& evidence,
                                               const std::string& stage) {
  std::vector<const io::Condition*> corrected;
  for (std::size_t i = 0; i < evidence.size(); ++i) {
    if (has_word(evidence[i].applied, stage)) corrected.push_back(&campaign.conditions[i]);
  }
  return corrected;
}

}  // namespace tofgraph::calibration
