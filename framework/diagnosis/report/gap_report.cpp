// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/report/diagnosis.hpp"

#include "diagnosis/report/gap_report_parts.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace tofgraph::diagnosis {

namespace {

/// "crosstalk or static_reflection"; "zero_offset or warm_up for it and integration_time_offset".
std::string name_and_ties(const EffectResult& effect) {
  std::string text = effect.name;
  for (const Rival& rival : effect.rivals()) {
    if (!rival.tied) continue;
    std::vector<std::string> others = rival.in_place_of;
    std::erase(others, effect.name);
    text += " or " + rival.candidate->name();
    if (!others.empty()) text += fmt::format(" for it and {}", fmt::join(others, ", "));
  }
  return text;
}

/// "distance 5/5, target 4/4": number of folds that support an effect or a rival that explains as much.
std::string supported_by(const CrossFit& cross_fit, const EffectFinding& found) {
  const std::vector<std::string> names = found.names();
  std::vector<std::string> settings;
  std::map<std::string, std::pair<std::size_t, std::size_t>> counts;
  for (const FoldResult& fold : cross_fit.folds) {
    const std::string& setting = fold.fold.setting;
    if (counts.emplace(setting, std::pair(0, 0)).second) settings.push_back(setting);
    counts[setting].first += fold.supports(names) ? 1 : 0;
    ++counts[setting].second;
  }
  std::string text;
  for (const std::string& setting : settings)
    text += fmt::format("{}{} {}/{}", text.empty() ? "" : "\n", setting, counts[setting].first, counts[setting].second);
  return text;
}

/// Effect on the held-out gap, with a remark if few folds determine it.
std::string fall_text(const HeldOutImprovement& improvement, const Gap& of_distance) {
  const auto gap = [&](double value) { return shown_gap(value, of_distance, distance); };
  std::string text = fmt::format("{} → {}", gap(improvement.median_taken_out), gap(improvement.median_with));
  if (improvement.folds_alone > 0 && 2 * improvement.folds_alone < improvement.folds_choosing)
    text += fmt::format("\nin {} of the {} folds that chose it: the others also chose a similar effect",
                        improvement.folds_alone, improvement.folds_choosing);
  return text;
}

/// Adds the table of effects: names, values, and effect on the gap.
void add_found(report::Page& page, const Diagnosis& d) {
  std::vector<Row> rows;
  for (std::size_t t = 0; t < d.effects.size(); ++t) {
    const EffectResult& e = d.effects[t];
    std::string sizes;
    for (const ParameterResult& p : e.parameters) {
      if (!p.nonlinear) sizes += (sizes.empty() ? "" : "\n") + p.name + " " + value_text(p);
    }
    const bool added = e.found != nullptr;
    rows.push_back({name_and_ties(e), sizes, added ? fall_text(e.found->improvement, d.gaps[distance]) : "-",
                    added && !std::isnan(e.found->supported) ? supported_by(d.search.cross_fit, *e.found) : "-",
                    fmt::format("{}; {}", d.search.after.state.terms[t].candidate->descriptor().summary,
                                added ? "missing in the model" : "in the model, fitted again")});
  }
  if (rows.empty()) return;
  page.table(Row{"effect", "sizes (95 %)", "held-out gap of the median fold, without it → with it",
                 "folds that chose it", "description"},
             rows);
}

void add_gaps(report::Page& page, const Diagnosis& d) {
  std::vector<Row> rows;
  for (std::size_t o = 0; o < observables; ++o) {
    const Gap& g = d.gaps[o];
    if (!std::isfinite(g.before)) continue;
    const auto text = [&](double value) { return shown_gap(value, g, o); };
    const std::string interval =
        std::isfinite(g.held_out_low) ? fmt::format(" ({} to {})", text(g.held_out_low), text(g.held_out_high)) : "";
    rows.push_back({label(o), text(g.held_out_before), text(g.held_out_after) + interval, text(g.before), text(g.after),
                    std::isfinite(g.noise_floor) ? text(g.noise_floor) : "not measured", text(g.noise_and_scatter)});
  }
  page.table(Row{"gap of", "simulated, held out", "extended, held out (95 %)", "simulated, all data",
                 "extended, all data", "noise", "noise and scatter"},
             rows);
}

/// Adds the gaps of the conditions that were only predicted.
void add_unsearched(report::Page& page, const Diagnosis& d) {
  if (!d.unsearched) return;
  page.paragraph(text_on_unsearched(d) +
                 " They neither chose effects nor changed values; only their stated settings were compared with their "
                 "data before the search, as those of all conditions. Other sections of this report concern the "
                 "conditions that were searched.");
  std::vector<Row> rows;
  for (std::size_t o = 0; o < observables; ++o) {
    const CrossFit::Gap& gap = d.unsearched->gaps[o];
    if (std::isnan(gap.before)) continue;
    const auto text = [&](double value) { return shown_within(value, (gap.high - gap.low) / 2, o); };
    rows.push_back(
        {label(o), text(gap.before), fmt::format("{} ({} to {})", text(gap.after), text(gap.low), text(gap.high))});
  }
  if (!rows.empty()) page.table(Row{"gap, not searched, of", "simulated", "extended (95 %)"}, rows);
}

/// Adds the nuisances, which are visible in every figure.
void add_nuisances(report::Page& page, const ReportData& data) {
  const std::vector<std::string> notes = data.d.notes_on(NoteOn::nuisances);
  if (notes.empty()) return;
  page.paragraph(
      "Errors that are not effects of the camera, which may make the residuals below larger than the noise:");
  page.list(notes);
  page.paragraph(
      std::string("Standard deviations (sd) in the figures contain the noise and the errors of single conditions (its "
                  "board, its light), not errors shared by several (a drift, a session).") +
      (data.d.search.after.state.nuisances.boards ? " The extended model includes the shapes of the boards." : ""));
}

void add_confidence(report::Page& page, const Confidence& c) {
  std::string text = fmt::format(
      "Reliability of such a verdict: {} campaigns like this one were simulated and searched, each without a hidden "
      "effect or with one known effect of typical size.",
      c.cases());
  if (c.named > 0)
    text += fmt::format(" In {} an effect was named, correctly in {} (a tied effect counts as correct).", c.named,
                        c.named_right);
  if (c.silent > 0) text += fmt::format(" In {} nothing was found, correctly in {}.", c.silent, c.silent_right);
  page.paragraph(text);
}

/// Adds advice on the use of the result.
void add_use(report::Page& page, const Diagnosis& d) {
  if (d.search.found.empty()) return;
  page.paragraph(fmt::format(
      "To use it: model.yaml is the model with the effects found. 'tofgraph simulate --model model.yaml' makes "
      "the recordings of such a camera; the stage model_correction removes the camera's effects from its recordings (a "
      "tilted board or a rail is corrected in the lab). Meaning of each value: 'tofgraph describe {}'.",
      d.search.found.front().name));
}

void add_verdict(report::Page& page, const ReportData& data) {
  const Diagnosis& d = data.d;
  constexpr std::array<const char*, 5> moods = {"bad", "warn", "warn", "good", "plain"};
  page.verdict(summary(d), moods.at(static_cast<std::size_t>(d.verdict)));
  if (!d.campaign_notes.empty()) {
    page.paragraph("The campaign's notes on its data:");
    page.list(d.campaign_notes);
  }
  if (const std::vector<std::string> notes = d.notes_on(NoteOn::names); !notes.empty()) {
    page.paragraph("Meaning of the names and values:");
    page.list(notes);
  }
  if (d.confidence) add_confidence(page, *d.confidence);
  page.paragraph(
      "The gap is the RMS difference between measurement and model, over conditions (one board at one "
      "distance with one setting) and over the sensor. Distances are along the optical axis, from the sensor plane. "
      "Simulated: the given model; extended: the model with the effects found (model.yaml).");
  add_found(page, d);
  add_use(page, d);
  add_nuisances(page, data);
  const CrossFit& folds = d.search.cross_fit;
  page.paragraph(
      folds.empty()
          ? "No conditions could be held out: the gap below is that of the conditions that were fitted."
          : fmt::format(
                "Held out: {} times some levels of a setting (a fold) were held out, effects were chosen and "
                "fitted without them, and the result had to predict them (cross-fitting). This applies to the columns "
                "marked so and to the chart of each condition's gap; all other figures, and the values, are from fits "
                "to all data. Noise: from frames and repeated conditions. Noise and scatter: noise of the frames, and "
                "variation of boards, camera and light from one condition to the next, as estimated by the fit; {}.{}",
                folds.folds.size(),
                d.search.something_left() ? "it contains an unexplained error, so compare with the noise"
                                          : "a gap of this size leaves nothing to explain",
                std::isfinite(d.gaps[null1].before)
                    ? " N1 / 2I and N2 / a are the null channels: sums of the samples that are zero in an ideal "
                      "camera, relative to intensity I and amplitude a."
                    : ""));
  add_gaps(page, d);
  add_unsearched(page, d);
}

/// Adds all notes except those of other sections.
void add_notes(report::Page& page, const ReportData& data) {
  const std::vector<std::string> notes = data.d.notes_on(NoteOn::data);
  if (notes.empty()) return;
  page.heading("Notes");
  page.list(notes);
}

}  // namespace

