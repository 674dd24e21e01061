// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/validation.hpp"
#include "diagnosis/report/gap_report_parts.hpp"
#include "report/chart.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tofgraph::diagnosis {
namespace {

constexpr std::size_t max_bars = 10;        ///< conditions of an effect
constexpr std::size_t max_correlated = 16;  ///< parameters in a figure
constexpr double correlated = 0.9;

std::string remark(const ParameterResult& p) {
  if (p.status == ParameterStatus::not_determined) return "the data do not change its initial value";
  return p.status == ParameterStatus::consistent_with_zero
             ? "contains zero: the value without effect lies within the interval"
             : "";
}

/// Typical value with two digits, because it is only an order of magnitude.
std::string typical_text(const ParameterResult& p) { return with_uncertainty(p.typical, {NAN, NAN}, p.unit, 2); }

/// Forest plot of amplitudes in units of their typical values.
std::string forest(const Diagnosis& d) {
  std::vector<report::Span> spans;
  for (const EffectResult& e : d.effects) {
    for (const ParameterResult& p : e.parameters) {
      if (p.nonlinear || !std::isfinite(p.interval.low) || p.status == ParameterStatus::not_determined) continue;
      const auto relative = [&](double v) { return (v - p.off) / std::abs(p.typical - p.off); };
      spans.push_back({e.name + " " + p.name,
                       fmt::format("{} {}: {} (95 %)\ntypical: {}", e.name, p.name, value_text(p), typical_text(p)),
                       relative(p.value), relative(p.interval.low), relative(p.interval.high)});
    }
  }
  return spans.empty() ? "" : report::forest(spans, "size / typical size (dashed: none, typical)", {-1, 0, 1}, 620);
}

void add_correlations(report::Page& page, const Diagnosis& d) {
  std::vector<std::string> names;
  for (const EffectResult& e : d.effects) {
    for (const ParameterResult& p : e.parameters) names.push_back(e.name + " " + p.name);
  }
  const Eigen::MatrixXd matrix = correlations(d.search.after);
  if (matrix.rows() < 2) return;
  std::string pairs;
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = i + 1; j < matrix.cols(); ++j) {
      if (std::abs(matrix(i, j)) > correlated)
        pairs += fmt::format("{}{} with {} ({:+.2f})", pairs.empty() ? "" : "; ", names[static_cast<std::size_t>(i)],
                             names[static_cast<std::size_t>(j)], matrix(i, j));
    }
  }
  page.paragraph(pairs.empty()
                     ? fmt::format("No two values have a correlation above {}.", correlated)
                     : fmt::format("Correlation above {}, so that one is known only together with the other: {}.",
                                   correlated, pairs));
  if (names.size() > max_correlated) return;
  report::FieldMap map{.title = "correlations of the values", .rows = names.size(), .columns = names.size()};
  map.limit = 1;
  map.x_names = map.y_names = names;
  map.write_values = true;
  for (std::size_t i = 0; i < names.size() * names.size(); ++i) {
    const double value =
        matrix(static_cast<Eigen::Index>(i / names.size()), static_cast<Eigen::Index>(i % names.size()));
    map.fields.push_back(
        {value, fmt::format("{} and {}: {:+.3f}", names[i / names.size()], names[i % names.size()], value)});
  }
  const int side = 210 + 42 * static_cast<int>(names.size());
  const std::vector<std::string> picture = {report::field_map(map, side + 60, side - 20)};
  page.figures(picture);
}

/// Bars of the conditions that contribute most to an effect's gain.
std::string influence_bars(const ReportData& data, const EffectResult& e) {
  std::vector<std::size_t> order(e.influence.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::greater<>{}, [&](std::size_t i) { return e.influence[i]; });
  std::vector<report::Span> spans;
  for (const std::size_t i : order) {
    if (spans.size() == max_bars) break;
    const io::Condition& c = data.design.conditions()[i];
    spans.push_back({c.id + ": " + setting_of(c), fmt::format("{}: {:.1f} % of the gain", c.id, 100 * e.influence[i]),
                     100 * e.influence[i], 0, 0, i});
  }
  return report::bars(spans, e.name + ": share of the gain / %", 860);
}

/// Sentence with the number of conditions that yield half of an effect's gain.
std::string half_of(const EffectResult& e) {
  std::vector<double> shares = e.influence;
  std::ranges::sort(shares, std::greater<>{});
  double sum = 0;
  std::size_t count = 0;
  while (count < shares.size() && sum < 0.5) sum += shares[count++];
  return fmt::format("Half of the gain of {} comes from {} of {} conditions.", e.name, count, shares.size());
}

std::string deviance_text(double deviance) {
  constexpr double tenths_matter = 20, beyond_doubt = 1000;  // deviances differ by less than 10 in a tie
  if (deviance > beyond_doubt) return fmt::format("above {}", beyond_doubt);
  if (deviance >= tenths_matter) return report::plain(deviance, 2);
  return fmt::format("{:.1f}", std::round(10 * deviance) / 10 + 0.0);  // avoids "-0.0"
}

