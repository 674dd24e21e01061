// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/gap_report_parts.hpp"
#include "diagnosis/gap_report_values.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace tofgraph::diagnosis {
namespace {

/// "wiggling from rail_scale", or what a blind effect's question is.
std::string question(const NextCondition& next) {
  return next.effects.size() > 1 ? fmt::format("{}", fmt::join(next.effects, " from "))
                                 : "whether there is " + next.effects.front();
}

/// What no condition of the list tells, and what its author advises.
struct Silent {
  std::vector<std::string> blind;  ///< names
  std::vector<Row> advice;         ///< of these and of ties
};

Silent silent_questions(const Diagnosis& d) {
  Silent silent;
  for (const NextCondition& next : d.next) {
    if (tells(next)) continue;
    if (next.effects.size() == 1) silent.blind.push_back(next.effects.front());
    silent.advice.push_back({question(next), next.experiment});
  }
  for (const Visibility& seen : d.audit.effects) {
    const std::string name = seen.candidate->name();
    const bool listed =
        std::ranges::any_of(d.next, [&](const NextCondition& next) { return next.effects == std::vector{name}; });
    if (!seen.blind || listed) continue;
    silent.blind.push_back(name);
    silent.advice.push_back({"whether there is " + name, seen.candidate->border().experiment});
  }
  return silent;
}

/// One sentence for all, and the advice to be unfolded; that on a tie is what the reader needs, and stands there.
void add_silent(report::Page& page, const Silent& silent, const std::vector<NextCondition>& next) {
  for (const NextCondition& one : next) {
    if (one.effects.size() > 1 && !tells(one))
      page.paragraph(fmt::format("No board of this rail tells {}. What does, from experience: {}.", question(one),
                                 one.experiment));
  }
  if (silent.blind.empty()) return;
  page.paragraph(fmt::format("No board of this rail tells whether there is {}.", fmt::join(silent.blind, ", or ")));
  page.fold("What tells these, from experience");
  const Row header = {"to know", "from experience"};
  page.table(header, silent.advice);
  page.unfold();
}

}  // namespace

void add_blind(report::Page& page, const ReportData& data) {
  page.heading("What these data could not have shown");
  std::vector<std::string> unseen, too_small;
  std::vector<Row> rows;
  for (const Visibility& seen : data.d.audit.effects) {
    if (seen.blind)
      (seen.norm < blind_below ? unseen : too_small).push_back(seen.candidate->name());
    else
      rows.push_back({seen.candidate->name(), fmt::format("{:.0f}", seen.norm), fmt::format("{:.2g}", seen.smallest)});
  }
  if (unseen.empty() && too_small.empty())
    page.paragraph("Each known effect of its typical size would have shown in this campaign.");
  if (!unseen.empty())
    page.paragraph(
        fmt::format("Of these effects the report says nothing. At their typical sizes they show in fewer than {} "
                    "standard deviations of all data, because they do little here or only what is estimated anyway: "
                    "{}.",
                    blind_below, fmt::join(unseen, ", ")));
  if (!too_small.empty())
    page.paragraph(fmt::format(
        "Nor does it of these. The data would tell them from noise, but at their typical sizes no condition "
        "changes by as much as matters (0.1 mm; 0.1 % of amplitude or intensity; 0.02 % of a null "
        "channel): {}.",
        fmt::join(too_small, ", ")));
  std::vector<Row> pairs;
  for (const Alike& pair : data.d.audit.alike)
    pairs.push_back({pair.first->name(), pair.second->name(), fmt::format("{:.3f}", pair.cosine)});
  if (!pairs.empty()) {
    page.paragraph(
        "These look alike in this campaign, at their typical sizes: the cosine between what they change is above 0.9, "
        "where 1 is the same. What was found is compared as it was fitted, above.");
    const Row pair_header = {"effect", "and", "cosine"};
    page.table(pair_header, pairs);
  }
  if (rows.empty()) return;
  page.fold("What it would have shown, and from which size on");
  const Row header = {"effect", "standard deviations at its typical size",
                      "smallest that would be found / typical size"};
  page.table(header, rows);
  page.unfold();
}

void add_next(report::Page& page, const ReportData& data) {
  const Diagnosis& d = data.d;
  const Silent silent = silent_questions(d);
  std::vector<Row> rows;
  for (const NextCondition& next : d.next) {
    if (tells(next))
      rows.push_back({question(next), setting_of(next.condition), report::plain(next.sigma, 2),
                      report::plain(next.measured_sigma, 2),
                      shown(next.difference, next.observable) + " of " + label(next.observable)});
  }
  if (rows.empty() && silent.advice.empty()) return;
  page.heading("What to measure next");
  if (const NextCondition* const first = most_telling(d.next); first != nullptr) {
    page.verdict(sentence(*first));
    page.paragraph(
        "The most telling of these conditions is beside this report as a scene, next_condition.yaml, for tofgraph "
        "simulate.");
  } else {
    page.verdict("No other board at this campaign's settings, or somewhat beyond them, would tell more.");
  }
  if (!d.next.empty())
    page.paragraph(fmt::format(
        "Compared were {} conditions with this campaign's settings and some beyond: distances, integration times, "
        "tilts of 20 deg, targets, time since power-on. Two models differ there by so many standard deviations (sd) of "
        "one condition: noise, and what boards and light differ by. What is less than 0.1 mm or 0.1 % beside these "
        "does not count; below {} sd a condition tells nothing.",
        d.next.front().candidates, telling));
  const Row header = {"to know", "the best condition", "differs there by sd", "so far at most", "which is"};
  if (!rows.empty()) page.table(header, rows);
  add_silent(page, silent, d.next);
}

}  // namespace tofgraph::diagnosis
