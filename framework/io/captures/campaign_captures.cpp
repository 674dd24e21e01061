// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/campaign_captures.hpp"

#include "config/quantity.hpp"
#include "config/say.hpp"
#include "io/captures/capture.hpp"

#include <tofgraph/physics/exposures.hpp>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace tofgraph::io {
namespace {

class Check {
 public:
  Check(const config::Value& document, const Campaign& campaign, CapturesFor purpose, config::Diagnostics& diagnostics)
      : document_(document), campaign_(campaign), purpose_(purpose), diagnostics_(diagnostics) {}

  void all() {
    std::vector<config::Diagnostics> found(campaign_.conditions.size());
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t i) {
      Check(document_, campaign_, purpose_, found[i]).capture_of(campaign_.conditions[i]);
    });
    for (const config::Diagnostics& mistakes : found) diagnostics_.add(mistakes.all());
    same_frames();
    times();
  }

 private:
  void capture_of(const Condition& condition) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(condition.capture, error)) return;  // told already, or there is none
    try {
      one(condition, CaptureReader(condition.capture));
    } catch (const std::runtime_error& problem) {
      if (purpose_ == CapturesFor::anything) mistake(condition, problem.what());
    }
  }

  /// Where the capture of a condition is written.
  config::Position place_of(const Condition& condition) const {
    const config::Entry* conditions = document_.find("conditions");
    if (conditions == nullptr) return condition.at;
    for (const config::Value& item : conditions->value.items) {
      const config::Entry* capture = item.find("capture");
      if (capture != nullptr && item.at.line == condition.at.line && item.at.column == condition.at.column)
        return capture->value.at;
    }
    return condition.at;
  }
  void mistake(const Condition& condition, const std::string& what) {
    diagnostics_.error(place_of(condition), fmt::format("'capture': {}", what));
  }
  /// What keeps a search from using a condition.
  void obstacle(const Condition& condition, const std::string& what, const std::string& hint) {
    const std::string text = fmt::format("diagnose cannot use the condition: {}", what);
    if (purpose_ == CapturesFor::search)
      diagnostics_.error(place_of(condition), text, fmt::format("{}; or leave it out: --skip {}", hint, condition.id));
    else if (!campaign_.pattern)  // which is for a lens, not for a search
      diagnostics_.warning(place_of(condition), text, hint);
  }

  void one(const Condition& condition, const CaptureReader& capture) {
    const CaptureHeader& header = capture.header();
    const tofgraph_camera* camera = campaign_.camera ? &campaign_.camera->view() : nullptr;
    if (camera != nullptr && (header.width != camera->width || header.height != camera->height))
      mistake(condition, fmt::format("the capture is {} x {} px, the camera '{}' has {} x {}", header.width,
                                     header.height, camera->name, camera->width, camera->height));
    if (condition.frames && (*condition.frames)[1] >= capture.frames())
      mistake(condition, fmt::format("the capture has {}, counted from 0: frame {} is not there",
                                     config::counted(capture.frames(), "frame"), (*condition.frames)[1]));
    if (std::isnan(condition.integration_time) && capture.frames() > 0 &&
        std::isnan(capture.metadata(0).integration_time))
      obstacle(condition, "neither it nor its capture says the integration time", "example: integration_time: 1 ms");
    if (camera != nullptr && !header.camera.empty() && header.camera != camera->name)
      obstacle(condition,
               fmt::format("its capture is of the camera '{}', the campaign's is '{}'", header.camera, camera->name),
               "one search is of one camera: name its profile in the campaign; the profile of that very device has its "
               "name");
    exposures(condition, capture);
  }

  /// Decoded frames need not know their exposures.
  void exposures(const Condition& condition, const CaptureReader& capture) {
    const auto samples = std::ranges::find_if(
        capture.channels(), [](const CaptureChannel& c) { return c.name == "taps" || c.name == "phases"; });
    if (samples == capture.channels().end()) return;
    const physics::Exposures& own = capture.header().exposures;
    const std::string problem = own.empty() ? std::string() : physics::not_the_four(own);
    if (!problem.empty())
      obstacle(condition, "a search " + problem, "record it with four");
    else if (samples->extent[0] != physics::four_exposures.size())
      obstacle(condition,
               fmt::format("its capture has {} exposures a frame, a search needs four exposures at 0, 90, 180 and 270 "
                           "deg of one frequency",
                           samples->extent[0]),
               "record it with four");
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
        obstacle(condition,
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

  /// Within a session that has a name the camera stays on. Elsewhere it may have been off meanwhile.
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
        obstacle(now,
                 fmt::format("'time_since_power_on' runs backwards within the session '{}': {} after {} of '{}', which "
                             "was measured before",
                             name, config::format_quantity(now.time_since_power_on, "s"),
                             config::format_quantity(before.time_since_power_on, "s"), before.id),
                 "correct one of the times or 'order', or name a session for each time the camera was switched on");
      }
    }
  }

  const config::Value& document_;
  const Campaign& campaign_;
  CapturesFor purpose_;
  config::Diagnostics& diagnostics_;
};

}  // namespace

void check_captures(const config::Value& document, const Campaign& campaign, CapturesFor purpose,
                    config::Diagnostics& diagnostics) {
  Check(document, campaign, purpose, diagnostics).all();
}

}  // namespace tofgraph::io
