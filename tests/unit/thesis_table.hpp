// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The published board means of the reference, and statistics over its windows.
#pragma once

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace test {

/// A row of the table for one depth: modelled distance over a centred window, in metres.
struct ModelledBoard {
  double depth = 0;
  int half_width = 0, half_height = 0;
  double mean = 0, deviation = 0;
};

/// The 15 depths of the white board: 14 of the fixture, and one whose row appears only in the reference's text.
inline std::vector<ModelledBoard> modelled_boards() {
  std::ifstream file(TOFGRAPH_SOURCE_DIR "/tests/fixtures/thesis_offset_tables.csv");
  if (!file) throw std::runtime_error("tests/fixtures/thesis_offset_tables.csv is not there");
  std::string line, cell;
  std::vector<std::string> names;
  std::getline(file, line);
  for (std::stringstream cells(line); std::getline(cells, cell, ',');) names.push_back(cell);
  std::vector<ModelledBoard> boards;
  while (std::getline(file, line)) {
    std::map<std::string, std::string> row;
    std::stringstream cells(line);
    for (const std::string& name : names) row[name] = std::getline(cells, cell, ',') ? cell : "";
    if (row["black_percent"] != "0") continue;
    boards.push_back({std::atof(row["true_depth_mm"].c_str()) * 1e-3, std::atoi(row["roi_half_width_px"].c_str()),
                      std::atoi(row["roi_half_height_px"].c_str()), std::atof(row["modelled_mean_mm"].c_str()) * 1e-3,
                      std::atof(row["modelled_std_mm"].c_str()) * 1e-3});
  }
  boards.push_back({7.5, 14, 7, 7.50306, 2.20e-3});
  return boards;
}

struct Statistics {
  double mean = 0, deviation = 0;  ///< standard deviation with n - 1
};

/// Mean and standard deviation of value(row, column) over columns 102-hw .. 102+hw-1, rows 102-hh .. 102+hh-1.
template <class Value> Statistics over_window(int half_width, int half_height, Value&& value) {
  std::vector<double> all;
  for (int row = 102 - half_height; row < 102 + half_height; ++row) {
    for (int column = 102 - half_width; column < 102 + half_width; ++column) {
      all.push_back(value(static_cast<std::size_t>(row), static_cast<std::size_t>(column)));
    }
  }
  Statistics result;
  for (const double v : all) result.mean += v / static_cast<double>(all.size());
  for (const double v : all) result.deviation += (v - result.mean) * (v - result.mean);
  result.deviation = std::sqrt(result.deviation / static_cast<double>(all.size() - 1));
  return result;
}

}  // namespace test
