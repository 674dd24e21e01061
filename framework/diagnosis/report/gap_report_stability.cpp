// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/report/gap_report_parts.hpp"
#include "diagnosis/report/gap_report_values.hpp"

#include <fmt/format.h>

#include <set>

namespace tofgraph::diagnosis {

void add_stability(report::Page& page, const ReportData& data) {
  const std::vector<Stability>& all = data.d.stability;
  if (all.empty()) return;
  std::set<std::string> names;
  for (const Stability& one : all) {
    for (const auto& [name, runs] : one.chosen) names.insert(name);
  }
  Row header = {"put aside, each time", "held-out gap, simulated", "extended (95 %)"};
  header.insert(header.end(), names.begin(), names.end());
  std::vector<Row> rows;
  for (const Stability& one : all) {
    const auto text = [&](double gap) { return shown_within(gap, (one.gap.high - one.gap.low) / 2, distance); };
    rows.push_back({one.put_aside, text(one.gap.before),
                    fmt::format("{} ({} to {})", text(one.gap.after), text(one.gap.low), text(one.gap.high))});
    for (const std::string& name : names) {
      const auto found = one.chosen.find(name);
      rows.back().push_back(fmt::format("{} of {}", found == one.chosen.end() ? 0 : found->second, one.runs));
    }
  }
  page.heading("How often each effect is chosen");
  page.paragraph(
      "Effects were chosen again without each distance, without each target, and without random halves of the levels; "
      "what was put aside was predicted without being seen. An effect that is chosen in few of these runs rests on "
      "single levels. What an effect is tied with may be chosen in its place.");
  page.table(header, rows);
}

}  // namespace tofgraph::diagnosis