/// Chart over the distance of the difference between a rival's model and the extended model.
std::string distance_chart(const ReportData& data, const Rival& rival) {
  const State& extended = data.d.search.after.state;
  const State other = comparable_with(extended, rival.state);
  const Column change = difference(expected(data.problem, other), expected(data.problem, extended));
  const auto sigma = differences_in_sigma(data.problem, {{}, extended, other, {}});
  report::Series points{"", report::Series::Style::points, {}, report::of_neither};
  for (std::size_t i = 0; i < change.size(); ++i) {
    if (!data.design.shows_board(i)) continue;
    const io::Condition& c = data.design.conditions()[i];
    std::vector<double> depths;
    for (std::size_t s = 0; s < data.design.superpixels(); ++s)
      depths.push_back(scaled(change[i][s] / data.design.shift(i)[s], distance));
    points.marks.push_back({c.board_distance, mean(depths), 0,
                            fmt::format("{}: {}\n{} mm; {} sd over the whole condition", c.id, setting_of(c),
                                        report::plain(mean(depths), 3, true), report::plain(sigma[i], 2)),
                            i});
  }
  return report::chart(
      {.title = fmt::format("{} minus {}", rival.candidate->name(), fmt::join(rival.in_place_of, " with ")),
       .x_label = "distance of the board / m",
       .y_label = "difference of the expected distances / mm",
       .series = {points},
       .with_zero = true},
      560);
}

}  // namespace

std::string value_text(const ParameterResult& p) {
  if (!std::isfinite(p.interval.low))
    return with_uncertainty(p.value, p.interval, p.unit) + ", scales maps that were estimated";
  if (p.status == ParameterStatus::not_determined) return "not determined";
  return with_uncertainty(p.value, p.interval, p.unit);
}

void add_parameters(report::Page& page, const ReportData& data) {
  const Diagnosis& d = data.d;
  page.heading("Values");
  if (d.effects.empty())
    return page.paragraph("The model has no effect, and none was found: there are no values to report.");
  page.paragraph(
      "Values of the extended model, fitted to all data, with their 95 % intervals. Typical: the size that the effect "
      "usually has in such cameras. Not determined: the data do not constrain it beyond the prior.");
  std::vector<Row> rows;
  for (const EffectResult& e : d.effects) {
    for (const ParameterResult& p : e.parameters)
      rows.push_back({e.name, p.name, value_text(p), p.nonlinear ? "-" : typical_text(p), remark(p)});
    for (const ParameterResult& p : e.fixed)
      rows.push_back({e.name, p.name, with_uncertainty(p.value, {NAN, NAN}, p.unit), "-",
                      "fixed: the data do not require it to vary"});
  }
  page.table(Row{"effect", "parameter", "value (95 %)", "typical", "remark"}, rows);
  if (const std::string picture = forest(d); !picture.empty()) {
    const std::vector<std::string> pictures = {picture};
    page.figures(pictures,
                 "Bars are the 95 % intervals; a bar that crosses the dashed line at 0 does not exclude that the "
                 "effect is absent.");
  }
  add_correlations(page, d);
}

void add_influence(report::Page& page, const ReportData& data) {
  std::vector<std::string> pictures;
  std::vector<std::string> halves;
  for (const EffectResult& e : data.d.effects) {
    if (e.influence.empty()) continue;
    pictures.push_back(influence_bars(data, e));
    halves.push_back(half_of(e));
  }
  if (pictures.empty()) return;
  page.heading("Evidence for each name");
  page.paragraph(
      "An effect's gain is the improvement of the fit by it: the decrease of the deviance, which is minus twice the "
      "logarithm of the likelihood. Shown are the conditions with the largest shares. If a name rests on one or two of "
      "them, they should be repeated.");
  page.list(halves);
  page.figures(pictures);
}

std::string compared(const Rival& rival) {
  if (rival.tied) return "cannot be distinguished (a tie)";
  return rival.limit.empty() ? "worse" : "fits as well, but " + rival.limit;
}

void add_rivals(report::Page& page, const ReportData& data) {
  std::vector<Row> rows;
  std::vector<std::string> pictures;
  constexpr std::size_t most = 3;  // per effect, in addition to the tied ones
  for (const EffectResult& e : data.d.effects) {
    std::size_t worse = 0;
    for (const Rival& rival : e.rivals()) {
      if (!rival.does_as_much() && ++worse > most) continue;
      if (!rival.is_listed_at(e.name)) continue;
      rows.push_back({fmt::format("{}", fmt::join(rival.in_place_of, " with ")), rival.candidate->name(),
                      deviance_text(rival.deviance), compared(rival)});
      if (rival.tied || (!rival.does_as_much() && worse == 1)) pictures.push_back(distance_chart(data, rival));
    }
  }
  if (rows.empty()) return;
  page.heading("Other effects in its place");
  page.paragraph(
      "Increase of the deviance (minus twice the logarithm of the likelihood) if another effect replaces the one that "
      "was found, everything fitted again: the best three, and all that fit as well. Two are tied if the increase, or "
      "the increase minus the penalty for more parameters (BIC: the logarithm of the number of conditions for each), "
      "is below 10, or if conditions vary more from one to the next than the two models differ.");
  page.table(Row{"found", "in its place", "deviance lost", ""}, rows);
  page.figures(
      pictures,
      "Difference between the two models, for ties and for the best of the others: prediction of the one minus "
      "prediction of the other, mean over each condition's image. A repetition is most useful where they differ most.");
}

}  // namespace tofgraph::diagnosis
