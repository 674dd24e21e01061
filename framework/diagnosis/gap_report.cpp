// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/gap_report.hpp"

#include "config/quantity.hpp"
#include "diagnosis/gap_report_audit.hpp"
#include "diagnosis/gap_report_values.hpp"
#include "diagnosis/structure.hpp"
#include "report/plot.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

namespace tofgraph::diagnosis {
namespace {

using Row = std::vector<std::string>;

class Report {
 public:
  explicit Report(const Diagnosis& d)
      : d_(d),
        design_(*d.measurements.design),
        as_it_was_(make_problem(design_, d.measurements.observations)),
        at_the_end_(as_it_was_),
        page_("Where simulation and measurement differ") {
    if (!d.search.before.state.terms.empty()) correct(as_it_was_, d.search.before.state);
    at_the_end_.correction = d.search.correction;
    at_the_end_.brightening = d.search.brightening;
  }

  report::Page make() {
    constexpr std::array<const char*, 5> moods = {"bad", "warn", "warn", "good", "plain"};
    page_.verdict(summary(d_), moods.at(static_cast<std::size_t>(d_.verdict)));
    page_.paragraph(fmt::format(
        "{} conditions, {} frames. {} conditions were put aside: the held-out gaps are those of models fitted without "
        "them. Which effects there are was asked of all conditions.",
        design_.size(), d_.measurements.frames, d_.put_aside));
    found();
    gaps();
    where();
    rivals();
    unexplained();
    add_blind(page_, d_);
    add_next(page_, d_);
    if (!d_.notes.empty()) {
      page_.heading("Notes");
      for (const std::string& note : d_.notes) page_.paragraph(note);
    }
    return std::move(page_);
  }

  /// Of the observable of the first rest: its largest component over the image where that is beyond chance, else the
  /// means of the conditions.
  std::string rest_map() const {
    std::size_t o = distance;
    if (!d_.search.rest.empty())
      o = d_.search.rest.front().observable;
    else
      while (d_.search.structure[o] == 0) ++o;
    if (d_.search.structure[o] == 0) {
      const Residuals rest = residuals(at_the_end_, d_.search.after.state, o);
      return over_conditions(rest, o, label(o) + ", what no effect explains", limit_of(rest, o));
    }
    report::HeatMap map{.title = label(o) + ", what no effect explains",
                        .unit = unit_of(o),
                        .rows = design_.pixels().rows,
                        .columns = design_.pixels().columns};
    for (const double value : leading_pattern(at_the_end_, d_.search.after.state, o))
      map.values.push_back(scaled(value, o));
    return report::heat_map(map, 340, 290);
  }

 private:
  /// Of an estimated map's scale there is none.
  static std::string interval(const ParameterResult& p) {
    if (!std::isfinite(p.interval.low)) return " of maps that were estimated";
    return fmt::format(" ({} to {})", config::format_quantity(p.interval.low, p.unit),
                       config::format_quantity(p.interval.high, p.unit));
  }

  void found() {
    const bool lacks = std::ranges::any_of(d_.effects, [](const EffectResult& e) { return e.change == "added"; });
    page_.heading(lacks || d_.effects.empty() ? "What the model lacks" : "What the model has");
    if (d_.effects.empty()) return page_.paragraph("No effect was found, and the model has none.");
    std::vector<Row> rows;
    for (const EffectResult& e : d_.effects) {
      std::string parameters;
      for (const ParameterResult& p : e.parameters)
        parameters += fmt::format("{}{} {}{}", parameters.empty() ? "" : "; ", p.name,
                                  config::format_quantity(p.value, p.unit), interval(p));
      for (const ParameterResult& p : e.fixed)
        parameters += fmt::format("; {} fixed at {}", p.name, config::format_quantity(p.value, p.unit));
      const bool added = e.change == "added";
      rows.push_back(
          {e.name, e.change, fmt::format("{}", fmt::join(e.tied_with, ", ")), parameters, e.where,
           added ? fmt::format("{} -> {}", shown(e.held_out_before, distance), shown(e.held_out_after, distance))
                 : "-"});
    }
    const Row header = {"effect",
                        "",
                        "cannot be told from",
                        "parameters (95 % interval)",
                        "seen in",
                        "held-out gap without -> with it"};
    page_.table(header, rows);
  }

  void gaps() {
    page_.heading("The gap");
    std::vector<Row> rows;
    for (std::size_t o = 0; o < observables; ++o) {
      const Gap& g = d_.gaps[o];
      if (!std::isfinite(g.before)) continue;
      rows.push_back({label(o), shown(g.before, o), shown(g.after, o), shown(g.held_out_before, o),
                      shown(g.held_out_after, o), shown(g.noise_floor, o)});
    }
    const Row header = {"root mean square", "before", "after", "held out, before", "held out, after", "noise alone"};
    page_.table(header, rows);
    page_.paragraph(
        "Noise alone: what the frames and the jitter between conditions make, as the fit needs it, over the held-out "
        "conditions. These may be quieter than all together.");
  }

