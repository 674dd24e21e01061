// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/campaign_captures.hpp"

#include "config/log.hpp"
#include "config/quantity.hpp"
#include "io/captures/capture_guard.hpp"
#include "io/captures/statistics_file.hpp"
#include "io/light_sources.hpp"
#include "io/profile.hpp"

#include <tofgraph/physics/exposures.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace tofgraph::io {
namespace {

/// Properties of one capture for checks across all captures.
struct Opened {
  std::string camera;     ///< different from the campaign's; empty: the same, or unknown
  std::string size;       ///< problem with the size; empty: none
  double time = unknown;  ///< s, integration time
};

class Check {
 public:
  Check(const Campaign& campaign, CapturesFor purpose, config::Diagnostics& diagnostics)
      : campaign_(campaign), purpose_(purpose), diagnostics_(diagnostics) {}

  void all() {
    std::vector<config::Diagnostics> found(campaign_.conditions.size());
    std::vector<Opened> opened(found.size());
    std::vector<std::filesystem::path> files;
    for (const Condition& condition : campaign_.conditions)
      if (!is_statistics(condition.capture)) files.push_back(condition.capture);
    try_ahead(files);
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t i) {
      opened[i] = Check(campaign_, purpose_, found[i]).capture_of(campaign_.conditions[i]);
    });
    for (const config::Diagnostics& mistakes : found) diagnostics_.add(mistakes.all());
    sizes(opened);
    cameras(opened);
    if (purpose_ == CapturesFor::anything && !campaign_.pattern) integration_times(opened);
    same_frames();
    times();
    frequencies();
  }

 private:
  using Conditions = std::vector<const Condition*>;

  Opened capture_of(const Condition& condition) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(condition.capture, error)) return {};  // already reported, or none
    try {
      return one(condition, read_facts(condition));
    } catch (const std::runtime_error& problem) {
      if (purpose_ == CapturesFor::anything) mistake(condition, problem.what());
      return {};
    }
  }

  void mistake(const Condition& condition, const std::string& what) {
    diagnostics_.error(condition.place("capture"), fmt::format("'capture': {}", what));
  }
  /// Reason why a search cannot use a condition. @param key whose value is the reason
  void obstacle(const Condition& condition, std::string_view key, const std::string& what, const std::string& hint) {
    obstacle({&condition}, key, "the condition: " + what, hint);
  }
  void obstacle(const Conditions& conditions, std::string_view key, const std::string& what, const std::string& hint) {
    const config::Position& at = conditions.front()->place(key);
    const std::string text = "diagnose cannot use " + what;
    if (purpose_ == CapturesFor::search)
      diagnostics_.error(at, text, hint + skipping(conditions));
    else if (!campaign_.pattern)  // it is for a lens calibration, not for a search
      diagnostics_.warning(at, text, hint);
  }
  /// Advice on excluding conditions, given if only a few are concerned.
  std::string skipping(const Conditions& conditions) const {
    constexpr std::size_t few = 8;
    if (conditions.size() > few || (conditions.size() > 1 && conditions.size() == campaign_.conditions.size()))
      return {};
    std::string ids;
    for (const Condition* condition : conditions) ids += (ids.empty() ? "" : ",") + condition->id;
    return fmt::format("; or exclude {}: --exclude-condition {}", conditions.size() == 1 ? "it" : "them", ids);
  }

  Opened one(const Condition& condition, const CaptureFacts& capture) {
    const CaptureHeader& header = capture.header;
    const tofgraph_camera* camera = campaign_.camera ? &campaign_.camera->view() : nullptr;
    Opened opened;
    if (camera != nullptr && (header.width != camera->width || header.height != camera->height))
      opened.size = fmt::format("{} x {} px, the camera '{}' has {} x {}", header.width, header.height, camera->name,
                                camera->width, camera->height);
    if (camera != nullptr && header.camera != camera->name) opened.camera = header.camera;
    opened.time = capture.first.integration_time;
    if (condition.frames && (*condition.frames)[1] >= capture.frames)
      mistake(condition, fmt::format("the capture has {}, counted from 0: frame {} does not exist",
                                     config::counted(capture.frames, "frame"), (*condition.frames)[1]));
    else if (std::isnan(condition.integration_time) && std::isnan(opened.time))
      obstacle(condition, "capture", "neither it nor its capture states the integration time",
               "example: integration_time: 1 ms");
    exposures(condition, capture);
    if (camera != nullptr) {
      const std::string problem = sources_problem(*camera, header.sources, condition.sources);
      if (!problem.empty()) mistake(condition, "the capture " + problem);
    }
    return opened;
  }

  /// Merges the messages of conditions with the same text.
  std::map<std::string, Conditions> alike(const std::vector<Opened>& opened, std::string Opened::*text) const {
    std::map<std::string, Conditions> groups;
    for (std::size_t i = 0; i < opened.size(); ++i) {
      if (!(opened[i].*text).empty()) groups[opened[i].*text].push_back(&campaign_.conditions[i]);
    }
    return groups;
  }

  void sizes(const std::vector<Opened>& opened) {
    for (const auto& [size, conditions] : alike(opened, &Opened::size))
      mistake(*conditions.front(),
              conditions.size() == 1 ? "the capture is " + size
                                     : fmt::format("the captures of {} conditions, of which this is the first, are {}",
                                                   conditions.size(), size));
  }

  void cameras(const std::vector<Opened>& opened) {
    for (const auto& [camera, conditions] : alike(opened, &Opened::camera)) {
      const bool all = conditions.size() == campaign_.conditions.size();
      const std::string own = campaign_.camera->view().name;
      const std::string hint =
          !all ? "one search is for one camera"
          : find_profile(camera, {}).empty()
              ? fmt::format("write the path of the profile with the name '{}' as the campaign's camera", camera)
              : fmt::format("write in the campaign: camera: {}", camera);
      obstacle(
          conditions, "capture",
          conditions.size() == 1
              ? fmt::format("the condition: its capture is of the camera '{}', the campaign's is '{}'", camera, own)
              : fmt::format("{} conditions, of which this is the first: their captures are of the camera '{}', the "
                            "campaign's is '{}'",
                            conditions.size(), camera, own),
          hint);
    }
  }

  void integration_times(const std::vector<Opened>& opened) {
    std::vector<double> recorded;
    for (const Opened& one : opened) recorded.push_back(one.time);
    if (campaign_.camera)
      diagnostics_.add(unlikely_integration_times(campaign_.conditions, recorded, campaign_.camera->view()));
  }

  void frequencies() {
    if (!campaign_.camera || campaign_.conditions.empty()) return;
    const std::string problem = physics::not_one_frequency(physics::exposures_of(campaign_.camera->view()));
    if (problem.empty()) return;
    Conditions all;
    for (const Condition& condition : campaign_.conditions) all.push_back(&condition);
    obstacle(all, "capture", fmt::format("the camera '{}': a search {}", campaign_.camera_name, problem),
             "decode it with phase_decoder and search its distances, with a profile of one frequency");
  }

  void exposures(const Condition& condition, const CaptureFacts& capture) {
    const tofgraph_camera* camera = campaign_.camera ? &campaign_.camera->view() : nullptr;
    if (camera == nullptr) return;
    if (const std::string problem = other_exposures(capture, *camera); !problem.empty())
      obstacle(condition, "capture", "its capture " + problem,
               "write the exposures that it was recorded with into the camera's profile");
  }

  void same_frames() {
    constexpr std::array<std::uint64_t, 2> whole = {0, std::numeric_limits<std::uint64_t>::max()};
    std::map<std::filesystem::path, std::vector<const Condition*>> seen;
    for (const Condition& condition : campaign_.conditions) {
      if (condition.capture.empty()) continue;
      auto& others = seen[condition.capture.lexically_normal()];
      for (const Condition* other : others) {
        const auto mine = condition.frames.value_or(whole), its = other->frames.value_or(whole);
        if (mine[0] > its[1] || its[0] > mine[1] || !overlap(condition.roi, other->roi)) continue;
        obstacle(condition, "capture",
                 fmt::format("the frames of {} are those of the condition '{}', line {}, too",
                             condition.capture.filename().string(), other->id, other->at.line),
                 "write the capture that was recorded there");
        break;
      }
      others.push_back(&condition);
    }
  }

  static bool overlap(const std::optional<Roi>& a, const std::optional<Roi>& b) {
    return !a || !b ||
           (a->first_column <= b->last_column && b->first_column <= a->last_column && a->first_row <= b->last_row &&
            b->first_row <= a->last_row);
  }

  /// The camera stays on only within a named session; otherwise it may have been switched off in between.
  void times() {
    std::map<std::string, std::vector<const Condition*>> sessions;
    for (const Condition& condition : campaign_.conditions) {
      if (!condition.session.empty() && condition.order && std::isfinite(condition.time_since_power_on))
        sessions[condition.session].push_back(&condition);
    }
    for (auto& [name, conditions] : sessions) {
      std::ranges::stable_sort(conditions, {}, [](const Condition* c) { return *c->order; });
      for (std::size_t i = 1; i < conditions.size(); ++i) {
        const Condition &before = *conditions[i - 1], &now = *conditions[i];
        if (now.time_since_power_on >= before.time_since_power_on) continue;
        obstacle(now, "time_since_power_on",
                 fmt::format("'time_since_power_on' runs backwards within the session '{}': {} after {} of '{}', which "
                             "was measured before",
                             name, config::format_quantity(now.time_since_power_on, "s"),
                             config::format_quantity(before.time_since_power_on, "s"), before.id),
                 "correct one of the times or 'order', or name a session for each time the camera was switched on");
      }
    }
  }

  const Campaign& campaign_;
  CapturesFor purpose_;
  config::Diagnostics& diagnostics_;
};

}  // namespace

