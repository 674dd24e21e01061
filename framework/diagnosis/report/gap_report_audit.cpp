// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/report/gap_report_parts.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

namespace tofgraph::diagnosis {
namespace {

/// "wiggling from rail_scale", or the question about a single effect.
std::string question(const NextCondition& next) {
  if (next.effects.size() > 1) return sides_of(next, " from ");
  return asked_of(next.effects.front(), next.value);
}

/// True if the data have samples of the camera, or a table instead.
bool has_samples(const Diagnosis& d) { return d.measurements.taps || d.measurements.phases || d.measurements.table; }

/// Questions that no proposed condition answers, with advice of the effects' authors.
struct Silent {
  std::vector<std::string> values;  ///< as questions
  std::vector<std::string> blind;   ///< names
  std::vector<Row> advice;          ///< for all
};

Silent silent_questions(const Diagnosis& d) {
  Silent silent;
  for (const NextCondition& next : d.next) {
    if (tells(next)) continue;
    if (next.effects.size() > 1) continue;
    if (next.value.empty())
      silent.blind.push_back(next.effects.front());
    else
      silent.values.push_back(question(next));
    silent.advice.push_back({question(next), next.experiment});
  }
  for (const Visibility& seen : d.audit.effects) {
    const std::string name = seen.candidate->name();
    const bool listed = std::ranges::any_of(
        d.next, [&](const NextCondition& next) { return next.effects == std::vector{name} && next.value.empty(); });
    if (!seen.blind || listed) continue;
    silent.blind.push_back(name);
    silent.advice.push_back({asked_of(name), seen.candidate->border().experiment});
  }
  return silent;
}

/// Adds one sentence for all questions, and the advice, folded.
void add_silent(report::Page& page, const Silent& silent) {
  if (silent.advice.empty()) return;
  std::vector<std::string> questions = silent.values;
  if (!silent.blind.empty()) questions.push_back(asked_of(fmt::format("{}", fmt::join(silent.blind, ", or "))));
  page.paragraph(fmt::format("None of the compared conditions can determine {}.", fmt::join(questions, ", or ")));
  page.folded_table("Experiments that determine these, from experience", Row{"to know", "from experience"},
                    silent.advice);
}

/// Adds effects that look alike: pairs with an effect that was found openly, the others folded.
void add_alike(report::Page& page, const Diagnosis& d) {
  std::map<std::string, std::string> of_found;
  std::vector<Row> others;
  const auto is_found = [&](const Candidate* candidate) {
    return std::ranges::any_of(d.effects, [&](const EffectResult& e) { return e.name == candidate->name(); });
  };
  const auto add = [&](const Candidate* one, const Candidate* other, double cosine) {
    std::string& text = of_found[one->name()];
    text += fmt::format("{}{} {:.2f}", text.empty() ? "" : ", ", other->name(), cosine);
  };
  for (const Alike& pair : d.audit.alike) {
    const bool first = is_found(pair.first), second = is_found(pair.second);
    if (first) add(pair.first, pair.second, pair.cosine);
    if (second) add(pair.second, pair.first, pair.cosine);
    if (!first && !second)
      others.push_back({pair.first->name(), pair.second->name(), fmt::format("{:.2f}", pair.cosine)});
  }
  if (!of_found.empty() || !others.empty())
    page.paragraph(
        fmt::format("Some effects look alike in this campaign at their typical sizes, whatever else was measured: the "
                    "cosine between the changes they cause is above 0.9, where 1 means identical. A name stands for "
                    "all effects that look like it, until another measurement distinguishes them; \u201cOther effects "
                    "in its place\u201d shows whether they look alike at the fitted sizes.{}",
                    of_found.empty() && !d.effects.empty() ? " None of them was found." : ""));
  std::vector<Row> rows;
  for (const auto& [name, text] : of_found) rows.push_back({name, text});
  if (!rows.empty()) page.table(Row{"found", "looks like, with the cosine"}, rows);
  if (others.empty()) return;
  page.folded_table(
      fmt::format("The {} pairs {}that look alike", others.size(), of_found.empty() ? "" : "of other effects "),
      Row{"effect", "looks like", "cosine"}, others);
}

}  // namespace

void add_blind(report::Page& page, const ReportData& data) {
  page.heading("Effects that these data could not have shown");
  std::vector<std::string> unseen, too_small;
  std::vector<Row> rows;
  for (const Visibility& seen : data.d.audit.effects) {
    if (seen.blind)
      (seen.norm < settings.blind_below ? unseen : too_small).push_back(seen.candidate->name());
    else
      rows.push_back({seen.candidate->name(), fmt::format("{:.0f}", seen.norm), fmt::format("{:.2g}", seen.smallest)});
  }
  if (unseen.empty() && too_small.empty())
    page.paragraph("Each known effect of its typical size would have shown in this campaign.");
  if (!unseen.empty())
    page.paragraph(
        fmt::format("The report cannot say anything about these effects. At their typical sizes they change all data "
                    "by fewer than {} standard deviations, because they have little influence here or only change "
                    "quantities that are estimated anyway: {}.",
                    settings.blind_below, fmt::join(unseen, ", ")));
  if (!too_small.empty())
    page.paragraph(fmt::format(
        "Nor about these. They could be distinguished from noise, but at their typical sizes no condition changes by a "
        "relevant amount (0.1 mm; 0.1 % of amplitude or intensity; 0.02 % of a null channel): {}.",
        fmt::join(too_small, ", ")));
  add_alike(page, data.d);
  if (rows.empty()) return;
  page.folded_table(
      "Effects that would have shown, and their minimum sizes",
      Row{"effect", "standard deviations at its typical size", "minimum size that would be found / typical size"},
      rows);
}

void add_next(report::Page& page, const ReportData& data) {
  const Diagnosis& d = data.d;
  const Silent silent = silent_questions(d);
  std::vector<Row> rows;
  for (const NextCondition& next : d.next) {
    if (tells(next))
      rows.push_back({question(next), setting_of(next), sigmas(next) + " sd",
                      fmt::format("{:.1f} sd", next.measured_sigma),
                      shown(next.difference, next.observable, 2) + " of " + label(next.observable)});
  }
  if (rows.empty() && silent.advice.empty()) return;
  page.heading("Next measurement");
  if (const NextCondition* const first = best_condition(d.next); first != nullptr) {
    page.verdict(sentence(*first));
    page.paragraph(
        "The most informative condition is written beside this report as a scene, next_condition.yaml, for tofgraph "
        "simulate.");
  } else {
    page.verdict(
        "None of the compared conditions, at this campaign's settings or somewhat beyond them, would provide more "
        "information.");
  }
  for (const NextCondition& tie : d.next) {
    if (tie.effects.size() > 1 && !tells(tie))
      page.verdict(fmt::format(
          "None of the compared conditions can distinguish {}. Recommended, from experience: {}{}.", question(tie),
          has_samples(d) ? "" : "the samples, if the camera gives them; or ", tie.experiment));
  }
  if (!d.next.empty())
    page.paragraph(fmt::format(
        "The comparison covers {} conditions with this campaign's settings and some beyond: distances, integration "
        "times, tilts of 20 deg, targets; time since power-on, one source alone, a lamp, a covered rail, a laser, a "
        "turned camera, a capped lens. The difference between two models is given in standard deviations (sd) of one "
        "condition: noise, variation of boards and light, and the uncertainty of their values. Differences below 0.1 "
        "mm or 0.1 % are too small to rely on; below {} sd a condition provides no information.",
        d.next.front().candidates, settings.min_distinction));
  if (!rows.empty())
    page.table(Row{"to know", "the best condition", "the models differ there by", "in the conditions so far at most by",
                   "which is"},
               rows);
  add_silent(page, silent);
}

}  // namespace tofgraph::diagnosis
