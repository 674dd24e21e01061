// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/report/diagnosis.hpp"

#include "config/quantity.hpp"
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/report/gap_report_parts.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Adds notes on ambiguities caused by few levels of a setting, or by settings that vary together.
void notes_on_levels(const Design& design, bool light_seen, std::vector<std::string>& notes) {
  const std::set<double> distances = design.levels(&io::Condition::board_distance),
                         times = design.levels(&io::Condition::integration_time);
  std::map<std::pair<double, std::string>, std::set<double>> times_of_board;
  for (const io::Condition& c : design.conditions())
    if (!c.is_capped()) times_of_board[{c.board_distance, c.target}].insert(c.integration_time);
  if (distances.size() == 1)
    notes.push_back(
        "All conditions have one distance: an error that changes with the distance cannot be distinguished from an "
        "offset.");
  const auto few = [&](std::size_t levels, std::size_t least, const char* what) {
    if (levels > 1 && levels < least)
      notes.push_back(fmt::format(
          "There are only {} {}: a law over them is hardly tested between them, and not beyond.", levels, what));
  };
  few(distances.size(), 5, "distances");
  few(times.size(), 4, "integration times");
  const bool together = std::ranges::none_of(times_of_board, [](const auto& board) { return board.second.size() > 1; });
  if (times.size() > 1 && together && !light_seen)
    notes.push_back(
        "No target was measured at one distance with two integration times: the influence of the time is separated "
        "from that of distance and light by the form of the laws alone.");
}

/// "0.36 mm and 0.52 % of light", or only the significant one.
std::string length_and_light(double length, double light) {
  constexpr double none = 5e-5;  // m, and of ln amplitude: would be displayed as zero
  std::string text = length < none && light >= none ? "" : fmt::format("{:.2f} mm", 1e3 * length);
  if (light >= none) text += fmt::format("{}{:.2f} % of light", text.empty() ? "" : " and ", 100 * light);
  return text;
}

/// Adds notes on maps of lengths with a noticeable mean, which cannot be distinguished from a constant offset.
void note_means(const State& state, std::vector<std::string>& notes) {
  for (const Term& term : state.terms) {
    if (!term.maps) continue;
    const double scale = term.values.front() / term.candidate->free().front().typical;
    for (const EstimatedMaps::Map& map : term.maps->maps()) {
      const double sum = std::reduce(map.values.begin(), map.values.end());
      const double mean = scale * sum / static_cast<double>(map.values.size());
      if (map.parameter.unit == "m" && std::abs(mean) > settings.practical_threshold[distance])
        notes.push_back(
            fmt::format("The {} of {} has a mean of {:.2f} mm over the pixels: an offset of all pixels, like "
                        "zero_offset, plus a pattern with zero mean would be equivalent.",
                        map.parameter.name, term.candidate->name(), 1e3 * mean));
    }
  }
}

std::string as_well(const std::string& found, const std::string& others, const std::string& experiment) {
  const std::string advice = experiment.empty() ? "" : fmt::format(" Recommended experiment: {}.", experiment);
  return fmt::format("These data cannot distinguish {} from {}.{}", found, others, advice);
}

}  // namespace

std::vector<std::string> notes_on_found(const Problem& problem, const SearchResult& search) {
  std::vector<std::string> notes;
  if (search.found.empty()) return notes;
  note_means(search.after.state, notes);
  for (const EffectFinding& found : search.found) {
    std::map<std::string, std::vector<std::string>> tied;  // by the experiment that separates them
    for (const Rival& rival : found.rivals) {
      if (!rival.tied) continue;
      const std::string experiment = rival.separating_experiment(*found.candidate);
      if (!rival.of_several()) tied[experiment].push_back(rival.candidate->name());
      if (rival.of_several() && rival.is_listed_at(found.name))
        notes.push_back(as_well(fmt::format("{} together", fmt::join(rival.in_place_of, " and ")),
                                rival.candidate->name(), experiment));
    }
    for (const auto& [experiment, names] : tied)
      notes.push_back(as_well(found.name, fmt::format("{}", fmt::join(names, " or ")), experiment));
  }
  if (!problem.light_seen() && !problem.targets.empty()) {
    std::string values;
    for (std::size_t t = 0; t < problem.targets.size(); ++t)
      values += fmt::format("{}{:.2g} of target {}", t == 0 ? "" : ", ",
                            settings.unknown_reflectivity * std::exp(search.after.state.log_reflectivity[t]),
                            problem.targets[t]);
    notes.push_back(
        fmt::format("Reflectivities are inferred with the model, not measured: {}, where that of the first target is "
                    "taken as {}. A wrong effect makes them wrong: measuring them tests the names.",
                    values, settings.unknown_reflectivity));
  }
  return notes;
}

