// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Evaluation against planes as text, JSON and HTML.
#include "calibration/plane_evaluation.hpp"
#include "config/log.hpp"
#include "config/quantity.hpp"
#include "report/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::calibration {
namespace {

using EvaluationRows = std::vector<std::vector<std::string>>;

std::string millimetre_text(double metres) { return std::isfinite(metres) ? fmt::format("{:.2f}", metres * 1e3) : "-"; }

const std::vector<std::string> summary_header = {
    "",          "conditions",        "bias, mm", "mean |bias|, mm", "max |bias|, mm", "flatness, mm",
    "noise, mm", "rms of a frame, mm"};

std::vector<std::string> row_of(const ErrorSummary& s, const std::string& state) {
  return {s.name + state,
          fmt::format("{}", s.conditions),
          millimetre_text(s.bias),
          millimetre_text(s.mean_magnitude),
          millimetre_text(s.largest),
          millimetre_text(s.flatness),
          millimetre_text(s.noise),
          millimetre_text(s.rms)};
}

using Summaries = std::vector<ErrorSummary> (*)(const PlaneEvaluation&);

std::vector<ErrorSummary> only_all(const PlaneEvaluation& evaluation) { return {summary_of_all(evaluation)}; }

/// Groups of both campaigns; rows of the same name are adjacent.
EvaluationRows rows_of(const EvaluationResult& result, Summaries summaries) {
  EvaluationRows rows;
  const std::vector<ErrorSummary> before = result.before ? summaries(*result.before) : std::vector<ErrorSummary>{};
  for (const ErrorSummary& now : summaries(result.now)) {
    const auto other = std::ranges::find(before, now.name, &ErrorSummary::name);
    if (other != before.end()) rows.push_back(row_of(*other, ", before"));
    rows.push_back(row_of(now, other != before.end() ? ", after" : ""));
  }
  return rows;
}

struct Group {
  const char* name;
  Summaries summaries;
};
constexpr Group groups[] = {
    {"All boards", only_all}, {"By distance", summary_by_distance}, {"By radius in the image", summary_by_radius}};

std::string text_table(const EvaluationRows& rows) {
  std::vector<std::size_t> widths;
  for (const std::vector<std::string>& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], row[k].size());
  }
  std::string text;
  for (const std::vector<std::string>& row : rows) {
    for (std::size_t k = 0; k < row.size(); ++k)
      text += k == 0 ? fmt::format("{:<{}}", row[k], widths[k]) : fmt::format("  {:>{}}", row[k], widths[k]);
    text += "\n";
  }
  return text;
}

/// null for unknown values, because JSON has no NaN.
nlohmann::json number_or_null(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

nlohmann::json json_of(const DepthErrors& e) {
  return {{"bias", number_or_null(e.bias)},
          {"flatness", number_or_null(e.flatness)},
          {"noise", number_or_null(e.noise)},
          {"rms", number_or_null(e.rms)},
          {"pixels", e.pixels}};
}

nlohmann::json json_of(const ErrorSummary& s) {
  return {{"name", s.name},
          {"conditions", s.conditions},
          {"bias", number_or_null(s.bias)},
          {"mean_abs_bias", number_or_null(s.mean_magnitude)},
          {"max_abs_bias", number_or_null(s.largest)},
          {"flatness", number_or_null(s.flatness)},
          {"noise", number_or_null(s.noise)},
          {"rms", number_or_null(s.rms)}};
}

nlohmann::json json_of(const std::vector<ErrorSummary>& summaries) {
  nlohmann::json list = nlohmann::json::array();
  for (const ErrorSummary& s : summaries) list.push_back(json_of(s));
  return list;
}

nlohmann::json json_of(const PlaneEvaluation& evaluation) {
  nlohmann::json conditions = nlohmann::json::array();
  for (const EvaluatedCondition& c : evaluation.conditions) {
    nlohmann::json one = json_of(c.all);
    one.update({{"id", c.condition.id},
                {"distance", number_or_null(c.condition.board_distance)},
                {"target", c.condition.target},
                {"channel", c.channel},
                {"frames", c.frames},
                {"missing", c.missing},
                {"predicted_noise", number_or_null(c.predicted_noise)},
                {"by_radius", nlohmann::json::array()}});
    for (const DepthErrors& ring : c.rings) one["by_radius"].push_back(json_of(ring));
    conditions.push_back(std::move(one));
  }
  return {{"campaign", evaluation.file.string()},
          {"camera", evaluation.campaign.camera->view().name},
          {"serial", evaluation.serial},
          {"all", json_of(summary_of_all(evaluation))},
          {"by_distance", json_of(summary_by_distance(evaluation))},
          {"by_radius", json_of(summary_by_radius(evaluation))},
          {"ring_ends_px", evaluation.ring_ends},
          {"conditions", std::move(conditions)},
          {"left_out", evaluation.notes}};
}

/// Plots a quantity of each condition over the distance, before and after.
std::string plot_of(const EvaluationResult& result, const char* title, double DepthErrors::*value) {
  report::Chart plot{.title = title, .x_label = "distance of the board, m", .y_label = "mm"};
  const auto add = [&](const PlaneEvaluation& evaluation, const char* name) {
    report::Series curve{.name = name, .style = report::Series::Style::points};
    for (const EvaluatedCondition& c : evaluation.conditions) {
      if (!std::isfinite(c.all.*value)) continue;
      curve.add(c.condition.board_distance, c.all.*value * 1e3);
    }
    if (!curve.marks.empty()) plot.series.push_back(std::move(curve));
  };
  if (result.before) add(*result.before, "before");
  add(result.now, result.before ? "after" : "");
  return plot.series.empty() ? std::string() : report::chart(plot);
}

std::string shape_of(const PlaneEvaluation& evaluation, const char* title) {
  std::vector<double> millimetres;
  for (const double v : evaluation.shape) millimetres.push_back(v * 1e3);
  const tofgraph_camera& camera = evaluation.campaign.camera->view();
  return report::field_map(report::pixel_map(title, "mm", camera.height, camera.width, millimetres, true));
}

EvaluationRows condition_rows(const PlaneEvaluation& evaluation) {
  EvaluationRows rows;
  for (const EvaluatedCondition& c : evaluation.conditions)
    rows.push_back({c.condition.id, config::format_quantity(c.condition.board_distance, "m"), c.condition.target,
                    c.channel, fmt::format("{}", c.frames), fmt::format("{:.2f}", 100 * c.missing),
                    millimetre_text(c.all.bias), millimetre_text(c.all.flatness), millimetre_text(c.all.noise),
                    millimetre_text(c.predicted_noise), millimetre_text(c.all.rms)});
  return rows;
}

void add_conditions(report::Page& page, const PlaneEvaluation& evaluation, const std::string& heading) {
  static const std::vector<std::string> header = {"condition", "distance",           "target",   "from",
                                                  "frames",    "missing, %",         "bias, mm", "flatness, mm",
                                                  "noise, mm", "recorded sigma, mm", "rms, mm"};
  page.heading(heading);
  const EvaluationRows rows = condition_rows(evaluation);
  page.table(header, rows);
  for (const std::string& note : evaluation.notes) page.paragraph(note);
}

}  // namespace

