// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/json_text.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/report/gap_report_parts.hpp"
#include "io/palettes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

namespace tofgraph::diagnosis {
namespace {

using report::Series;

constexpr double sigma_limit = 5;                              ///< sd: maps of all campaigns have the same scale
constexpr std::size_t fewest_of_target = 3, max_targets = 12;  ///< targets with their own curve
constexpr int half_width = 560, full_width = 860;              ///< px, of a chart

/// Conditions in order of board distance; those without a board last.
std::vector<std::size_t> by_distance(const Design& design) {
  std::vector<std::size_t> order(design.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) {
    return design.conditions()[i].is_capped() ? INFINITY : design.conditions()[i].board_distance;
  });
  return order;
}

/// Conditions with a board, in order of distance.
std::vector<std::size_t> boards_by_distance(const Design& design) {
  std::vector<std::size_t> order = by_distance(design);
  std::erase_if(order, [&](std::size_t i) { return design.conditions()[i].is_capped(); });
  return order;
}

/// Expectation of a model for conditions in the given order: a line if conditions at the same distance hardly differ,
/// else a tick for each. A line through means over different targets would correspond to no board.
Series expected_series(const Design& design, const std::vector<std::size_t>& order,
                       const std::vector<Evidence::Mean>& means, double Evidence::Mean::*which, std::size_t o) {
  std::map<double, std::vector<double>> levels;
  double low = INFINITY, high = -INFINITY, spread = 0;
  Series line{.style = Series::Style::line}, ticks{.style = Series::Style::ticks};
  for (const std::size_t i : order) {
    const io::Condition& c = design.conditions()[i];
    const double value = scaled(means[i].*which, o);
    ticks.marks.push_back({.x = c.board_distance,
                           .y = value,
                           .title = fmt::format("{}: {}\n{}", c.id, setting_of(c), shown(means[i].*which, o, 3, true)),
                           .condition = i});
    if (!std::isfinite(value)) continue;
    levels[c.board_distance].push_back(value);
    low = std::min({low, value, scaled(means[i].measured, o)});
    high = std::max({high, value, scaled(means[i].measured, o)});
  }
  for (const auto& [z, values] : levels) {
    const auto [least, greatest] = std::ranges::minmax(values);
    spread = std::max(spread, greatest - least);
    line.marks.push_back({.x = z, .y = mean(values)});
  }
  constexpr double hardly = 0.03;  // fraction of the figure's height
  return spread > hardly * (high - low) ? ticks : line;
}

/// True if two series coincide, so that one would hide the other.
bool alike(const Series& one, const Series& other) {
  if (one.marks.size() != other.marks.size()) return false;
  double span = 0, separation = 0;
  for (std::size_t i = 0; i < one.marks.size(); ++i) {
    if (!std::isfinite(one.marks[i].y) || !std::isfinite(other.marks[i].y)) continue;
    span = std::max(span, std::abs(one.marks[i].y));
    separation = std::max(separation, std::abs(one.marks[i].y - other.marks[i].y));
  }
  constexpr double rounding = 1e-4, of_span = 1e-3;
  return separation < std::max(rounding, of_span * span);
}

/// Adds both models, or a single series labelled accordingly if they coincide.
void join(report::Chart& chart, Series simulated, Series extended) {
  const bool same = alike(simulated, extended);
  if (same) simulated.name = "simulated and extended (the same)";
  if (!same) chart.series.push_back(std::move(extended));
  chart.series.push_back(std::move(simulated));
}

/// Chart of measured, simulated and extended for these conditions, in order of distance.
std::string curve(const ReportData& data, std::size_t o, const std::vector<std::size_t>& order,
                  const std::string& title, int width) {
  const Evidence& e = data.evidence.at(o);
  Series points{"measured", Series::Style::points, {}, report::of_measured};
  for (const std::size_t i : order) {
    const io::Condition& c = data.design.conditions()[i];
    const Evidence::Mean& m = e.means[i];
    const auto text = [&](double value) { return shown_within(value, m.sd, o, true); };
    points.marks.push_back(
        {.x = c.board_distance,
         .y = scaled(m.measured, o),
         .error = scaled(1.96 * m.sd, o),
         .title = fmt::format("{}: {}\nmeasured {}, simulated {}, extended {}\n"
                              "standard deviation {}; {} sd from the extended model",
                              c.id, setting_of(c), text(m.measured), text(m.simulated), text(m.extended),
                              shown(m.sd, o, 2), report::plain((m.measured - m.extended) / m.sd, 2, true)),
         .condition = i});
  }
  Series simulated = expected_series(data.design, order, e.means, &Evidence::Mean::simulated, o);
  Series extended = expected_series(data.design, order, e.means, &Evidence::Mean::extended, o);
  simulated.name = "simulated", simulated.colour = report::of_simulated;
  extended.name = "extended", extended.colour = report::of_extended;
  if (simulated.style == Series::Style::line) simulated.style = Series::Style::dashes;
  report::Chart chart{.title = title,
                      .x_label = "distance of the board / m",
                      .y_label = fmt::format("{} error / {}", label(o), unit_of(o)),
                      .series = {points}};
  join(chart, std::move(simulated), std::move(extended));
  constexpr int height = 300;
  return report::chart(chart, width, height);
}

/// Adds a distance chart for each target, if several have enough conditions.
void add_targets(report::Page& page, const ReportData& data) {
  std::map<std::pair<double, std::string>, std::vector<std::size_t>> targets;  // sorted by number if they have one
  for (const std::size_t i : boards_by_distance(data.design)) {
    const std::string& target = data.design.conditions()[i].target;
    double number = 0;
    std::from_chars(target.data(), target.data() + target.size(), number);
    targets[{number, target}].push_back(i);
  }
  std::erase_if(targets, [](const auto& target) { return target.second.size() < fewest_of_target; });
  if (targets.size() < 2 || targets.size() > max_targets) return;
  std::vector<std::string> charts;
  for (const auto& [target, order] : targets)
    charts.push_back(
        curve(data, distance, order, fmt::format("{}, target {}", label(distance), target.second), half_width));
  page.fold("Each target by itself");
  page.figures(charts);
  page.unfold();
}

/// Chart of the held-out gap of each condition, for both models.
std::string gap_chart(const ReportData& data, const std::vector<HeldOutGap>& gaps) {
  Series simulated{"simulated", Series::Style::points, {}, report::of_simulated};
  Series extended{"extended", Series::Style::points, {}, report::of_extended};
  for (const std::size_t i : by_distance(data.design)) {
    const io::Condition& c = data.design.conditions()[i];
    const std::string title = fmt::format("{}: {}\ngap, held out: simulated {}, extended {}", c.id, setting_of(c),
                                          shown(gaps[i].before, distance, 2), shown(gaps[i].after, distance, 2));
    const double place = static_cast<double>(simulated.marks.size()) + 1;
    simulated.marks.push_back({place, scaled(gaps[i].before, distance), 0, title, i});
    extended.marks.push_back({place, scaled(gaps[i].after, distance), 0, title, i});
  }
  report::Chart chart{.title = "distance gap of each condition, held out",
                      .x_label = "conditions, from the nearest board to the farthest",
                      .y_label = "gap / mm",
                      .series = {},
                      .with_zero = true};
  join(chart, std::move(simulated), std::move(extended));
  return report::chart(chart, std::max(half_width, static_cast<int>(90 + 9 * data.design.size())));
}

/// The only script of the report: shows the maps of a clicked condition. Needs `grid` (superpixels per row), `palette`
/// (rgb from -1 to 1), `conditions` (id, simulated, extended, sd in mm; null: unknown), `sigmaLimit` (of maps in sd), a
/// select "condition" and an element "condition-maps".
constexpr const char* condition_script = R"js(
const panel = document.getElementById("condition-maps"), choice = document.getElementById("condition");
function colour(share) {
  const at = Math.min(Math.max(share, 0), 1) * (palette.length - 1), k = Math.min(Math.floor(at), palette.length - 2);
  return "rgb(" + [0, 1, 2].map(j => Math.round(palette[k][j] * (k + 1 - at) + palette[k + 1][j] * (at - k))) + ")";
}
function escaped(text) { return text.replace(/&/g, "&amp;").replace(/</g, "&lt;"); }
function map(c, values, title, limit, inSd) {
  const side = 264 / grid;
  let body = "";
  values.forEach((v, s) => {
    const known = v !== null, x = s % grid * side, y = Math.floor(s / grid) * side + 24, ratio = v / c.sd[s];
    const at = `${c.id}, row ${Math.floor(s / grid) + 1}, column ${s % grid + 1}`;
    const tip = known ? `${at}: ${v} mm, standard deviation ${c.sd[s]} mm (${ratio.toFixed(1)} sd)` : `${at}: nothing was measured here`;
    body += `<rect x="${x}" y="${y}" width="${side + 0.3}" height="${side + 0.3}" shape-rendering="crispEdges" ` +
      `fill="${known ? colour(0.5 + (inSd ? ratio : v) / (2 * limit)) : "#aaa"}"><title>${escaped(tip)}</title></rect>`;
  });
  const unit = inSd ? "sd" : "mm";
  return `<svg class="chart" role="img" aria-label="${title}" width="276" height="310" viewBox="0 0 276 310" font-size="12" ` +
    `font-family="system-ui, sans-serif"><text class="ink" x="0" y="14" font-weight="600">${title}</text>${body}` +
    `<text class="ink" x="0" y="305">blue: -${limit} ${unit}, white: 0, red: +${limit} ${unit}</text></svg>`;
}
function show(i) {
  const c = conditions[i], sizes = c.simulated.filter(v => v !== null).map(Math.abs);
  const limit = Number(Math.max(...sizes, 1e-3).toPrecision(2));
  const models = String(c.simulated) === String(c.extended) ? [["simulated or extended", c.simulated]]
    : [["simulated", c.simulated], ["extended", c.extended]];
  choice.value = i;
  panel.innerHTML = models.map(([name, values]) => map(c, values, `measured - ${name}`, limit, false)).join("") +
    models.map(([name, values]) => map(c, values, `measured - ${name}, in sd`, sigmaLimit, true)).join("");
}
choice.addEventListener("change", () => show(Number(choice.value)));
document.addEventListener("click", event => {
  const mark = event.target.closest("[data-condition]");
  if (!mark) return;
  show(Number(mark.dataset.condition));
  choice.scrollIntoView({block: "nearest"});
});
show(Number(choice.value));
)js";