  /// Rows: distances; columns: what else distinguishes conditions. The mean over a condition's image.
  std::string over_conditions(const Residuals& values, std::size_t o, const std::string& title, double limit) const {
    const bool with_time = times_are_columns();
    std::set<double> distances;
    std::map<Kind, std::size_t> kinds;
    for (const io::Condition& c : design_.conditions()) {
      distances.insert(c.board_distance);
      kinds.emplace(kind_of(c, with_time), 0);
    }
    std::size_t number = 0;
    report::HeatMap map{.title = title, .unit = unit_of(o), .rows = distances.size(), .columns = kinds.size()};
    for (auto& [kind, column] : kinds) {
      column = number++;
      const auto& [number, target, time, others] = kind;
      map.x_names.push_back(with_time ? fmt::format("{} {}{}", target, config::format_quantity(time, "s"), others)
                                      : target + others);
    }
    for (const double z : distances) map.y_names.push_back(fmt::format("{:.3g} m", z));
    std::vector<std::vector<double>> cells(map.rows * map.columns);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const io::Condition& c = design_.conditions()[i];
      const auto row = static_cast<std::size_t>(std::distance(distances.begin(), distances.find(c.board_distance)));
      cells[row * map.columns + kinds.at(kind_of(c, with_time))].push_back(mean(values[i]));
    }
    for (const auto& cell : cells) map.values.push_back(scaled(mean(cell), o));
    map.x_label = with_time ? "target, integration time, .." : "target, ..";
    map.y_label = "board";
    map.limit = limit;
    return report::heat_map(map, 570, 380);
  }

  /// What distinguishes conditions at a distance: by target (as a number where it is one), then by time.
  using Kind = std::tuple<double, std::string, double, std::string>;
  static Kind kind_of(const io::Condition& c, bool with_time) {
    std::string others;
    if (!c.sources.empty()) others += fmt::format(" {}", fmt::join(c.sources, "+"));
    if (c.ambient != "dark") others += " " + c.ambient;
    double number = 0;
    std::from_chars(c.target.data(), c.target.data() + c.target.size(), number);
    return {number, c.target, with_time ? c.integration_time : 0, others};
  }

  /// Times distinguish columns where that does not leave most of the fields empty.
  bool times_are_columns() const {
    std::set<double> distances;
    std::set<Kind> kinds;
    std::set<std::pair<double, Kind>> fields;
    for (const io::Condition& c : design_.conditions()) {
      distances.insert(c.board_distance);
      kinds.insert(kind_of(c, true));
      fields.emplace(c.board_distance, kind_of(c, true));
    }
    return 3 * fields.size() > distances.size() * kinds.size();
  }

  std::string over_pixels(const Residuals& values, std::size_t o, const std::string& title, double limit) const {
    const simulation::Pixels& pixels = design_.pixels();
    report::HeatMap map{.title = title, .unit = unit_of(o), .rows = pixels.rows, .columns = pixels.columns};
    for (std::size_t s = 0; s < pixels.size(); ++s) {
      std::vector<double> column;
      for (const auto& condition : values) column.push_back(condition[s]);
      map.values.push_back(scaled(mean(column), o));
    }
    map.limit = limit;
    return report::heat_map(map, 340, 290);
  }

  /// One limit for the pictures before and after.
  static double limit_of(const Residuals& values, std::size_t o) {
    std::vector<double> means;
    for (const auto& condition : values) means.push_back(scaled(mean(condition), o));
    const double limit = report::percentile_98(means);
    return limit > 0 ? limit : 1;
  }

  std::string curve(const Residuals& before, const Residuals& after, std::size_t o) const {
    std::map<double, std::pair<std::vector<double>, std::vector<double>>> levels;
    for (std::size_t i = 0; i < before.size(); ++i) {
      auto& [measured, extended] = levels[design_.conditions()[i].board_distance];
      measured.push_back(mean(before[i]));
      extended.push_back(mean(before[i]) - mean(after[i]));
    }
    report::Curve points{.name = "measurement", .x = {}, .y = {}, .error = {}, .points = true};
    report::Curve line{.name = "extended simulation", .x = {}, .y = {}, .error = {}, .points = false};
    report::Curve zero{.name = "simulation as it was", .x = {}, .y = {}, .error = {}, .points = false};
    for (const auto& [z, values] : levels) {
      double square = 0;
      for (const double v : values.first) square += std::pow(v - mean(values.first), 2);
      points.error.push_back(scaled(std::sqrt(square / static_cast<double>(values.first.size())), o));
      for (report::Curve* c : {&points, &line, &zero}) c->x.push_back(z);
      points.y.push_back(scaled(mean(values.first), o));
      line.y.push_back(scaled(mean(values.second), o));
      zero.y.push_back(0);
    }
    return report::curves({fmt::format("{}: difference to the simulation as it was", label(o)),
                           "board distance / m",
                           unit_of(o),
                           {zero, line, points},
                           false},
                          570, 290);
  }

