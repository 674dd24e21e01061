// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/report/gap_report_parts.hpp"

#include <fmt/format.h>

namespace tofgraph::diagnosis {

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
                              ? fmt::format("{} conditions, one mean each", data.design.size())
                              : fmt::format("{} conditions, {} frames", data.design.size(), d.measurements.frames)});
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
    const Row file_header = {"file", "SHA-256"};
    page.table(file_header, files);
    page.unfold();
  }
  page.contents();
}

}  // namespace tofgraph::diagnosis
