// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Campaign that consists only of statistics: a table of comma-separated values whose first line has the column names.
#include "io/campaign.hpp"

#include "config/quantity.hpp"
#include "io/table_text.hpp"

#include <fmt/format.h>
#include <tofgraph/channels.hpp>

#include <algorithm>
#include <cmath>
#include <functional>

namespace tofgraph::io {
namespace {

using config::Diagnostics;
using config::Position;
using config::Reader;
using config::Value;

/// Key of the table: its column and unit, and the destination of a row's value.
struct Column {
  std::size_t index = 0;
  std::string key;
  std::string written_unit;  ///< as in the campaign; empty for pure numbers
  std::string unit;          ///< SI
  bool required = false;     ///< in every row
  std::function<void(Condition&, double)> store;
  std::optional<double> constant = {};  ///< one value for all rows, instead of a column
};

class TableReader {
 public:
  TableReader(const config::Value& table, Campaign& campaign, config::Diagnostics& diagnostics)
      : reader_(table, diagnostics, "the table"), campaign_(campaign), diagnostics_(diagnostics) {
    const std::size_t errors = diagnostics.errors();
    const std::filesystem::path file = reader_.input_file("file", "thesis_offset_tables.csv");
    if (diagnostics.errors() == errors && table.is_map()) rows_ = read_table_rows(file);
    if (rows_.empty() && table.is_map() && diagnostics.errors() == errors)
      diagnostics.error(table.find("file")->value.at, fmt::format("{} is empty", file.string()));
    for (std::size_t i = 0; !rows_.empty() && i < rows_.front().size(); ++i) names_.push_back(rows_.front()[i].text);
  }

  void read() {
    using C = Condition;
    add("distance", "m", "{column: true_depth_mm, unit: mm}", true, [](C& c, double v) {
      c.board_distance = v;
      c.board_tilt_x = c.board_tilt_y = 0;
    });
    add("integration_time", "s", "{column: integration_time_ms, unit: ms}", false,
        [](C& c, double v) { c.integration_time = v; });
    const std::size_t before = columns_.size();
    add("measured_depth", "m", "{column: corrected_mean_mm, unit: mm}", false,
        [](C& c, double v) { c.measured.depth = v; });
    add("measured_distance", "m", "{column: measured_mean_mm, unit: mm}", false,
        [](C& c, double v) { c.measured.distance = v; });
    add("amplitude", "counts", "{column: amplitude, unit: counts}", false,
        [](C& c, double v) { c.measured.amplitude = v; });
    add("measured_depth_sd", "m", "{column: corrected_std_mm, unit: mm}", false,
        [](C& c, double v) { c.measured.depth_sd = v; });
    const bool measured = columns_.size() > before;
    add("reflectivity", "", "{column: reflectivity}", false, [](C& c, double v) { c.reflectivity = v; });
    add("count", "", "{column: pixels}", false, [](C& c, double v) { c.measured.count = v; });
    add("frames", "", "{column: frames}", false, [](C& c, double v) { c.measured.frames = v; });
    add("time_since_power_on", "s", "{column: minutes, unit: min}", false,
        [](C& c, double v) { c.time_since_power_on = v; });
    add("roi_half_width", "", "{column: roi_half_width_px}", false, [this](C& c, double v) { narrow(c, v, true); });
    add("roi_half_height", "", "{column: roi_half_height_px}", false, [this](C& c, double v) { narrow(c, v, false); });
    target_ = word_column("target", "{column: black_percent}");
    sources_ = word_column("sources", "{column: sources}");
    campaign_.corrected_with = reader_.word("corrected_with", "");
    reach_ = reader_.number_within("reach", "m", "20 mm", unknown, 1e-6, std::numeric_limits<double>::infinity());
    campaign_.from_table = true;
    reader_.finish();
    if (!measured && diagnostics_.ok())
      diagnostics_.error(
          rows_.front().front().at,
          "the table has no measured column: measured_depth, measured_distance, amplitude or measured_depth_sd",
          "example: measured_depth: {column: corrected_mean_mm, unit: mm}");
    if (diagnostics_.ok()) read_conditions();
  }

