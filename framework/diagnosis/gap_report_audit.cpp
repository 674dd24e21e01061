// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/gap_report_parts.hpp"
#include "diagnosis/gap_report_values.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace tofgraph::diagnosis {
namespace {

/// "wiggling or rail_scale", or what a blind effect's question is.
std::string question(const NextCondition& next) {
  return next.effects.size() > 1 ? fmt::format("{}", fmt::join(next.effects, " or "))
                                 : "whether there is " + next.effects.front();
}

}  // namespace

void add_blind(report::Page& page, const ReportData& data) {
  page.heading("What these data could not have shown");
  std::vector<std::string> names;
  std::vector<Row> rows;
  for (const Visibility& seen : data.d.audit.effects) {
    if (seen.blind)
      names.push_back(seen.candidate->name());
    else
      rows.push_back({seen.candidate->name(), fmt::format("{:.0f}", seen.norm), fmt::format("{:.2g}", seen.smallest)});
  }
  page.paragraph(names.empty()
                     ? std::string("Each known effect of its typical size would have shown in this campaign.")
                     : fmt::format("Of these effects the report says nothing: at their typical sizes they change too "
                                   "little in this campaign, or only what is estimated anyway (below 5 standard "
                                   "deviations): {}.",
                                   fmt::join(names, ", ")));
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
  std::vector<Row> rows;
  for (const NextCondition& next : d.next)
    rows.push_back({question(next), next.sigma < telling ? "none of the list tells" : setting_of(next.condition),
                    fmt::format("{:.1f}", next.sigma), fmt::format("{:.1f}", next.measured_sigma), next.experiment});
  for (const Visibility& seen : d.audit.effects) {
    const std::string name = seen.candidate->name();
    const bool listed =
        std::ranges::any_of(d.next, [&](const NextCondition& next) { return next.effects == std::vector{name}; });
    if (seen.blind && !listed)
      rows.push_back({"whether there is " + name, "no board shows it", "-", "-", seen.candidate->border().experiment});
  }
  if (rows.empty()) return;
  page.heading("What to measure next");
  if (const NextCondition* const first = most_telling(d.next); first != nullptr) {
    page.verdict(sentence(*first));
    page.paragraph(
        "The most telling of these conditions is beside this report as a scene, next_condition.yaml, for tofgraph "
        "simulate.");
  } else {
    page.verdict(
        "No other board at this campaign's settings, or somewhat beyond them, would tell more; the last column may.");
  }
  if (!d.next.empty())
    page.paragraph(fmt::format(
        "Compared were {} conditions with this campaign's settings and some beyond: distances, integration times, "
        "tilts "
        "of 20 deg, targets, time since power-on. Two models differ there by so many standard deviations (sd) of one "
        "condition: noise, and what boards and light differ by. What is less than 0.1 mm or 0.1 % beside these does "
        "not "
        "count; below {} sd a condition tells nothing.",
        d.next.front().candidates, telling));
  const Row header = {"to know", "the best condition", "differs there by sd", "so far at most", "or, from experience"};
  page.table(header, rows);
}

}  // namespace tofgraph::diagnosis