ReportData::ReportData(const Diagnosis& diagnosis)
    : d(diagnosis), design(*diagnosis.measurements.design), problem(*diagnosis.problem) {
  State given_as_written = d.given_as_written;
  if (!given_as_written.terms.empty()) update_precomputed(problem, given_as_written);
  for (std::size_t o = 0; o < observables; ++o) {
    if (std::isfinite(d.gaps[o].before))
      evidence.emplace(o, diagnosis::evidence({problem, given_as_written}, {problem, d.search.after.state}, o));
  }
}

std::string unexplained_map(const Diagnosis& d) { return d.search.something_left() ? rest_map(ReportData(d)) : ""; }

report::Page gap_report(const Diagnosis& diagnosis) {
  const ReportData data(diagnosis);
  report::Page page("Differences between simulation and measurement");
  add_origin(page, data);
  page.heading("Verdict");
  add_verdict(page, data);
  add_curves(page, data);
  add_conditions(page, data);
  add_maps(page, data);
  add_parameters(page, data);
  add_influence(page, data);
  add_stability(page, data);
  add_rivals(page, data);
  add_rest(page, data);
  add_blind(page, data);
  add_next(page, data);
  add_notes(page, data);
  return page;
}

void add_stability(report::Page& page, const ReportData& data) {
  const std::vector<Stability>& all = data.d.stability;
  if (all.empty()) return;
  std::set<std::string> names;
  for (const Stability& one : all) {
    for (const auto& [name, runs] : one.counts()) names.insert(name);
  }
  Row header = {"held out, each time", "held-out gap, simulated", "extended (95 %)"};
  header.insert(header.end(), names.begin(), names.end());
  std::vector<Row> rows;
  for (const Stability& one : all) {
    const auto text = [&](double gap) { return shown_within(gap, (one.gap.high - one.gap.low) / 2, distance); };
    rows.push_back({one.put_aside, text(one.gap.before),
                    fmt::format("{} ({} to {})", text(one.gap.after), text(one.gap.low), text(one.gap.high))});
    std::map<std::string, std::size_t> counts = one.counts();
    for (const std::string& name : names)
      rows.back().push_back(fmt::format("{} of {}", counts[name], one.chosen.size()));
  }
  page.heading("Selection frequency of each effect");
  page.paragraph(
      "Effects were chosen again without each distance, without each target, and without random halves of the levels; "
      "the held-out conditions were predicted without being used. An effect that is chosen in few of these runs rests "
      "on single levels. An effect that is tied with it may be chosen instead.");
  page.table(header, rows);
}

