// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The sections of the gap report, in their order. They draw what others have computed.
#pragma once

#include "diagnosis/model/evidence.hpp"
#include "diagnosis/report/diagnosis.hpp"
#include "report/page.hpp"

#include <map>

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

}  // namespace tofgraph::diagnosis
