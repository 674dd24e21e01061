// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/gap_report_audit.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tofgraph::diagnosis {
namespace {

using Row = std::vector<std::string>;

}  // namespace

void add_blind(report::Page& page, const Diagnosis& diagnosis) {
  page.heading("What these data could and could not show");
  std::vector<std::string> names;
  std::vector<Row> rows;
  for (const Visibility& seen : diagnosis.audit.effects) {
    if (seen.blind)
      names.push_back(seen.candidate->name());
    else
      rows.push_back({seen.candidate->name(), fmt::format("{:.0f}", seen.norm), fmt::format("{:.2g}", seen.smallest)});
  }
  page.paragraph(names.empty() ? std::string("No effect is hidden from them.")
                               : fmt::format("Hidden from them: {}.", fmt::join(names, ", ")));
  const Row header = {"effect", "signature at its typical size, in standard deviations",
                      "smallest that would be found, of the typical size"};
  page.table(header, rows);
  std::vector<Row> pairs;
  for (const Alike& pair : diagnosis.audit.alike)
    pairs.push_back({pair.first->name(), pair.second->name(), fmt::format("{:.3f}", pair.cosine)});
  if (pairs.empty()) return;
  page.paragraph(
      "Effects whose signatures these data hardly tell apart, at their typical sizes and in the directions in which "
      "they are most alike (what was found is compared as it was fitted, above):");
  const Row pair_header = {"effect", "and", "cosine of their signatures"};
  page.table(pair_header, pairs);
}

void add_next(report::Page& page, const Diagnosis& diagnosis) {
  std::vector<Row> rows;
  for (const EffectResult& e : diagnosis.effects) {
    if (!e.tied_with.empty())
      rows.push_back({fmt::format("{} or {}", e.name, fmt::join(e.tied_with, ", ")), e.experiment});
  }
  for (const Visibility& seen : diagnosis.audit.effects) {
    if (seen.blind) rows.push_back({"whether there is " + seen.candidate->name(), seen.candidate->border().experiment});
  }
  if (rows.empty()) return;
  page.heading("What to measure next");
  const Row header = {"to know", "measure"};
  page.table(header, rows);
}

}  // namespace tofgraph::diagnosis