void check_captures(const Campaign& campaign, CapturesFor purpose, config::Diagnostics& diagnostics) {
  Check(campaign, purpose, diagnostics).all();
}

std::string other_exposures(const CaptureFacts& capture, const tofgraph_camera& camera) {
  if (capture.exposures == 0) return {};
  const physics::Exposures &own = capture.header.exposures, cameras = physics::exposures_of(camera);
  if (own.empty() ? capture.exposures == cameras.size()
                  : physics::same_steps(own, cameras, camera.modulation_frequency))
    return {};
  return fmt::format(
      "has {}, the camera '{}' has {}",
      own.empty() ? fmt::format("{} exposures per frame", capture.exposures) : physics::exposures_text(own),
      camera.name, physics::exposures_text(cameras));
}

bool is_other_integration_time(double a, double b) { return std::abs(a / b - 1) > 0.01; }

std::vector<bool> other_integration_times(std::span<const double> written, std::span<const double> recorded) {
  std::vector<bool> other;
  for (std::size_t i = 0; i < written.size(); ++i) other.push_back(is_other_integration_time(recorded[i], written[i]));
  if (2 * static_cast<std::size_t>(std::ranges::count(other, true)) >= other.size()) other.assign(other.size(), false);
  return other;
}

std::vector<config::Diagnostic> unlikely_integration_times(std::span<const Condition> conditions,
                                                           std::span<const double> recorded,
                                                           const tofgraph_camera& camera) {
  using config::format_quantity;
  std::vector<config::Diagnostic> warnings;
  const auto warn = [&](const Condition& c, std::string message, std::string hint) {
    config::Position at = c.place("integration_time");
    at.column = std::max<std::size_t>(at.column, 1);
    warnings.push_back({config::Severity::warning, at, std::move(message), std::move(hint)});
  };
  std::vector<double> written, ratios;
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    written.push_back(conditions[i].integration_time);
    const double ratio = written[i] / recorded[i];
    if (std::isfinite(ratio) && ratio > 0) ratios.push_back(ratio);
  }
  constexpr double large = 9;  // typical slips: factors of 10, 60, 1000
  std::ranges::sort(ratios);
  if (const double ratio = ratios.empty() ? 1 : ratios[ratios.size() / 2]; ratio >= large || ratio <= 1 / large) {
    const auto first = std::ranges::find_if(written, [](double t) { return std::isfinite(t); }) - written.begin();
    const auto i = static_cast<std::size_t>(first);
    warn(conditions[i],
         fmt::format(
             "the campaign's integration times are {:.4g} times those of the captures: '{}' has {}, its capture {}",
             ratio, conditions[i].id, format_quantity(written[i], "s"), format_quantity(recorded[i], "s")),
         "is the unit right? 1 ms = 1000 us");
    return warnings;
  }
  const std::vector<bool> other = other_integration_times(written, recorded);
  const auto outside = [&](double t) {
    return std::isfinite(camera.integration_time[0]) &&
           (t < camera.integration_time[0] || t > camera.integration_time[1]);
  };
  bool outside_is_told = false;
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    if (other[i])
      warn(conditions[i],
           fmt::format("'integration_time' is {}, the capture states {}", format_quantity(written[i], "s"),
                       format_quantity(recorded[i], "s")),
           "diagnose and calibrate refuse the condition unless its amplitudes agree with the time written here");
    if (!outside(written[i]) || outside_is_told) continue;
    outside_is_told = true;
    warn(
        conditions[i],
        fmt::format("the integration time of '{}', {}, is outside of the range of the camera '{}', {} to {}",
                    conditions[i].id, format_quantity(written[i], "s"), camera.name,
                    format_quantity(camera.integration_time[0], "s"), format_quantity(camera.integration_time[1], "s")),
        "is the unit right?");
  }
  return warnings;
}

}  // namespace tofgraph::io
