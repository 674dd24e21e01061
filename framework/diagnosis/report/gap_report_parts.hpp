// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Sections of the gap report, in their order. They draw results computed elsewhere.
#pragma once

#include "diagnosis/model/validation.hpp"
#include "diagnosis/report/diagnosis.hpp"
#include "diagnosis/search/next_condition.hpp"
#include "report/chart.hpp"
#include "report/page.hpp"

#include <map>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Data for all sections.
struct ReportData {
  explicit ReportData(const Diagnosis& diagnosis);
  ReportData(const ReportData&) = delete;
  ReportData& operator=(const ReportData&) = delete;

  const Diagnosis& d;
  const Design& design;
  const Problem& problem;
  std::map<std::size_t, Evidence> evidence;  ///< of the observables with data
};

using Row = std::vector<std::string>;

/// Value of a parameter with its interval, or the reason why it has none.
std::string value_text(const ParameterResult& parameter);

/// Adds model, campaign, command, date and files.
void add_origin(report::Page& page, const ReportData& data);
/// Adds curves of measured, simulated and extended over the distance.
void add_curves(report::Page& page, const ReportData& data);
/// Adds the held-out gap of each condition; a click on a condition shows its maps.
void add_conditions(report::Page& page, const ReportData& data);
/// Adds residuals over the sensor, in mm or percent, and in standard deviations.
void add_maps(report::Page& page, const ReportData& data);
/// Adds values with intervals and correlations, and below, other effects in place of those found.
void add_parameters(report::Page& page, const ReportData& data);
void add_influence(report::Page& page, const ReportData& data);
void add_rivals(report::Page& page, const ReportData& data);
/// Adds the frequency with which each effect is chosen on other parts of the data, if that was searched.
void add_stability(report::Page& page, const ReportData& data);
/// Adds the residual that no effect explains.
void add_rest(report::Page& page, const ReportData& data);
std::string rest_map(const ReportData& data);
/// Adds effects that these data could not show, and the conditions to measure next.
void add_blind(report::Page& page, const ReportData& data);
void add_next(report::Page& page, const ReportData& data);

// ---- Numbers and settings in the format of the gap report ----

/// Value in laboratory units (lengths in mm, times in ms, angles in deg), with two digits of its uncertainty: "4.001 mm
/// ± 0.020 mm", or "1.00 ms (0.90 ms to 2.00 ms)" if the value is off centre by more than a fifth of the half width.
/// @param unit SI @param digits without an interval
std::string with_uncertainty(double value, const Interval& interval, std::string_view unit, int digits = 3);
/// "0.4700 ± 0.0010 (statistical)"
std::string text_of(const MeasuredContrast& contrast);
/// Value with unit: lengths in mm, relative quantities in percent. @param sign true: always with a sign
std::string shown(double value, std::size_t observable, int digits = 3, bool sign = false);
/// Value with the decimals of two digits of its uncertainty; a value below that keeps two digits of its own.
std::string shown_within(double value, double uncertainty, std::size_t observable, bool sign = false);
/// Gap of one observable, with the digits that its held-out 95 % interval supports.
std::string shown_gap(double value, const Gap& gap, std::size_t observable);
/// Patterns of the distance first, the largest of each observable first. Omits patterns much larger than the gap
/// itself, because other fitted terms compensate most of them.
std::vector<Pattern> by_size(std::vector<Pattern> patterns, const std::array<Gap, observables>& gaps);
/// Value and unit in reports: lengths in mm, relative quantities in percent.
double scaled(double value, std::size_t observable);
std::string unit_of(std::size_t observable);
std::string label(std::size_t observable);

/// "board at 1.20 m, tilted by 20 deg about y, target white, 2 ms": what distinguishes a condition.
std::string setting_of(const io::Condition& condition);
/// Text of setting_of(next.condition), with the time since power-on.
std::string setting_of(const NextCondition& next);

/// Standard deviations between two models, without meaningless digits: "3.1"; "more than 100" if the campaign has
/// less.
std::string sigmas(const NextCondition& next);
/// "zero_offset with integration_time_offset" and its alternatives. @param between separator of the two: " from "
std::string sides_of(const NextCondition& next, const char* between);
/// Question about one effect: "whether there is warm_up", "the time_constant of warm_up".
/// @param value empty: question whether the effect is present
std::string asked_of(const std::string& effect, const std::string& value = "");
/// Sentence on a condition to measure, and on what it would distinguish.
std::string sentence(const NextCondition& next);

/// Mean of the finite values; NaN if there are none.
double mean(const std::vector<double>& values);

/// Limit of a map's colour scale, in mm or percent, which includes 98 % of the values.
double scale_of(const std::vector<double>& values);

/// Map over the superpixels, in mm or percent. @param sd one per superpixel, for tooltips
report::FieldMap sensor_map(const Design& design, const std::vector<double>& values, const std::vector<double>& sd,
                            std::size_t observable, const std::string& title);

}  // namespace tofgraph::diagnosis