std::string numbers(const std::vector<double>& values, std::size_t o) {
  std::string text;
  for (const double v : values)
    text += (text.empty() ? "" : ",") + (std::isfinite(v) ? report::plain(scaled(v, o)) : std::string("null"));
  return "[" + text + "]";
}

/// Text as a script literal, with < escaped so that it cannot end the script.
std::string for_script(const std::string& text) {
  std::string result;
  for (const char c : config::json_text(nlohmann::json(text))) result += c == '<' ? "\\u003c" : std::string(1, c);
  return result;
}

void add_click(report::Page& page, const ReportData& data) {
  const Evidence& e = data.evidence.at(distance);
  std::string options, list, palette;
  for (const std::size_t i : by_distance(data.design)) {
    const io::Condition& c = data.design.conditions()[i];
    options += fmt::format("<option value=\"{}\">{}</option>", i, report::escaped(c.id + ": " + setting_of(c)));
  }
  for (std::size_t i = 0; i < data.design.size(); ++i)
    list += fmt::format("{}{{\"id\":{},\"simulated\":{},\"extended\":{},\"sd\":{}}}", i == 0 ? "" : ",\n",
                        for_script(data.design.conditions()[i].id), numbers(e.before[i], distance),
                        numbers(e.after[i], distance), numbers(e.sd[i], distance));
  for (const io::Colour colour : io::signed_colours)
    palette += fmt::format("{}[{},{},{}]", palette.empty() ? "" : ",", colour >> 16U & 0xffU, colour >> 8U & 0xffU,
                           colour & 0xffU);
  page.insert(fmt::format(
      "<p><label>Distance residuals of one condition over the sensor; choose it here or by a click on any of its "
      "marks: <select id=\"condition\">{}</select></label></p>\n<figure><div id=\"condition-maps\">The maps need a "
      "browser that runs scripts.</div></figure>\n<script>\nconst grid = {}, palette = [{}], sigmaLimit = {}, "
      "conditions = [{}];{}</script>\n",
      options, data.design.pixels().columns, palette, sigma_limit, list, condition_script));
}

