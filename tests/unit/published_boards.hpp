// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The 84 boards of tables 6.2 to 6.13 of the reference, with the reflectivities assumed by the calibration made
/// from them: 0.85 for the white sheet, 0.06 for the black one.
#pragma once

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace tofgraph::tests {

using CsvRow = std::map<std::string, std::string>;

/// A table of tests/fixtures, indexed by the names in its first line.
inline std::vector<CsvRow> published_rows(const std::string& name) {
  std::ifstream file(TOFGRAPH_SOURCE_DIR "/tests/fixtures/" + name);
  std::string line, cell;
  std::vector<std::string> names;
  std::getline(file, line);
  std::erase(line, '\r');
  for (std::stringstream cells(line); std::getline(cells, cell, ',');) names.push_back(cell);
  std::vector<CsvRow> rows;
  while (std::getline(file, line)) {
    std::erase(line, '\r');
    std::stringstream cells(line);
    CsvRow& row = rows.emplace_back();
    for (const std::string& key : names) row[key] = std::getline(cells, cell, ',') ? cell : "";
  }
  return rows;
}

/// Target names in the calibration: white, black_12.5, .., black_100.
inline std::string paper_of(const CsvRow& row) {
  const std::string& percent = row.at("black_percent");
  return percent == "0" ? "white" : "black_" + percent;
}

/// SI units.
struct PublishedBoard {
  std::string target;
  double distance, time, reflectivity;
  double measured, deviation;  ///< mean depth after the non-linearity correction, and its standard deviation
};

inline std::vector<PublishedBoard> published_boards() {
  std::vector<PublishedBoard> boards;
  for (const CsvRow& row : published_rows("thesis_offset_tables.csv")) {
    const auto number = [&](const char* key) { return std::atof(row.at(key).c_str()); };
    const double black = number("black_percent") / 100;
    boards.push_back({paper_of(row), number("true_depth_mm") * 1e-3, number("integration_time_ms") * 1e-3,
                      0.85 * (1 - black) + 0.06 * black, number("corrected_mean_mm") * 1e-3,
                      number("corrected_std_mm") * 1e-3});
  }
  return boards;
}

}  // namespace tofgraph::tests