void add_origin(report::Page& page, const ReportData& data) {
  const Diagnosis& d = data.d;
  std::vector<Row> rows;
  for (std::size_t i = 0; i < d.inputs.size() && i < 2; ++i)
    rows.push_back(
        {i == 0 ? "model" : "campaign",
         fmt::format("{}{} (SHA-256 {})",
                     i == 0 || d.campaign_name.empty() ? "" : fmt::format("\u201c{}\u201d, ", d.campaign_name),
                     d.inputs[i].file, d.inputs[i].sha256)});
  rows.push_back({"data", d.measurements.table
                              ? fmt::format("{} conditions, one mean each", d.conditions())
                              : fmt::format("{} conditions, {} frames", d.conditions(), d.measurements.frames)});
  if (!d.origin.command.empty()) rows.push_back({"command", d.origin.command});
  rows.push_back({"seed", fmt::format("{}", d.seed)});
  if (!d.origin.date.empty()) {
    rows.push_back({"date", d.origin.date});
    rows.push_back({"duration", fmt::format("{:.0f} s", d.origin.seconds)});
  }
  page.facts(rows);
  if (d.inputs.size() > 2) {
    page.fold(d.inputs.size() == 3 ? "The other input file with its SHA-256"
                                   : fmt::format("The other {} input files with their SHA-256", d.inputs.size() - 2));
    std::vector<Row> files;
    for (std::size_t i = 2; i < d.inputs.size(); ++i) files.push_back({d.inputs[i].file, d.inputs[i].sha256});
    page.table(Row{"file", "SHA-256"}, files);
    page.unfold();
  }
  page.contents();
}

}  // namespace tofgraph::diagnosis