std::string in_words(const std::vector<std::string>& effects) {
  return effects.empty() ? "nothing" : fmt::format("{}", fmt::join(effects, ", "));
}

void add_folds(report::Page& page, const ReportData& data) {
  std::vector<Row> rows;
  for (const FoldResult& result : data.d.search.cross_fit.folds) {
    const HeldOutGap gap = result.gap();
    rows.push_back({fmt::format("{} {}", result.fold.setting, result.fold.levels),
                    result.fold.extrapolates ? "beyond the others" : "between the others or beside them",
                    std::to_string(result.fold.held.size()), shown(gap.before, distance, 2),
                    shown(gap.after, distance, 2), !result.failed.empty() ? result.failed : in_words(result.chosen),
                    in_words(result.missed)});
  }
  if (rows.empty()) return;
  page.folded_table("Predictions of held-out conditions",
                    Row{"held out", "where that lies", "conditions", "simulated", "extended", "chosen without it",
                        "set of all data, if it is better without it, too"},
                    rows);
}

void add_observable(report::Page& page, const ReportData& data, std::size_t o) {
  const Evidence& e = data.evidence.at(o);
  std::vector<double> sizes;
  for (const auto* map : {&e.map_before, &e.map_after}) {
    for (const double value : *map) sizes.push_back(scaled(value, o));
  }
  const double limit = scale_of(sizes);
  const bool same = std::ranges::equal(e.map_before, e.map_after, [&](double one, double other) {
    return !(std::abs(scaled(one - other, o)) > 1e-3 * limit);
  });
  constexpr int width = 276, height = 240;  // px: four figures per row
  std::vector<std::string> maps, of_sigma;
  for (const auto& [values, which] : {std::pair(&e.map_before, "simulated"), std::pair(&e.map_after, "extended")}) {
    report::FieldMap map =
        sensor_map(data.design, *values, e.map_sd, o, fmt::format("{}, {}", label(o), same ? "both models" : which));
    map.limit = limit;
    maps.push_back(report::field_map(map, width, height));
    map.title += ", in sd";
    map.unit = "sd";
    map.limit = sigma_limit;
    for (std::size_t s = 0; s < values->size(); ++s) map.fields[s].value = (*values)[s] / e.map_sd[s];
    of_sigma.push_back(report::field_map(map, width, height));
    if (same) break;
  }
  std::ranges::copy(of_sigma, std::back_inserter(maps));
  page.figures(maps);
}

}  // namespace