 private:
  /// Reads {column: NAME, unit: UNIT} of a key, or one value for all rows.
  void add(const std::string& key, const std::string& unit, std::string_view example, bool required,
           std::function<void(Condition&, double)> store) {
    const config::Entry* entry = required ? reader_.need(key, example) : reader_.take(key);
    if (entry == nullptr) return;
    if (entry->value.kind == config::Value::Kind::scalar) return add_constant(*entry, unit, std::move(store));
    config::Reader reader(entry->value, diagnostics_, fmt::format("'{}'", key));
    const auto index = column_of(reader, example);
    std::string written;
    if (!unit.empty()) {
      const config::Entry* given = reader.need("unit", unit == "m" ? "mm" : unit == "s" ? "ms" : unit);
      written = given != nullptr ? given->value.text : unit;
      const auto one = config::parse_quantity("1 " + written, unit);
      if (!one.ok())
        diagnostics_.error(given->value.at, fmt::format("'unit' is {}: {}", given->value.described(), one.problem),
                           fmt::format("example: {}: {}", key, example));
    }
    reader.finish();
    if (index) columns_.push_back({*index, key, written, unit, required, std::move(store)});
  }

  void add_constant(const config::Entry& entry, const std::string& unit,
                    std::function<void(Condition&, double)> store) {
    const auto value = config::parse_quantity(entry.value.text, unit);
    const std::string problem = value.ok() ? range_problem(entry.key, value.value) : value.problem;
    if (!problem.empty())
      diagnostics_.error(entry.value.at, fmt::format("'{}' is {}: {}", entry.key, entry.value.described(), problem));
    else
      columns_.push_back({0, entry.key, "", unit, false, std::move(store), value.value});
  }

  std::optional<std::size_t> column_of(config::Reader& reader, std::string_view example) {
    const config::Entry* column = reader.need("column", example);
    if (column == nullptr || names_.empty()) return std::nullopt;
    const auto found = std::ranges::find(names_, column->value.text);
    if (found != names_.end()) {
      const auto index = static_cast<std::size_t>(found - names_.begin());
      refuse_second(index);
      return index;
    }
    const bool semicolons = names_.size() == 1 && names_[0].find(';') != std::string::npos;
    diagnostics_.error(column->value.at, fmt::format("the table has no column {}", column->value.described()),
                       semicolons ? "its cells are separated by semicolons, expected commas"
                                  : config::suggestion(column->value.text, names_, "columns"));
    return std::nullopt;
  }

  /// Reports a column name that occurs twice, as it would be ambiguous.
  void refuse_second(std::size_t index) {
    const auto second = std::find(names_.begin() + static_cast<std::ptrdiff_t>(index) + 1, names_.end(), names_[index]);
    if (second == names_.end()) return;
    const config::Position& first = rows_.front()[index].at;
    diagnostics_.error(rows_.front()[static_cast<std::size_t>(second - names_.begin())].at,
                       fmt::format("the column '{}' occurs twice", names_[index]),
                       fmt::format("the first is in line {}, column {}: rename one of them", first.line, first.column));
  }

  /// Column of words; nullopt if the key is missing.
  std::optional<std::size_t> word_column(const std::string& key, std::string_view example) {
    const config::Entry* entry = reader_.take(key);
    if (entry == nullptr) return std::nullopt;
    config::Reader reader(entry->value, diagnostics_, fmt::format("'{}'", key));
    const auto column = column_of(reader, example);
    reader.finish();
    return column;
  }