  void where() {
    page_.heading("Where");
    std::vector<Row> rows;
    for (const Pattern& p : d_.search.where) {
      if (rows.size() == 12) break;
      rows.push_back({label(p.observable), p.axis, shown(p.size, p.observable), fmt::format("{:.0f} %", 100 * p.share),
                      fmt::format("{:.2g}", p.p_value)});
    }
    const Row header = {"observable", "along", "size (rms)", "share of what is beyond noise",
                        "p (sign flips of conditions)"};
    if (rows.empty())
      page_.paragraph("The gap follows no axis beyond what noise does.");
    else
      page_.table(header, rows);
    for (const std::size_t o : {distance, amplitude}) {
      if (!std::isfinite(d_.gaps[o].before)) continue;
      const Residuals before = residuals(as_it_was_, d_.search.before.state, o),
                      after = residuals(at_the_end_, d_.search.after.state, o);
      const double limit = limit_of(before, o);
      const std::vector<std::string> conditions = {over_conditions(before, o, label(o) + ", before", limit),
                                                   over_conditions(after, o, label(o) + ", after", limit)};
      page_.figures(conditions, "Measurement minus simulation: the mean over each condition's image.");
      if (design_.superpixels() > 1) {
        const std::vector<std::string> images = {over_pixels(before, o, label(o) + ", before", limit),
                                                 over_pixels(after, o, label(o) + ", after", limit)};
        page_.figures(images, "The same over the image: the mean over all conditions.");
      }
      const std::vector<std::string> lines = {curve(before, after, o)};
      page_.figures(lines, "Points: mean and spread over the conditions at a distance.");
    }
  }

  void rivals() {
    std::vector<Row> rows;
    for (const EffectResult& e : d_.effects) {
      for (const Rival& rival : e.rivals)
        rows.push_back(
            {e.name, rival.candidate->name(), fmt::format("{:.4g}", rival.deviance), rival.tied ? "tie" : "worse"});
    }
    if (rows.empty()) return;
    page_.heading("Other effects in its place");
    page_.paragraph(
        "How much worse the fit becomes when another effect stands in the place of the one that was found.");
    const Row header = {"found", "in its place", "deviance lost", ""};
    page_.table(header, rows);
  }

  void unexplained() {
    if (!d_.search.something_left()) return;
    page_.heading("What no effect explains");
    std::vector<Row> rows;
    for (const Pattern& p : d_.search.rest)
      rows.push_back({label(p.observable), p.axis, shown(p.size, p.observable), fmt::format("{:.2g}", p.p_value)});
    const Row header = {"observable", "along", "size (rms)", "p"};
    if (!rows.empty()) page_.table(header, rows);
    const std::size_t others = d_.search.patterns_without_axis();
    if (others > 0)
      page_.paragraph(fmt::format("{} pattern{} beyond noise follow{} no axis.", others, others == 1 ? "" : "s",
                                  others == 1 ? "s" : ""));
    std::string nearest;
    for (const Rival& rival : d_.search.nearest)
      nearest += fmt::format("{}{} ({:.0f} %)", nearest.empty() ? "" : ", ", rival.candidate->name(), 100 * rival.bic);
    if (!nearest.empty()) page_.paragraph("Nearest effects, and how much of it they catch: " + nearest + ".");
    std::vector<std::string> figures;
    for (std::size_t o = 0; o < observables; ++o) {
      if (!std::isfinite(d_.gaps[o].before) || design_.superpixels() < 2) continue;
      const Residuals rest = residuals(at_the_end_, d_.search.after.state, o);
      figures.push_back(over_pixels(rest, o, label(o) + ", what is left", limit_of(rest, o)));
    }
    if (!figures.empty()) page_.figures(figures, "What is left over the image, the mean over all conditions.");
    const std::vector<std::string> shape = {rest_map()};
    page_.figures(shape,
                  "The largest of what is left. Over the image its sign may change from one condition to the next.");
  }

  const Diagnosis& d_;
  const Design& design_;
  Problem as_it_was_, at_the_end_;  ///< with what the centres of superpixels miss of the model
  report::Page page_;
};

}  // namespace

std::string unexplained_map(const Diagnosis& d) { return d.search.something_left() ? Report(d).rest_map() : ""; }

report::Page gap_report(const Diagnosis& diagnosis) { return Report(diagnosis).make(); }

}  // namespace tofgraph::diagnosis