std::string evaluation_table(const EvaluationResult& result) {
  std::string text;
  for (const Group& group : groups) {
    EvaluationRows rows = rows_of(result, group.summaries);
    rows.insert(rows.begin(), summary_header);
    rows.front().front() = group.name;
    text += (text.empty() ? "" : "\n") + text_table(rows);
  }
  return text;
}

nlohmann::json evaluation_json(const EvaluationResult& result) {
  nlohmann::json json = {{"format", "tofgraph-evaluation"}, {"version", 1}, {"unit", "m"}};
  json.update(json_of(result.now));
  json["before"] = result.before ? json_of(*result.before) : nlohmann::json();
  return json;
}

report::Page evaluation_report(const EvaluationResult& result) {
  report::Page page("Depths against known planes");
  const ErrorSummary now = summary_of_all(result.now);
  std::string verdict = fmt::format("Bias {} mm on average and {} mm at most, flatness {} mm, noise of a frame {} mm",
                                    millimetre_text(now.mean_magnitude), millimetre_text(now.largest),
                                    millimetre_text(now.flatness), millimetre_text(now.noise));
  if (result.before) {
    const ErrorSummary before = summary_of_all(*result.before);
    verdict += fmt::format("; before: bias {} mm and {} mm, flatness {} mm, noise {} mm",
                           millimetre_text(before.mean_magnitude), millimetre_text(before.largest),
                           millimetre_text(before.flatness), millimetre_text(before.noise));
  }
  page.verdict(verdict + ".");
  page.paragraph(fmt::format(
      "Campaign {}, camera '{}'{}{}, {}. The bias is the mean error of the depth over the board; the flatness is the "
      "standard deviation of the pixels' mean errors, with the noise of the mean taken out; the noise is the standard "
      "deviation of a pixel from frame to frame.",
      result.now.file.string(), result.now.campaign.camera->view().name, result.now.serial.empty() ? "" : ", serial ",
      result.now.serial, config::counted(result.now.conditions.size(), "condition")));
  for (const Group& group : groups) {
    page.heading(group.name);
    const EvaluationRows rows = rows_of(result, group.summaries);
    page.table(summary_header, rows);
  }
  std::vector<std::string> plots = {plot_of(result, "bias", &DepthErrors::bias),
                                    plot_of(result, "flatness", &DepthErrors::flatness),
                                    plot_of(result, "noise of a frame", &DepthErrors::noise)};
  std::erase(plots, std::string());
  page.heading("Over the distance");
  page.figures(plots, "Each point is one condition.");
  page.heading("Over the image");
  std::vector<std::string> maps;
  if (result.before) maps.push_back(shape_of(*result.before, "before"));
  maps.push_back(shape_of(result.now, result.before ? "after" : "error less bias"));
  page.figures(maps, "Mean over the conditions of a pixel's error, less the bias of the condition.");
  add_conditions(page, result.now, "Conditions");
  if (result.before) add_conditions(page, *result.before, "Conditions before");
  return page;
}

}  // namespace tofgraph::calibration
