// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The sections of the gap report, in their order. They draw what others have computed.
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

/// Data that all sections draw.
struct ReportData {
  explicit ReportData(const Diagnosis& diagnosis);
  ReportData(const ReportData&) = delete;
  ReportData& operator=(const ReportData&) = delete;

  const Diagnosis& d;
  const Design& design;
  Problem problem;
  std::map<std::size_t, Evidence> evidence;  ///< of the observables that the data have
};

using Row = std::vector<std::string>;

/// A parameter's value with its interval, or why there is none.
std::string value_text(const ParameterResult& parameter);

/// Model, campaign, command, date, files.
void add_origin(report::Page& page, const ReportData& data);
/// Measured, simulated and extended over the distance.
void add_curves(report::Page& page, const ReportData& data);
/// The gap of each condition out of fold; a condition's maps at a click.
void add_conditions(report::Page& page, const ReportData& data);
/// Residuals over the sensor, in mm or percent, and in standard deviations.
void add_maps(report::Page& page, const ReportData& data);
/// Values with intervals and correlations; other effects in the place of those that were found.
void add_parameters(report::Page& page, const ReportData& data);
void add_influence(report::Page& page, const ReportData& data);
void add_rivals(report::Page& page, const ReportData& data);
/// Frequency with which each effect is chosen on other parts of the data, where that was asked for.
void add_stability(report::Page& page, const ReportData& data);
/// Residual that no effect explains.
void add_rest(report::Page& page, const ReportData& data);
std::string rest_map(const ReportData& data);
/// Effects that these data could not show, and the conditions to measure next.
void add_blind(report::Page& page, const ReportData& data);
void add_next(report::Page& page, const ReportData& data);

// ---- Numbers and settings as the gap report shows them ----

/// Lengths in mm, what is relative in percent.
std::string shown(double value, std::size_t observable, int digits = 3);
/// The same with its sign, as of a residual.
std::string shown_signed(double value, std::size_t observable);
/// The same with as many decimals as two digits of its uncertainty have; of a value below that, two digits of its own.
std::string shown_within(double value, double uncertainty, std::size_t observable, bool sign = false);
/// A gap of one observable, in the digits that its 95 % interval out of fold leaves.
std::string shown_gap(double value, const Gap& gap, std::size_t observable);
/// Patterns of the distance first, and of each observable the largest first. Those that are far larger than the gap
/// itself are left out: something else beside them takes most of them back.
std::vector<Pattern> by_size(std::vector<Pattern> patterns, const std::array<Gap, observables>& gaps);
double scaled(double value, std::size_t observable);
std::string unit_of(std::size_t observable);
std::string label(std::size_t observable);

/// "board at 1.20 m, tilted by 20 deg about y, target white, 2 ms": what distinguishes a condition.
std::string setting_of(const io::Condition& condition);
/// Likewise, and how long the camera was on.
std::string setting_of(const NextCondition& next);

/// Standard deviations between two models, without numbers that say nothing more: "3.1"; "more than 100" where the
/// campaign has less.
std::string sigmas(const NextCondition& next);
/// "zero_offset with integration_time_offset" and what may stand for them. @param between the two: " from "
std::string sides_of(const NextCondition& next, const char* between);
/// Question about one effect: "whether there is warm_up", "the time_constant of warm_up".
/// @param value empty: whether it is there at all
std::string asked_of(const std::string& effect, const std::string& value = "");
/// Sentence on a condition to measure, and what it would distinguish.
std::string sentence(const NextCondition& next);

/// Mean of those that are finite; NaN when none is.
double mean(const std::vector<double>& values);

/// The end of a map's colours: 98 % of the values, in mm or percent, are within it.
double scale_of(const std::vector<double>& values);

/// Values over the superpixels, in mm or percent. @param sd one a superpixel, for tooltips
report::FieldMap sensor_map(const Design& design, const std::vector<double>& values, const std::vector<double>& sd,
                            std::size_t observable, const std::string& title);

}  // namespace tofgraph::diagnosis