std::vector<std::string> notes_on(const Measurements& m, const Problem& problem) {
  std::vector<std::string> notes;
  for (const std::string& text : m.left_out) notes.push_back("Left out: " + text);
  if (!m.replicates)
    notes.push_back(
        "Some conditions have only one frame: there the noise is taken from the camera's profile, not measured.");
  if (m.noise && std::abs(std::log(m.noise->middle)) > std::log(settings.max_noise_ratio))
    notes.push_back(fmt::format(
        "The frames scatter {:.3g} times as much as the profile's read_noise and shot_noise imply ({:.3g} to {:.3g} "
        "from one condition to another). The search takes the noise from the frames, so its numbers remain valid; a "
        "simulation with this profile has the wrong noise (temporal_noise: factor). tofgraph calibrate noise measures "
        "it.",
        m.noise->middle, m.noise->least, m.noise->most));
  const tofgraph_camera& camera = m.design->camera();
  const std::vector<simulation::Vector3> rays = simulation::whole_image(camera).rays;
  const auto outside = std::ranges::count_if(rays, [](const auto& ray) { return std::isnan(ray.z); });
  if (outside > 0)
    notes.push_back(fmt::format("{:.2g} % of the pixels are outside the lens model and are excluded.",
                                100.0 * static_cast<double>(outside) / static_cast<double>(rays.size())));
  const auto listed = std::ranges::count_if(m.design->camera_pointer()->bad_pixels, [](auto bad) { return bad != 0; });
  if (listed > 0) notes.push_back(fmt::format("{} pixels are bad in the profile's map and were not used.", listed));
  if (m.bad_pixels > settings.noted_bad_pixels)
    notes.push_back(
        fmt::format("{:.2f} % of the pixels do not fit their neighbours and were not used.", 100 * m.bad_pixels));
  if (m.saturated > 0)
    notes.push_back(fmt::format("{:.2f} % of the pixels are saturated and were not used.", 100 * m.saturated));
  if (m.table)
    notes.push_back(
        "The data are one mean per condition: nothing is known about the pixels, and the variation of a board's mean "
        "from one condition to the next is estimated with the model.");
  else if (!m.taps)
    notes.push_back(m.phases ? fmt::format("{} no taps: the intensity is unknown.",
                                           m.decoded ? "Some captures have phases, the others distances, and none has"
                                                     : "The captures have phases and")
                    : problem.light_seen()
                        ? "The captures have distances and amplitudes: the intensity and the null channels are unknown."
                        : "The captures have distances only: the light and the null channels are unknown.");
  if (!measured_noise(problem, !m.table, distance).known)
    notes.push_back(
        "Repeatability unknown: there are neither frames nor conditions with the same settings, so no noise floor.");
  if (!m.design->tells_order())
    notes.push_back(
        "Not every condition states its `order`: a drift of the camera during the campaign was not tested.");
  notes_on_levels(*m.design, problem.light_seen(), notes);
  if (!problem.light_seen() && !problem.targets.empty())
    notes.push_back(fmt::format(
        "No amplitudes are known: the first target's reflectivity is taken as {}, the others' are inferred from the "
        "effects, not measured. Errors that add to the light, as crosstalk does, are relative to that.",
        settings.unknown_reflectivity));
  return notes;
}

std::vector<std::string> notes_on_nuisances(const Problem& problem, const SearchResult& search) {
  const RandomEffectSd& sd = search.after.state.random_sd;
  std::vector<std::string> notes;
  const Design& design = problem.design;
  const auto uses = [&](double RandomEffectSd::*which) { return contains(problem.nuisances.sd, which); };
  if (const double drift = drift_of(design, sd.drift), drift_light = drift_of(design, sd.drift_light);
      uses(&RandomEffectSd::drift) && (drift > settings.noted_drift || drift_light > settings.noted_drift_light) &&
      (drift_shows(problem, search.after.state, &RandomEffectSd::drift, &RandomEffectSd::jitter) ||
       drift_shows(problem, search.after.state, &RandomEffectSd::drift_light, &RandomEffectSd::light)))
    notes.push_back(
        fmt::format("The camera drifted while the conditions were measured, by {} (root mean square) as estimated by "
                    "the fit: a nuisance, not an effect.",
                    length_and_light(drift, drift_light)));
  for (const auto& [which, what] : {std::pair(&RandomEffectSd::jitter, "the positions of the boards"),
                                    {&RandomEffectSd::offset, "the camera's offsets"},
                                    {&RandomEffectSd::light, "the light"},
                                    {&RandomEffectSd::drift, "a drift of the distances"},
                                    {&RandomEffectSd::drift_light, "a drift of the light"},
                                    {&RandomEffectSd::session, "the sessions' offsets"},
                                    {&RandomEffectSd::session_light, "the sessions' light"}}) {
    const bool own =
        which == &RandomEffectSd::jitter || which == &RandomEffectSd::offset || which == &RandomEffectSd::light;
    if ((own || uses(which)) && is_at_bound(sd, which))
      notes.push_back(
          fmt::format("The standard deviation of {} is at its upper limit: it absorbs another error, and no interval "
                      "beside it can be trusted.",
                      what));
  }
  if (sd.jitter > 1.96 * problem.nuisances.jitter)  // beyond 95 % of its prior
    notes.push_back(fmt::format(
        "The positions of the boards scatter by {:.2g} mm (standard deviation), more than the jitter of {} that the "
        "campaign states.",
        1e3 * sd.jitter, config::format_quantity(problem.nuisances.jitter, "m")));
  if (uses(&RandomEffectSd::session) &&
      (sd.session > settings.noted_drift || sd.session_light > settings.noted_drift_light))
    notes.push_back(fmt::format("Sessions differ by {} (standard deviation): a nuisance, not an effect.",
                                length_and_light(sd.session, sd.session_light)));
  if (search.after.state.nuisances.boards)
    notes.push_back(
        fmt::format("The boards are not flat: each has a shape of its own, {:.2f} mm (standard deviation), that moves "
                    "with the board: a nuisance, not an effect. Effects that look like such shapes (a lens, a tilt) "
                    "may be wrong by more than their intervals.",
                    1e3 * search.after.state.nuisances.boards->sd));
  if (search.after.state.nuisances.smooth_field && !search.something_left())
    notes.push_back(
        fmt::format("Distances differ smoothly over the image by {:.2f} mm from one condition to the next (standard "
                    "deviation): a nuisance, not an effect.",
                    1e3 * search.after.state.nuisances.smooth_field->sd()));
  if (search.something_left())
    notes.push_back(
        fmt::format("From one condition to the next distances scatter by {:.2f} mm, as estimated by the fit. As an "
                    "unexplained error is left, a part of that is not noise.",
                    1e3 * std::sqrt(scatter_of(problem, search.after.state)[distance])));
  return notes;
}