void add_curves(report::Page& page, const ReportData& data) {
  page.heading("Over the distance");
  page.paragraph(
      "Errors of the camera, against an ideal one that looks at the same board: measured (each condition, mean over "
      "its image; the bar is its 95 % interval from noise and from the variation of boards and light), simulated and "
      "extended: a line, or a tick for each condition if those at one distance differ. All data were fitted: nothing "
      "is held out here.");
  std::vector<std::string> charts;
  const bool two = data.evidence.contains(amplitude);
  for (const std::size_t o : {distance, amplitude}) {
    if (data.evidence.contains(o))
      charts.push_back(curve(data, o, boards_by_distance(data.design), label(o), two ? half_width : full_width));
  }
  page.figures(charts,
               "Point at a mark: its condition, values and standard deviation; all charts mark the same condition.");
  add_targets(page, data);
}

void add_conditions(report::Page& page, const ReportData& data) {
  page.heading("Condition by condition");
  const auto gaps = gaps_by_condition(data.d.search.cross_fit, data.design.size());
  if (data.d.search.cross_fit.empty()) {
    page.paragraph("No conditions could be held out: there is no gap of conditions that the search has not used.");
  } else {
    const std::vector<std::string> charts = {gap_chart(data, gaps)};
    page.figures(
        charts,
        "Root mean square over the condition's image. Held out: each condition is predicted by models that were "
        "chosen and fitted without its level.");
  }
  add_folds(page, data);
  if (data.design.superpixels() > 1) add_click(page, data);
}

void add_maps(report::Page& page, const ReportData& data) {
  if (data.design.superpixels() < 2) return;
  page.heading("Over the sensor");
  page.paragraph(
      "Residuals, measured minus simulated and measured minus extended, mean over all conditions, on one scale. Beside "
      "them the same in standard deviations (sd) of that mean: values within 3 sd are compatible with chance, beyond 5 "
      "sd the colours do not change any more. All data were fitted: nothing is held out here.");
  bool folded = false;
  for (const auto& [o, e] : data.evidence) {
    if (o == intensity) {
      page.fold("Intensity and null channels");
      folded = true;
    }
    add_observable(page, data, o);
  }
  if (folded) page.unfold();
}

}  // namespace tofgraph::diagnosis
