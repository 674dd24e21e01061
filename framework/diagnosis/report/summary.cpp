// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Result of a search in a sentence, and its files for other commands.
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

std::string list_of(const std::vector<std::string>& names) { return fmt::format("{}", fmt::join(names, ", ")); }

/// Reduction of the distance gap if it exceeds noise and scatter, else that of the observable with the largest
/// reduction relative to them.
std::string shrunk(const Diagnosis& d) {
  const bool aside = !d.search.cross_fit.empty();
  const auto ends = [&](std::size_t o) {
    const Gap& g = d.gaps[o];
    return aside ? std::pair(g.held_out_before, g.held_out_after) : std::pair(g.before, g.after);
  };
  const auto noise = [&](std::size_t o) { return d.gaps[o].noise_and_scatter; };
  const auto fall = [&](std::size_t o) {
    const auto [before, after] = ends(o);
    return (before * before - after * after) / std::pow(noise(o), 2);
  };
  std::size_t most = distance;
  for (std::size_t o = 1; o < observables && !(fall(distance) > 1); ++o) {
    if (fall(o) > fall(most)) most = o;
  }
  const char* repeated =
      std::isnan(d.gaps[most].noise_floor)
          ? "{} scatter from one condition to the next, and without repeated measurements the noise cannot be separated"
          : "noise and scatter alone leave {}";
  const auto digits = [&](double value) { return shown_gap(value, d.gaps[most], most); };
  const std::string rest = fmt::format(fmt::runtime(repeated), digits(noise(most)));
  return fmt::format("the {} gap {}goes from {} to {}, {}", observable_labels[most],
                     aside ? "on held-out conditions " : "", digits(ends(most).first), digits(ends(most).second), rest);
}

/// Changed values of the model's own effects: "wiggling amplitude 6 mm -> 4 mm".
std::string refitted(const Diagnosis& d) {
  std::vector<std::string> changes;
  const std::vector<Term>& given = d.given->terms();
  for (std::size_t t = 0; t < given.size() && t < d.effects.size(); ++t) {
    for (std::size_t k = 0; k < d.effects[t].parameters.size(); ++k) {
      const ParameterResult& p = d.effects[t].parameters[k];
      const std::vector<double>& written = given[t].values;  // without added refinements, which come last
      const double before = k < written.size() ? written[k] : d.search.after.state.terms[t].candidate->free()[k].off;
      if (before < p.interval.low || before > p.interval.high)
        changes.push_back(fmt::format("{} {} {} -> {}", d.effects[t].name, p.name,
                                      with_uncertainty(before, {NAN, NAN}, p.unit),
                                      with_uncertainty(p.value, p.interval, p.unit)));
    }
  }
  return list_of(changes);
}

/// Statement of agreement. Without repeated measurements the residual cannot be separated from noise, so no agreement
/// is claimed.
std::string agreement(const Diagnosis& d) {
  const Gap& gap = d.gaps[distance];
  if (!std::isnan(gap.noise_floor))
    return fmt::format(
        "The model agrees with these data within their accuracy: the distance gap is {}, noise and scatter alone leave "
        "{}.",
        shown_gap(gap.before, gap, distance), shown_gap(gap.noise_and_scatter, gap, distance));
  return fmt::format(
      "No effect is named. The difference of {} between measurement and simulation may or may not be noise: nothing "
      "was measured twice.",
      shown_gap(gap.before, gap, distance));
}

/// Clause on an effect that fits, but with undetermined values: "warm_up fits, but ..."; else "".
std::string undetermined_text(const Diagnosis& d) {
  const std::vector<EffectFinding>& dropped = d.search.dropped;
  const auto fits =
      std::ranges::find_if(dropped, [](const EffectFinding& one) { return one.undetermined.has_value(); });
  if (fits == dropped.end()) return "";
  const std::string& experiment = fits->candidate->border().experiment;
  return fmt::format("no effect is named: {} fits, but {}{}", fits->name, fits->refutation,
                     experiment.empty() ? "" : " (recommended experiment: " + experiment + ")");
}

/// Size of the gap and largest unexplained pattern, for results without a named effect.
std::string not_known(const Diagnosis& d) {
  const Gap& gap = d.gaps[distance];
  const std::string fits = undetermined_text(d);
  std::string text = fmt::format("Measurement and simulation differ, and {}. The distance gap is {}",
                                 fits.empty() ? "no known effect explains the difference" : fits,
                                 shown_gap(gap.before, gap, distance));
  text += std::isfinite(gap.noise_floor)
              ? fmt::format(", noise alone makes {}.", shown_gap(gap.noise_floor, gap, distance))
              : ", and the part of it that is noise is unknown.";
  const std::vector<Pattern> rest = by_size(d.search.rest, d.gaps);
  if (rest.empty()) return text;
  const Pattern& p = rest.front();
  return fmt::format("{} Largest residual: {}, {} (root mean square).", text, name_of(p),
                     shown_gap(p.size, d.gaps[p.observable], p.observable));
}

/// "warm_up of unknown time_constant" if the conditions do not determine a parameter of the rival; else its name.
std::string text_of(const Rival& rival) {
  std::string name = rival.candidate->name();
  if (!rival.undetermined) return name;
  const std::size_t term = term_of(rival.state, *rival.candidate);
  if (term == rival.state.terms.size()) return name;
  return fmt::format("{} of unknown {}", name, rival.state.terms[term].candidate->free()[*rival.undetermined].name);
}

