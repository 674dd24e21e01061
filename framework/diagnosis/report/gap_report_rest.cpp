// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/quantity.hpp"
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/report/gap_report_parts.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <tuple>

namespace tofgraph::diagnosis {
namespace {

/// Kind of a condition: target (as a number if it is one), integration time, then sources and ambient.
using Kind = std::tuple<double, std::string, double, std::string>;

Kind kind_of(const io::Condition& c, bool with_time) {
  std::string others;
  if (!c.sources.empty()) others += fmt::format(" {}", fmt::join(c.sources, "+"));
  if (c.ambient != "dark") others += " " + c.ambient;
  double number = 0;
  std::from_chars(c.target.data(), c.target.data() + c.target.size(), number);
  return {number, c.target, with_time ? c.integration_time : 0, others};
}

/// True if integration times are separate columns: unless most cells would then be empty.
bool times_are_columns(const Design& design) {
  std::set<Kind> kinds;
  std::set<std::pair<double, Kind>> fields;
  for (const io::Condition& c : design.conditions()) {
    if (c.is_capped()) continue;
    kinds.insert(kind_of(c, true));
    fields.emplace(c.board_distance, kind_of(c, true));
  }
  return 3 * fields.size() > design.levels(&io::Condition::board_distance).size() * kinds.size();
}

/// Map of means over a condition's image. Rows: distances; columns: other settings.
std::string over_conditions(const Design& design, const std::vector<std::vector<double>>& values, std::size_t o,
                            const std::string& title) {
  const bool with_time = times_are_columns(design);
  const std::set<double> distances = design.levels(&io::Condition::board_distance);
  std::map<Kind, std::size_t> kinds;
  for (const io::Condition& c : design.conditions())
    if (!c.is_capped()) kinds.emplace(kind_of(c, with_time), 0);
  std::size_t next = 0;
  report::FieldMap map{.title = title, .unit = unit_of(o), .rows = distances.size(), .columns = kinds.size()};
  for (auto& [kind, column] : kinds) {
    column = next++;
    const auto& [number, target, time, others] = kind;
    map.x_names.push_back(with_time ? fmt::format("{} {}{}", target, config::format_quantity(time, "s"), others)
                                    : target + others);
  }
  for (const double z : distances) map.y_names.push_back(fmt::format("{:.3g} m", z));
  std::vector<std::vector<double>> cells(map.rows * map.columns);
  map.fields.resize(cells.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const io::Condition& c = design.conditions()[i];
    if (c.is_capped()) continue;
    const auto row = static_cast<std::size_t>(std::distance(distances.begin(), distances.find(c.board_distance)));
    const std::size_t cell = row * map.columns + kinds.at(kind_of(c, with_time));
    cells[cell].push_back(mean(values[i]));
    map.fields[cell].condition = i;
    map.fields[cell].title +=
        fmt::format("{}{}: {}", map.fields[cell].title.empty() ? "" : "\n", c.id, shown(mean(values[i]), o, 3, true));
  }
  std::vector<double> all;
  for (std::size_t k = 0; k < cells.size(); ++k) all.push_back(map.fields[k].value = scaled(mean(cells[k]), o));
  map.limit = scale_of(all);
  map.x_label = with_time ? "target, integration time" : "target";
  map.y_label = "board";
  return report::field_map(map, std::max(420, 160 + 40 * static_cast<int>(kinds.size())), 400);
}

constexpr std::size_t max_patterns = 12, of_each = 4;  ///< of all observables, and of one

/// First patterns of each observable.
std::vector<Pattern> shown_patterns(std::vector<Pattern> patterns) {
  std::array<std::size_t, observables> count{};
  std::erase_if(patterns, [&](const Pattern& p) { return ++count[p.observable] > of_each; });
  if (patterns.size() > max_patterns) patterns.resize(max_patterns);
  return patterns;
}

/// Adds the patterns of the gap before the search, described by generic curves.
void add_patterns(report::Page& page, const Diagnosis& d) {
  constexpr double false_discoveries = 0.05;  // at least the search's limit of p-values
  std::vector<Pattern> sure = d.search.where;
  std::erase_if(sure, [](const Pattern& p) { return !(p.p_value <= false_discoveries); });
  sure = by_size(std::move(sure), d.gaps);
  std::vector<Row> rows;
  for (const Pattern& p : shown_patterns(sure))
    rows.push_back({label(p.observable), p.axis, shown_gap(p.size, d.gaps[p.observable], p.observable),
                    report::plain(p.p_value, 2)});
  if (rows.empty())
    return page.paragraph(fmt::format(
        "Before the search no curve over a setting is significant, by sign flips of whole conditions (p at most "
        "{}).{}",
        false_discoveries,
        d.search.found.empty()
            ? ""
            : " The named effects were identified by their signatures, which are more specific than these patterns."));
  page.paragraph(
      fmt::format("Before the search the gap depended significantly on these settings: curves without physics, the "
                  "largest of each observable first, {}. They overlap. x, y and radius are positions in the image, "
                  "incidence is the angle of the light on the board, a period is that of a wave over the distance. p "
                  "is the probability of such a curve by chance, when whole conditions change their signs at random.",
                  rows.size() < sure.size()
                      ? fmt::format("{} of {}, at most {} of each observable", rows.size(), sure.size(), of_each)
                      : fmt::format("{} in all", rows.size())));
  page.table(Row{"of", "along", "size (root mean square)", "p"}, rows);
}

/// Observable for the map of the unexplained residual.
std::size_t rest_observable(const Diagnosis& d) {
  const SearchResult& search = d.search;
  if (const auto rest = by_size(search.rest, d.gaps); !rest.empty()) return rest.front().observable;
  if (!search.rest.empty()) return search.rest.front().observable;
  std::size_t o = distance;
  while (search.structure[o] == 0) ++o;
  return o;
}

void add_tried(report::Page& page, const SearchResult& search) {
  std::vector<Row> rows;
  for (const EffectFinding& tried : search.dropped) {
    Row row = {tried.name, tried.refutation};
    if (!contains(rows, row)) rows.push_back(std::move(row));  // may have been tried repeatedly
  }
  if (rows.empty()) return;
  page.folded_table("Effects that were tried and are not named", Row{"effect", "why not"}, rows);
}

/// "wiggling from rail_scale", or the question about a single effect.
std::string question(const NextCondition& next) {
  if (next.effects.size() > 1) return sides_of(next, " from ");
  return asked_of(next.effects.front(), next.value);
}

/// True if the data have samples of the camera, or a table instead.
bool has_samples(const Diagnosis& d) { return d.measurements.taps || d.measurements.phases || d.measurements.table; }

/// Questions that no proposed condition answers, with advice of the effects' authors.
struct Silent {
  std::vector<std::string> values;  ///< as questions
  std::vector<std::string> blind;   ///< names
  std::vector<Row> advice;          ///< for all
};

Silent silent_questions(const Diagnosis& d) {
  Silent silent;
  for (const NextCondition& next : d.next) {
    if (tells(next)) continue;
    if (next.effects.size() > 1) continue;
    if (next.value.empty())
      silent.blind.push_back(next.effects.front());
    else
      silent.values.push_back(question(next));
    silent.advice.push_back({question(next), next.experiment});
  }
  for (const Visibility& seen : d.audit.effects) {
    const std::string name = seen.candidate->name();
    const bool listed = std::ranges::any_of(
        d.next, [&](const NextCondition& next) { return next.effects == std::vector{name} && next.value.empty(); });
    if (!seen.blind || listed) continue;
    silent.blind.push_back(name);
    silent.advice.push_back({asked_of(name), seen.candidate->border().experiment});
  }
  return silent;
}

/// Adds one sentence for all questions, and the advice, folded.
void add_silent(report::Page& page, const Silent& silent) {
  if (silent.advice.empty()) return;
  std::vector<std::string> questions = silent.values;
  if (!silent.blind.empty()) questions.push_back(asked_of(fmt::format("{}", fmt::join(silent.blind, ", or "))));
  page.paragraph(fmt::format("None of the compared conditions can determine {}.", fmt::join(questions, ", or ")));
  page.folded_table("Experiments that determine these, from experience", Row{"to know", "from experience"},
                    silent.advice);
}

/// Adds effects that look alike: pairs with an effect that was found openly, the others folded.
void add_alike(report::Page& page, const Diagnosis& d) {
  std::map<std::string, std::string> of_found;
  std::vector<Row> others;
  const auto is_found = [&](const Candidate* candidate) {
    return std::ranges::any_of(d.effects, [&](const EffectResult& e) { return e.name == candidate->name(); });
  };
  const auto add = [&](const Candidate* one, const Candidate* other, double cosine) {
    std::string& text = of_found[one->name()];
    text += fmt::format("{}{} {:.2f}", text.empty() ? "" : ", ", other->name(), cosine);
  };
  for (const Alike& pair : d.audit.alike) {
    const bool first = is_found(pair.first), second = is_found(pair.second);
    if (first) add(pair.first, pair.second, pair.cosine);
    if (second) add(pair.second, pair.first, pair.cosine);
    if (!first && !second)
      others.push_back({pair.first->name(), pair.second->name(), fmt::format("{:.2f}", pair.cosine)});
  }
  if (!of_found.empty() || !others.empty())
    page.paragraph(
        fmt::format("Some effects look alike in this campaign at their typical sizes, whatever else was measured: the "
                    "cosine between the changes they cause is above 0.9, where 1 means identical. A name stands for "
                    "all effects that look like it, until another measurement distinguishes them; \u201cOther effects "
                    "in its place\u201d shows whether they look alike at the fitted sizes.{}",
                    of_found.empty() && !d.effects.empty() ? " None of them was found." : ""));
  std::vector<Row> rows;
  for (const auto& [name, text] : of_found) rows.push_back({name, text});
  if (!rows.empty()) page.table(Row{"found", "looks like, with the cosine"}, rows);
  if (others.empty()) return;
  page.folded_table(
      fmt::format("The {} pairs {}that look alike", others.size(), of_found.empty() ? "" : "of other effects "),
      Row{"effect", "looks like", "cosine"}, others);
}

}  // namespace

std::string rest_map(const ReportData& data) {
  const SearchResult& search = data.d.search;
  const std::size_t o = rest_observable(data.d);
  const std::string title = label(o) + ", unexplained residual";
  if (search.structure[o] == 0) return over_conditions(data.design, data.evidence.at(o).after, o, title);
  const std::vector<double> pattern = leading_pattern(data.problem, search.after.state, o);
  report::FieldMap map = sensor_map(data.design, pattern, data.evidence.at(o).map_sd, o, title);
  std::vector<double> sizes;
  for (const report::Field& field : map.fields) sizes.push_back(field.value);
  map.limit = scale_of(sizes);
  return report::field_map(map);
}

void add_rest(report::Page& page, const ReportData& data) {
  const SearchResult& search = data.d.search;
  page.heading("Dependence of the gap on settings, and unexplained residual");
  add_patterns(page, data.d);
  add_tried(page, search);
  if (!search.something_left()) return page.paragraph("After the search no significant residual is left.");
  std::vector<Row> rows;
  for (const Pattern& p : shown_patterns(by_size(search.rest, data.d.gaps)))
    rows.push_back({label(p.observable), p.axis, shown_gap(p.size, data.d.gaps[p.observable], p.observable)});
  if (!rows.empty()) {
    page.paragraph(
        "After the search these residuals are left, which no effect explains; the largest of each observable, which "
        "overlap:");
    page.table(Row{"of", "along", "size (root mean square)"}, rows);
  }
  const std::size_t others = search.patterns_without_axis();
  if (others > 0)
    page.paragraph(fmt::format("{} pattern{} over the sensor {} left that follow{} no setting.", others,
                               others == 1 ? "" : "s", others == 1 ? "is" : "are", others == 1 ? "s" : ""));
  std::string nearest;
  for (const Near& near : search.nearest)
    nearest += fmt::format("{}{} ({:.0f} %)", nearest.empty() ? "" : ", ", near.candidate->name(),
                           100 * near.fraction_of_largest);
  if (!nearest.empty())
    page.paragraph("The closest effects, and the part of it that they would explain: " + nearest + ".");
  const std::vector<std::string> shape = {rest_map(data)};
  page.figures(shape,
               search.structure[rest_observable(data.d)] == 0
                   ? "The largest residual: measured minus extended, mean over each condition's image. Grey: not "
                     "measured."
                   : "The largest residual over the sensor. Its sign may change from one condition to the next.");
}

void add_blind(report::Page& page, const ReportData& data) {
  page.heading("Effects that these data could not have shown");
  std::vector<std::string> unseen, too_small;
  std::vector<Row> rows;
  for (const Visibility& seen : data.d.audit.effects) {
    if (seen.blind)
      (seen.norm < settings.blind_below ? unseen : too_small).push_back(seen.candidate->name());
    else
      rows.push_back({seen.candidate->name(), fmt::format("{:.0f}", seen.norm), fmt::format("{:.2g}", seen.smallest)});
  }
  if (unseen.empty() && too_small.empty())
    page.paragraph("Each known effect of its typical size would have shown in this campaign.");
  if (!unseen.empty())
    page.paragraph(
        fmt::format("The report cannot say anything about these effects. At their typical sizes they change all data "
                    "by fewer than {} standard deviations, because they have little influence here or only change "
                    "quantities that are estimated anyway: {}.",
                    settings.blind_below, fmt::join(unseen, ", ")));
  if (!too_small.empty())
    page.paragraph(fmt::format(
        "Nor about these. They could be distinguished from noise, but at their typical sizes no condition changes by a "
        "relevant amount (0.1 mm; 0.1 % of amplitude or intensity; 0.02 % of a null channel): {}.",
        fmt::join(too_small, ", ")));
  add_alike(page, data.d);
  if (rows.empty()) return;
  page.folded_table(
      "Effects that would have shown, and their minimum sizes",
      Row{"effect", "standard deviations at its typical size", "minimum size that would be found / typical size"},
      rows);
}

void add_next(report::Page& page, const ReportData& data) {
  const Diagnosis& d = data.d;
  const Silent silent = silent_questions(d);
  std::vector<Row> rows;
  for (const NextCondition& next : d.next) {
    if (tells(next))
      rows.push_back({question(next), setting_of(next), sigmas(next) + " sd",
                      fmt::format("{:.1f} sd", next.measured_sigma),
                      shown(next.difference, next.observable, 2) + " of " + label(next.observable)});
  }
  if (rows.empty() && silent.advice.empty()) return;
  page.heading("Next measurement");
  if (const NextCondition* const first = best_condition(d.next); first != nullptr) {
    page.verdict(sentence(*first));
    page.paragraph(
        "The most informative condition is written beside this report as a scene, next_condition.yaml, for tofgraph "
        "simulate.");
  } else {
    page.verdict(
        "None of the compared conditions, at this campaign's settings or somewhat beyond them, would provide more "
        "information.");
  }
  for (const NextCondition& tie : d.next) {
    if (tie.effects.size() > 1 && !tells(tie))
      page.verdict(fmt::format(
          "None of the compared conditions can distinguish {}. Recommended, from experience: {}{}.", question(tie),
          has_samples(d) ? "" : "the samples, if the camera gives them; or ", tie.experiment));
  }
  if (!d.next.empty())
    page.paragraph(fmt::format(
        "The comparison covers {} conditions with this campaign's settings and some beyond: distances, integration "
        "times, tilts of 20 deg, targets; time since power-on, one source alone, a lamp, a covered rail, a laser, a "
        "turned camera, a capped lens. The difference between two models is given in standard deviations (sd) of one "
        "condition: noise, variation of boards and light, and the uncertainty of their values. Differences below 0.1 "
        "mm or 0.1 % are too small to rely on; below {} sd a condition provides no information.",
        d.next.front().candidates, settings.min_distinction));
  if (!rows.empty())
    page.table(Row{"to know", "the best condition", "the models differ there by", "in the conditions so far at most by",
                   "which is"},
               rows);
  add_silent(page, silent);
}

}  // namespace tofgraph::diagnosis