  /// Sets a centred window of 2 v pixels, as in the published tables: columns w/2 - v .. w/2 + v - 1.
  void narrow(Condition& condition, double half, bool across) const {
    if (!campaign_.camera) return;  // already reported
    const tofgraph_camera& camera = campaign_.camera->view();
    if (!condition.roi) condition.roi = Roi{0, camera.width - 1, 0, camera.height - 1};
    const std::uint32_t middle = (across ? camera.width : camera.height) / 2;
    const auto v = static_cast<std::uint32_t>(half);
    (across ? condition.roi->first_column : condition.roi->first_row) = middle - v;
    (across ? condition.roi->last_column : condition.roi->last_row) = middle + v - 1;
  }

  /// Reason why a number is invalid; empty: it is valid.
  std::string range_problem(const std::string& key, double value) const {
    if (key == "distance") return detail::distance_problem(value, campaign_.camera.get());
    if ((key == "measured_depth" || key == "measured_distance") && !is_valid_length(static_cast<float>(value)))
      return "is not a length: it must be positive; an empty cell means unknown";
    if (key == "integration_time" && !(value > 0)) return "must be positive";
    if (key == "reflectivity" && !(value > 0 && value <= 1)) return "must be above 0 and at most 1";
    if ((key == "measured_depth_sd" || key == "count" || key == "time_since_power_on") && value < 0)
      return "must not be negative";
    if (key == "frames" && !(value >= 1 && value == std::floor(value))) return "must be a whole number from 1 on";
    if (key.starts_with("roi_half") && campaign_.camera) {
      const tofgraph_camera& camera = campaign_.camera->view();
      const std::uint32_t most = (key == "roi_half_width" ? camera.width : camera.height) / 2;
      if (!(value >= 1 && value <= most && value == std::floor(value)))
        return fmt::format("must be a whole number of pixels from 1 to {}", most);
    }
    return {};
  }

  void read_conditions() {
    for (std::size_t i = 1; i < rows_.size(); ++i) {
      const TableRow& row = rows_[i];
      if (row.size() != names_.size()) {
        diagnostics_.error(row.front().at,
                           fmt::format("the row has {} cells, but the first line has {}", row.size(), names_.size()));
        continue;
      }
      campaign_.conditions.push_back(read_row(row));
    }
    if (campaign_.conditions.empty() && diagnostics_.ok())
      diagnostics_.error(rows_.front().front().at, "the table has no rows below the names of its columns");
  }

  Condition read_row(const TableRow& row) {
    Condition condition;
    condition.at = row.front().at;
    condition.at.column = 0;
    condition.id = fmt::format("line {}", condition.at.line);
    for (const Column& column : columns_) {
      if (column.constant) {
        column.store(condition, *column.constant);
        continue;
      }
      const TableCell& cell = row[column.index];
      if (cell.text.empty() && !column.required) continue;
      const auto value = config::parse_quantity(fmt::format("{} {}", cell.text, column.written_unit), column.unit);
      std::string problem = value.problem;
      if (value.ok()) problem = range_problem(column.key, value.value);
      condition.places[column.key] = cell.at;
      if (problem.empty())
        column.store(condition, value.value);
      else
        diagnostics_.error(cell.at, fmt::format("the {} '{}' {}", column.key, cell.text, problem));
    }
    if (target_) {
      condition.target = row[*target_].text;
      condition.places["target"] = row[*target_].at;
    }
    if (sources_ && !row[*sources_].text.empty()) {
      read_source_words(row[*sources_].text, row[*sources_].at, campaign_.camera.get(), condition.sources,
                        diagnostics_);
      condition.places["sources"] = row[*sources_].at;
    }
    condition.measured.reach = reach_;
    return condition;
  }

  config::Reader reader_;
  Campaign& campaign_;
  config::Diagnostics& diagnostics_;
  std::vector<TableRow> rows_;
  std::vector<std::string> names_;
  std::vector<Column> columns_;
  std::optional<std::size_t> target_, sources_;
  double reach_ = unknown;  ///< m
};

}  // namespace

void detail::read_table(const config::Value& table, Campaign& campaign, config::Diagnostics& diagnostics) {
  TableReader(table, campaign, diagnostics).read();
}

}  // namespace tofgraph::io