/// Measurement that decides the first tie, "To tell zero_offset from warm_up, measure a board at 0.56 m"; "": no tie.
std::string deciding(const Diagnosis& d) {
  for (const NextCondition& next : d.next) {
    if (next.effects.size() > 1 && tells(next))
      return fmt::format(" To tell {}, measure a {}.", sides_of(next, " from "), setting_of(next));
  }
  for (const EffectResult& effect : d.effects) {
    const Rival* const tie = effect.main_tie();
    const std::string experiment = tie != nullptr ? tie->separating_experiment(*effect.found->candidate) : "";
    if (!experiment.empty())
      return fmt::format(" To tell {} from {}: {}.", effect.name, tie->candidate->name(), experiment);
  }
  return "";
}

/// "wiggling", "crosstalk (or static_reflection)". Several effects with a common alternative are joined at the
/// first: "zero_offset with integration_time_offset (or warm_up)"; the others then only list alternatives of their
/// own.
std::string with_ties(const EffectResult& effect) {
  std::vector<std::string> own;
  std::string together;
  bool reported = false;
  for (const Rival& rival : effect.rivals()) {
    if (!rival.tied) continue;
    if (!rival.of_several())
      own.push_back(text_of(rival));
    else if (rival.is_listed_at(effect.name))
      together = fmt::format("{} (or {})", fmt::join(rival.in_place_of, " with "), text_of(rival));
    else
      reported = true;
  }
  const std::string alone = own.empty() ? effect.name : fmt::format("{} (or {})", effect.name, list_of(own));
  if (together.empty()) return reported && own.empty() ? "" : alone;
  return own.empty() ? together : together + ", " + alone;
}

/// Added effects by gain: those that most random halves of the data choose, and the others.
struct Names {
  std::vector<std::string> sure, weak;
};

Names names_of(const Diagnosis& d) {
  Names names;
  std::vector<const EffectResult*> added;
  for (const EffectResult& effect : d.effects) {
    if (effect.found != nullptr) added.push_back(&effect);
  }
  std::ranges::stable_sort(added, std::greater<>{}, [](const EffectResult* effect) { return effect->found->gain; });
  for (const EffectResult* effect : added) {
    const std::string text = with_ties(*effect);
    if (text.empty()) continue;
    if (effect->is_weak())
      names.weak.push_back(
          fmt::format("{}, chosen in {:.0f} % of random halves of the data", text, 100 * effect->chosen_by_halves));
    else
      names.sure.push_back(text);
  }
  return names;
}

std::string outcome(const Diagnosis& d) {
  const auto [sure, weak] = names_of(d);
  const std::string lacks = sure.empty() ? "No effect is certain" : "The model lacks " + list_of(sure);
  const std::string also =
      weak.empty() ? "" : " Weakly supported, but kept in the written model: " + list_of(weak) + ".";
  const std::string shrink = shrunk(d);
  switch (d.verdict) {
    case Verdict::named:
      return fmt::format("{}: {}.{}", lacks, shrink, also);
    case Verdict::tie:
      return fmt::format("{}: {}.{} Effects in brackets would explain these data equally well.{}", lacks, shrink, also,
                         deciding(d));
    case Verdict::named_with_rest:
      return fmt::format("{}, and an unexplained residual is left: {}.{}", lacks, shrink, also);
    case Verdict::unknown:
      return not_known(d);
    default:
      if (refitted(d).empty()) return agreement(d);
      return fmt::format("No effect is missing, but the model's own values are wrong: {}; {}.", refitted(d), shrink);
  }
}

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

const Rival* EffectResult::main_tie() const {
  const Rival* main = nullptr;
  for (const Rival& rival : rivals()) {
    if (rival.tied && (main == nullptr || rival.of_several())) main = &rival;
  }
  return main;
}

std::vector<std::string> Diagnosis::notes_on(NoteOn section) const {
  std::vector<std::string> texts;
  for (const Note& note : notes) {
    if (note.on == section) texts.push_back(note.text);
  }
  return texts;
}

std::string_view verdict_name(Verdict verdict) {
  constexpr std::array<std::string_view, 5> names = {"unknown", "named_with_rest", "tie", "named", "nothing_found"};
  return names[static_cast<std::size_t>(verdict)];
}

std::string text_on_unsearched(const Diagnosis& d) {
  if (!d.unsearched) return "";
  const std::string searched =
      fmt::format("{} of {} conditions were searched", d.measurements.design->size(), d.conditions());
  const CrossFit::Gap& gap = d.unsearched->gaps[distance];
  if (std::isnan(gap.before)) return searched + "; the others were not predicted.";
  const auto text = [&](double value) { return shown_within(value, (gap.high - gap.low) / 2, distance); };
  return fmt::format("{}; the distance gap of the other {}, to which nothing was fitted, goes from {} to {}.", searched,
                     d.unsearched->conditions, text(gap.before), text(gap.after));
}

std::string summary(const Diagnosis& d) {
  constexpr std::size_t reported = 3;  // misplaced boards; the notes list all
  const std::vector<std::string> misplaced = notes_on_misplaced(*d.measurements.design, d.search);
  std::string text = outcome(d);
  if (d.unsearched) text += " " + text_on_unsearched(d);
  for (std::size_t i = 0; i < std::min(reported, misplaced.size()); ++i) text += " " + misplaced[i];
  if (misplaced.size() > reported)
    text += fmt::format(" {} more conditions are wrong in the same way, see the notes.", misplaced.size() - reported);
  if (d.contrast && d.contrast->profile_is_off())
    text += fmt::format(" The profile's contrast is wrong: {:.3g}, these taps show {}.", d.contrast->profile,
                        text_of(*d.contrast));
  if (const std::string note = note_on_not_written(d.search); !note.empty()) text += " " + note;
  if (d.search.time_expired)
    text += fmt::format(" The time limit of {} ended the search.", config::format_quantity(d.time_limit, "s"));
  return text;
}

// ---- The extended model with its maps, and a scene of the next condition to measure ----

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
