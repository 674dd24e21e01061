// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inspection/inspection.hpp"

#include "config/log.hpp"
#include "config/quantity.hpp"
#include "inspection/orders.hpp"
#include "io/plausibility.hpp"
#include "io/profile.hpp"
#include "io/unknown.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace tofgraph::inspection {
namespace {

constexpr double min_gain = 25;           ///< decrease of chi-square relative to the stated assumption
constexpr double min_explained = 0.5;     ///< explained share of the mean square deviation
constexpr double min_deviation = 0.0006;  ///< relative to the length: walls are seldom flatter
constexpr double max_unevenness = 0.01;   ///< RMS of a plane under the best assumption, relative
constexpr double uneven = 4;              ///< the same of a small one, relative to that of the largest plane
constexpr std::size_t small = 8;          ///< times as many blocks has the largest plane
constexpr std::size_t max_listed = 3;     ///< assumptions of different kinds that are listed

double median_length(const Observation& o) {
  std::vector<double> lengths;
  for (const double length : o.length)
    if (std::isfinite(length)) lengths.push_back(length);
  if (lengths.empty())
    throw std::runtime_error("has no pixel with a valid length: a length is needed for the inspection");
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::ranges::nth_element(lengths, middle);
  return *middle;
}

std::string millimetres(double length) { return fmt::format("{:.3g} mm", 1e3 * length); }

/// Deviation from planes, from which the noise has been subtracted.
std::string deviation(double rms) {
  return rms < 1e-4 ? "below 0.1 mm beside the noise" : millimetres(rms) + " (RMS, noise subtracted)";
}

/// Adds a finding if lengths are implausible for the camera; otherwise the unit is undecided: planes are flat in
/// all.
void add_range(Inspection& result) {
  const Observation& o = result.observation;
  if (o.decoded) return;
  const std::vector<float> lengths(o.length.begin(), o.length.end());
  const double most = o.camera->data_sheet.measuring_range[1];
  const std::string doubt = io::range_doubt(o.channel, lengths, most, o.unambiguous_range);
  if (!doubt.empty())
    return result.findings.push_back({"unit", doubt, "the camera hardly measures such lengths",
                                      "unit: the length that a value of 1 stands for", io::unknown, io::unknown});
  const bool beyond = std::ranges::any_of(lengths, [&](float v) { return v > o.unambiguous_range; });
  result.undecided.push_back(
      "whether the unit is right: planes are flat in every unit; compare a known length" +
      (beyond ? "; some lengths are beyond the unambiguous range, " + config::format_quantity(o.unambiguous_range, "m")
              : std::string()));
}

/// Adds a finding if the unit seems wrong. @returns the factor that corrects the lengths: 1, 1000 or 0.001
double add_unit(Inspection& result) {
  const Observation& o = result.observation;
  const double median = median_length(o);
  const double range = o.unambiguous_range;
  const auto sheet = o.camera->data_sheet.measuring_range;
  const double most = std::isfinite(sheet[1]) ? 2 * sheet[1] : std::isfinite(range) ? 4 * range : 200;
  double scale = 1;
  if (median > most && median / 1000 < most && median / 1000 > 0.01) scale = 1e-3;
  if (median < 0.02 && median * 1000 < most) scale = 1e3;
  if (scale == 1) {
    add_range(result);
    return 1;
  }
  Finding f{.kind = "unit", .explained = io::unknown};
  f.text = fmt::format("the lengths are 1000 times too {}: {} are taken for {}", scale < 1 ? "large" : "small",
                       scale < 1 ? "millimetres" : "metres", scale < 1 ? "metres" : "millimetres");
  f.evidence =
      fmt::format("the median is {}; {}", config::format_quantity(median, "m"),
                  std::isfinite(range) ? fmt::format("the unambiguous range is {}", config::format_quantity(range, "m"))
                                       : std::string("time-of-flight cameras measure 0.1 m to 100 m"));
  f.mend = scale < 1 ? "unit: mm" : "unit: m";
  f.size = std::abs(median * (1 - scale));
  result.findings.push_back(f);
  return scale;
}

std::string distortion_text(const Candidate& candidate) {
  return fmt::format("distortion: [{:.4g}]", fmt::join(candidate.assumption.distortion, ", "));
}

/// Text and line of YAML of an assumption.
std::pair<std::string, std::string> words_of(const Candidate& c, const Observation& o) {
  const Assumption& a = c.assumption;
  if (c.kind == "channel") return {fmt::format("the lengths are {}, not {}", a.channel, o.channel), "as: " + a.channel};
  if (c.kind == "channel_and_lens")
    return {fmt::format("the lengths are {}, not {}, and the distortion of the profile is wrong", a.channel, o.channel),
            "as: " + a.channel + ", and in the profile " + distortion_text(c)};
  if (c.kind == "lens_sign") return {"the radial distortion of the profile has the wrong sign", distortion_text(c)};
  if (c.kind == "lens_missing") return {"the profile lacks the distortion of the lens", distortion_text(c)};
  if (c.kind == "lens_superfluous")
    return {"the images are already undistorted, but the profile states a distortion", "distortion: [0, 0, 0, 0, 0]"};
  if (c.kind == "focal_length") {
    const tofgraph_camera& camera = o.camera->view();
    return {fmt::format("the focal length is wrong by {:.3g} %", 100 * (a.focal_scale - 1)),
            fmt::format("focal_length: [{:.5g} px, {:.5g} px]", camera.focal_px[0] * a.focal_scale,
                        camera.focal_px[1] * a.focal_scale)};
  }
  if (c.kind == "zero_offset")
    return {fmt::format("all lengths are {} too {}", millimetres(std::abs(a.offset * a.scale)),
                        a.offset > 0 ? "large" : "small"),
            "tofgraph calibrate offset, or the effect zero_offset in the camera's model"};
  return {
      fmt::format("the images are {} relative to the profile",
                  std::string_view(a.orientation.mirror) == "none"
                      ? fmt::format("turned by {} deg", 360 - a.orientation.turn)
                      : fmt::format("mirrored{}", a.orientation.turn != 0 ? " and turned" : "")),
      fmt::format("- {{stage: orient, mirror: {}, turn: {}, camera: kept}}", a.orientation.mirror, a.orientation.turn)};
}

/// Keeps the surfaces that are flat under some assumption, e.g. no spheres. Small ones must be about as flat as the
/// largest one, because a small part of a sphere is nearly flat, too. @param facts tell what was removed
/// @returns true if any was removed
bool keep_planes(FlatnessTest& test, const Flatness& stated, const std::vector<Candidate>& candidates,
                 std::vector<std::string>& facts) {
  std::vector<double> least = stated.surface_rms;
  for (const Candidate& c : candidates) {
    for (std::size_t s = 0; s < least.size(); ++s) least[s] = std::min(least[s], c.flatness.surface_rms[s]);
  }
  std::vector<std::size_t> blocks(least.size());
  for (const Block& block : test.surfaces().blocks) ++blocks[block.surface];
  const auto largest = static_cast<std::size_t>(std::ranges::max_element(blocks) - blocks.begin());
  const double limit = std::clamp(uneven * least[largest], min_deviation, max_unevenness);
  std::vector<bool> keep;
  std::size_t removed = 0;
  for (std::size_t s = 0; s < least.size(); ++s) {
    keep.push_back(least[s] < (small * blocks[s] < blocks[largest] ? limit : max_unevenness));
    removed += keep[s] ? 0 : blocks[s];
  }
  if (removed == 0) return false;
  const double share = static_cast<double>(removed) / static_cast<double>(test.surfaces().blocks.size());
  facts.push_back(
      fmt::format("{:.0f} % of the smooth surfaces are not planes under any of these assumptions", 100 * share));
  test.keep(keep);
  return true;
}

/// Adds the questions for which other answers leave the planes equally flat.
void add_undecided(const std::vector<Candidate>& candidates, const Flatness& reference, Inspection& result,
                   const std::string& answered, bool knows_sources) {
  static constexpr std::pair<const char*, const char*> questions[] = {
      {"channel", "which kind the lengths are"},
      {"orientation", "whether the images are mirrored or turned"},
      {"lens", "whether the distortion of the lens is right"}};
  for (const auto& [question, words] : questions) {
    if (answered == question) continue;
    std::vector<std::string> equal;
    for (const Candidate& c : candidates) {
      if (c.question != question || c.parameters != 0 || c.joint || !(c.flatness.chi2 < reference.chi2 + min_gain))
        continue;
      const bool same = !knows_sources && result.observation.channel != "depth" && c.assumption.channel != "depth";
      if (c.kind == "channel" && same)
        result.facts.push_back("distance and range are equal: the profile has no positions of light sources");
      else
        equal.push_back(words_of(c, result.observation).second);
    }
    if (!equal.empty())
      result.undecided.push_back(
          fmt::format("{}: {} would change the planes by less than the noise", words, fmt::join(equal, " or ")));
  }
}

void add_flatness(Inspection& result, double scale) {
  const Observation& o = result.observation;
  FlatnessTest test(o, surfaces_of(o));
  Assumption said = test.stated();
  said.scale = scale;
  Flatness stated = test(said);
  std::vector<Candidate> candidates = candidates_of(test, scale);
  if (test.surfaces().count > 0 && keep_planes(test, stated, candidates, result.facts)) {
    stated = test(said);
    candidates = candidates_of(test, scale);
  }
  result.surfaces = test.surfaces();
  if (test.surfaces().count == 0) {
    result.undecided.emplace_back(
        "range or depth, lens, orientation: no plane was found that is large enough; record a wall, a floor or a "
        "board that fills much of the image, at a slant");
    return;
  }
  result.stated_rest = stated.rest;
  const double length = median_length(o) * scale;
  const Candidate* first = nullptr;
  std::set<std::string> kinds;
  for (const Candidate& c : candidates) {
    const double explained = 1 - c.flatness.rms * c.flatness.rms / (stated.rms * stated.rms);
    if (stated.rms < min_deviation * length || stated.chi2 - c.score() < min_gain || explained < min_explained ||
        !moves_enough(stated, c.flatness))
      continue;
    if (first != nullptr && (kinds.contains(c.kind) || kinds.size() >= max_listed || c.joint)) continue;
    const auto [text, mend] = words_of(c, o);
    Finding f{c.kind, text, "", mend, stated.rms, explained};
    f.evidence = fmt::format(
        "planes deviate by {} as stated, {} with this correction, which explains {:.0f} % of the mean square",
        deviation(stated.rms), deviation(c.flatness.rms), 100 * explained);
    if (first == nullptr)
      first = &c;
    else if (c.score() < first->score() + min_gain)
      f.evidence += "; this scene cannot distinguish it from the finding before";
    kinds.insert(c.kind);
    result.findings.push_back(f);
  }
  if (first != nullptr) {
    result.best_rest = first->flatness.rest;
    result.best = first->kind;
  } else if (stated.rms > min_deviation * length && stated.chi2 > 2 * static_cast<double>(stated.count)) {
    result.facts.push_back(
        fmt::format("planes deviate by {} (RMS) from flatness, and none of the known errors "
                    "explains half of it: multipath, wiggling, or surfaces that are not flat",
                    millimetres(stated.rms)));
  }
  add_undecided(candidates, first != nullptr ? first->flatness : stated, result,
                first != nullptr ? first->question : "", test.knows_sources());
  result.facts.push_back(
      fmt::format("{} with {:.0f} % of the pixels; deviation from planes as stated: {}",
                  config::counted(test.surfaces().count, "plane"),
                  100.0 * static_cast<double>(stated.count * test.surfaces().side * test.surfaces().side) /
                      static_cast<double>(o.pixels()),
                  deviation(stated.rms)));
}

}  // namespace

Inspection inspect(const io::CaptureReader& capture, const io::CameraPtr& camera, const std::string& name) {
  Inspection result;
  result.name = name;
  result.observation = observe(capture, camera);
  const bool is_decided = add_order(result, capture);
  const double scale = add_unit(result);
  if (is_decided) add_flatness(result, scale);
  add_amplitude_orientation(result);
  add_pixel_findings(result);
  return result;
}

}  // namespace tofgraph::inspection
