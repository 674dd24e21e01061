// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/log.hpp"
#include "config/quantity.hpp"
#include "inspection/inspection.hpp"
#include "report/chart.hpp"
#include "report/page.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::inspection {
namespace {

std::string size_text(double size) { return std::isfinite(size) ? fmt::format("{:.4g} mm", 1e3 * size) : "-"; }

std::string headline(const Inspection& inspection) {
  const Observation& o = inspection.observation;
  return fmt::format("{}: {}, {} x {} px, {}{} of the camera {}", inspection.name, config::counted(o.frames, "frame"),
                     o.width, o.height, o.channel, o.decoded ? " (decoded from the raw images)" : "",
                     o.camera->view().name);
}

/// Map of the deviations of the blocks from planes over the image, mm.
std::string map_of(const Inspection& inspection, const std::vector<double>& rest, const std::string& title) {
  const Surfaces& s = inspection.surfaces;
  report::FieldMap map{.title = title, .unit = "mm"};
  map.columns = inspection.observation.width / s.side;
  map.rows = inspection.observation.height / s.side;
  map.fields.resize(map.rows * map.columns, {std::nan(""), "", {}});
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const Block& block = s.blocks[i];
    report::Field& field = map.fields[block.row / s.side * map.columns + block.column / s.side];
    field.value = 1e3 * rest[i];
    field.title = fmt::format("column {}, row {}: {:.2f} mm", block.column, block.row, 1e3 * rest[i]);
  }
  map.limit = std::max(1e3 * report::percentile_98(rest), 0.1);
  return report::field_map(map, 420, 360);
}

}  // namespace

std::string text_of(const Inspection& inspection) {
  std::string text = headline(inspection) + "\n";
  if (inspection.findings.empty()) text += "\nNo defect was found in this scene.\n";
  for (std::size_t i = 0; i < inspection.findings.size(); ++i) {
    const Finding& f = inspection.findings[i];
    text += fmt::format("\n{}. {}: {}\n     evidence: {}\n     size:     {}\n     mend:     {}\n", i + 1, f.kind,
                        f.text, f.evidence, size_text(f.size), f.mend);
  }
  if (!inspection.undecided.empty()) text += "\nCannot be decided from this scene:\n";
  for (const std::string& question : inspection.undecided) text += "  " + question + "\n";
  text += "\nMeasured:\n";
  for (const std::string& fact : inspection.facts) text += "  " + fact + "\n";
  return text;
}

nlohmann::json json_of(const Inspection& inspection) {
  using nlohmann::json;
  const auto number = [](double value) { return std::isfinite(value) ? json(value) : json(nullptr); };
  json findings = json::array();
  for (const Finding& f : inspection.findings)
    findings.push_back({{"kind", f.kind},
                        {"text", f.text},
                        {"evidence", f.evidence},
                        {"mend", f.mend},
                        {"size_m", number(f.size)},
                        {"explained", number(f.explained)}});
  return {{"format", "tofgraph-inspection"},
          {"version", 1},
          {"file", inspection.name},
          {"channel", inspection.observation.channel},
          {"frames", inspection.observation.frames},
          {"findings", findings},
          {"undecided", inspection.undecided},
          {"facts", inspection.facts}};
}

void write_page(const Inspection& inspection, const std::filesystem::path& file) {
  report::Page page("Inspection of " + inspection.name);
  const auto& findings = inspection.findings;
  page.verdict(findings.empty() ? std::string("No defect was found in this scene.") : findings[0].text,
               findings.empty() ? "good" : "warn");
  page.paragraph(headline(inspection));
  if (!findings.empty()) {
    page.heading("Findings");
    const std::vector<std::string> header = {"finding", "evidence", "size", "correction"};
    std::vector<std::vector<std::string>> rows;
    for (const Finding& f : findings) rows.push_back({f.text, f.evidence, size_text(f.size), f.mend});
    page.table(header, rows);
  }
  if (!inspection.stated_rest.empty()) {
    page.heading("Where");
    std::vector<std::string> maps = {
        map_of(inspection, inspection.stated_rest, "deviation from planes with noise, as stated")};
    if (!inspection.best_rest.empty())
      maps.push_back(map_of(inspection, inspection.best_rest, "with the first assumption: " + inspection.best));
    page.figures(maps, "Each field is a part of a plane; grey parts belong to no plane that is large enough.");
  }
  if (!inspection.undecided.empty()) {
    page.heading("Cannot be decided from this scene");
    page.list(inspection.undecided);
  }
  page.heading("Measured");
  page.list(inspection.facts);
  page.write(file);
}

}  // namespace tofgraph::inspection