std::vector<std::string> notes_on_misplaced(const Design& design, const SearchResult& search) {
  std::vector<std::string> notes;
  if (search.something_left()) return notes;
  for (const Misplaced& one : search.misplaced) {
    const io::Condition& c = design.conditions()[one.condition];
    notes.push_back(
        fmt::format("Condition {} is off by {:.1f} mm: its board is {} than the stated {:.3f} m; check this. It has a "
                    "smaller weight.",
                    c.id, 1e3 * std::abs(one.error), one.error > 0 ? "farther" : "nearer", c.board_distance));
  }
  return notes;
}

std::string note_on_contrast(const MeasuredContrast& contrast) {
  return fmt::format(
      "The profile's contrast is wrong: it is {:.3g}, these taps show {} (a / 2I). The search fits it, so that no "
      "effect absorbs it; intensities that are simulated with this profile are wrong by {:.1f} %. tofgraph calibrate "
      "response measures it.",
      contrast.profile, text_of(contrast), 100 * std::abs(contrast.value / contrast.profile - 1));
}

std::string note_on_not_written(const SearchResult& search) {
  if (search.not_better.empty()) return "";
  return fmt::format(
      "{}: {}.",
      search.is_given ? "The given model is written unchanged" : "A larger model was found and is not written",
      search.not_better);
}

std::vector<std::string> notes_on_verification(const SearchResult& search, double time_limit) {
  std::vector<std::string> notes;
  if (search.time_expired)
    notes.push_back(
        fmt::format("The time limit of {} ended the search: effects that were not reached by then are not named, the "
                    "named effects are preliminary, and no condition to measure next is proposed.",
                    config::format_quantity(time_limit, "s")));
  if (search.time_expired && !search.found.empty() && (search.cross_fit.empty() || search.cross_fit.time_expired))
    notes.push_back(fmt::format("By then {} of the folds that validate the named effects out of sample had ended.",
                                search.cross_fit.folds.size()));
  if (search.not_compared)
    notes.push_back(
        "It left no time to compare all named effects with others: effects that cannot be distinguished from them may "
        "be missing.");
  if (const std::string note = note_on_not_written(search); !note.empty()) notes.push_back(note);
  const GapComparison& written = search.verified.held_out;
  if (const double chosen = search.cross_fit.gap().after;
      !search.cross_fit.empty() && is_gap_worse(chosen, written.model))
    notes.push_back(
        fmt::format("The effects that are written, fitted without the held-out conditions, predict these with a "
                    "distance gap of {:.2f} mm; the effects that each fold chose for itself, with {:.2f} mm.",
                    1e3 * written.model, 1e3 * chosen));
  return notes;
}

std::vector<std::string> notes_on_maps(const std::vector<PixelMap>& maps) {
  std::vector<std::string> notes;
  for (const PixelMap& map : maps) {
    const bool length = map.unit == "m";
    const auto shown = [&](double value) {
      return fmt::format("{:.3g}{}{}", (length ? 1e3 : 1) * value, length || !map.unit.empty() ? " " : "",
                         length ? "mm" : map.unit);
    };
    if (std::isnan(map.noise)) {
      notes.push_back(fmt::format(
          "The map {} (maps.h5) has the values of superpixels: the frames do not resolve single pixels.", map.dataset));
      continue;
    }
    notes.push_back(fmt::format(
        "The map {} (maps.h5) has a value for each pixel: in addition to the common value of the neighbourhood, pixels "
        "differ by {}, and the frames determine each to {} (standard deviations); values are shrunk accordingly.",
        map.dataset, shown(map.spread), shown(map.noise)));
  }
  return notes;
}

}  // namespace tofgraph::diagnosis
