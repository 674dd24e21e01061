// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/report/diagnosis.hpp"
#include "diagnosis/report/gap_report_parts.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string_view>

namespace tofgraph::diagnosis {
namespace {

using nlohmann::json;

/// Words for ParameterStatus, in its order.
constexpr std::array<std::string_view, 3> parameter_status_names = {"determined", "holds_zero", "not_determined"};

json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json gap_of(const Gap& gap, std::string_view unit) {
  return {{"unit", unit},
          {"before", number(gap.before)},
          {"after", number(gap.after)},
          {"held_out_before", number(gap.held_out_before)},
          {"held_out_after", number(gap.held_out_after)},
          {"held_out_low", number(gap.held_out_low)},
          {"held_out_high", number(gap.held_out_high)},
          {"noise_floor", number(gap.noise_floor)},
          {"scatter_left", number(gap.scatter_left)},
          {"noise_and_scatter", number(gap.noise_and_scatter)}};
}

json unsearched_of(const Unsearched& unsearched) {
  json result = {{"conditions", unsearched.conditions}};
  for (std::size_t o = 0; o < observables; ++o) {
    const CrossFit::Gap& gap = unsearched.gaps[o];
    if (o != distance && std::isnan(gap.before)) continue;
    result[observable_names[o]] = {{"unit", observable_units[o]},
                                   {"before", number(gap.before)},
                                   {"after", number(gap.after)},
                                   {"low", number(gap.low)},
                                   {"high", number(gap.high)}};
  }
  return result;
}

json effect_of(const EffectResult& effect, const std::vector<io::Condition>& conditions) {
  json parameters = json::object();
  for (const ParameterResult& p : effect.parameters)
    parameters[p.name] = {{"value", p.value},
                          {"unit", p.unit},
                          {"low", number(p.interval.low)},
                          {"high", number(p.interval.high)},
                          {"standing", parameter_status_names.at(static_cast<std::size_t>(p.status))}};
  json result = {{"name", effect.name},        {"change", effect.found != nullptr ? "added" : "refitted"},
                 {"tied_with", json::array()}, {"where", ""},
                 {"parameters", parameters},   {"fixed", json::object()}};
  for (const ParameterResult& p : effect.fixed) result["fixed"][p.name] = {{"value", p.value}, {"unit", p.unit}};
  if (effect.found == nullptr) return result;
  const EffectFinding& found = *effect.found;
  if (!found.where.empty()) result["where"] = name_of(found.where.front());
  result["held_out_gap_before"] = number(found.improvement.median_taken_out);
  result["held_out_gap_after"] = number(found.improvement.median_with);
  result["chosen"] = number(found.supported);
  if (std::isfinite(effect.chosen_by_halves)) {
    result["chosen_by_halves"] = effect.chosen_by_halves;
    result["weak"] = effect.is_weak();
  }
  result["gain"] = found.gain;
  result["p_value"] = found.p_value;
  result["capture"] = number(found.explained_fraction);
  for (std::size_t i = 0; i < effect.influence.size(); ++i) result["influence"][conditions[i].id] = effect.influence[i];
  if (const Rival* const tie = effect.main_tie(); tie != nullptr)
    result["separating_experiment"] = tie->separating_experiment(*found.candidate);
  for (const Rival& rival : found.rivals) {
    if (rival.tied) result["tied_with"].push_back(rival.candidate->name());
    result["rivals"].push_back({{"name", rival.candidate->name()},
                                {"in_place_of", rival.in_place_of},
                                {"deviance", rival.deviance},
                                {"bic", rival.bic}});
    if (!rival.limit.empty()) result["rivals"].back()["limit"] = rival.limit;
  }
  return result;
}

json pattern_of(const Pattern& p) {
  return {{"observable", observable_names[p.observable]}, {"axis", p.axis},  {"p_value", p.p_value}, {"size", p.size},
          {"unit", observable_units[p.observable]},       {"share", p.share}};
}

json unexplained_of(const Diagnosis& d) {
  if (!d.search.something_left()) return nullptr;
  json result = {{"shape", fmt::format("{} component{} beyond noise", d.search.patterns_without_axis(),
                                       d.search.patterns_without_axis() == 1 ? "" : "s")},
                 {"nearest", json::array()},
                 {"lack_of_fit", d.search.lack_of_fit}};
  if (!d.search.rest.empty()) {
    const Pattern& first = d.search.rest.front();
    result["observable"] = observable_names[first.observable];
    result["size"] = first.size;
    result["shape"] = name_of(first);
    for (const Pattern& p : d.search.rest) {
      if (p.observable == first.observable) result["axes"].push_back(p.axis);
    }
  }
  result["map"] = unexplained_map_name;
  for (const Near& near : d.search.nearest)
    result["nearest"].push_back({{"effect", near.candidate->name()}, {"capture", near.fraction_of_largest}});
  for (const EffectFinding& tried : d.search.dropped)
    result["refuted"].push_back({{"effect", tried.name}, {"why", tried.refutation}});
  return result;
}

json folds_json(const Diagnosis& d) {
  json all = json::array();
  for (const FoldResult& result : d.search.cross_fit.folds) {
    const Fold& fold = result.fold;
    const HeldOutGap gap = result.gap();
    all.push_back({{"setting", fold.setting},
                   {"levels", fold.levels},
                   {"conditions", fold.held.size()},
                   {"extrapolates", fold.extrapolates},
                   {"chosen", result.chosen},
                   {"missed", result.missed},
                   {"gap_before", number(gap.before)},
                   {"gap_after", number(gap.after)}});
  }
  return all;
}

json correlations_of(const Diagnosis& d) {
  json names = json::array(), rows = json::array();
  for (const EffectResult& effect : d.effects) {
    for (const ParameterResult& p : effect.parameters) names.push_back(effect.name + "." + p.name);
  }
  const Eigen::MatrixXd matrix = correlations(d.search.after);
  for (const auto& row : matrix.rowwise()) rows.push_back(std::vector<double>(row.begin(), row.end()));
  return {{"parameters", names}, {"matrix", rows}};
}

json conditions_of(const Diagnosis& d) {
  json all = json::array();
  const auto& conditions = d.measurements.design->conditions();
  const auto gaps = gaps_by_condition(d.search.cross_fit, conditions.size());
  for (std::size_t i = 0; i < conditions.size(); ++i)
    all.push_back({{"id", conditions[i].id},
                   {"held_out_gap_before", number(gaps[i].before)},
                   {"held_out_gap_after", number(gaps[i].after)}});
  return all;
}

json stated(const std::string& word) { return word.empty() ? json() : json(word); }

json next_of(const Diagnosis& d) {
  json all = json::array();
  for (const NextCondition& next : d.next) {
    const io::Condition& c = next.condition;
    all.push_back({{"effects", next.effects},
                   {"parameter", stated(next.value)},
                   {"standard_deviations", next.sigma},
                   {"standard_deviations_measured", next.measured_sigma},
                   {"difference",
                    {{"observable", observable_names[next.observable]},
                     {"value", next.difference},
                     {"unit", observable_units[next.observable]}}},
                   {"condition",
                    {{"lens", c.is_capped() ? "capped" : "open"},
                     {"distance", number(c.board_distance)},
                     {"tilt_x", number(c.board_tilt_x)},
                     {"tilt_y", number(c.board_tilt_y)},
                     {"target", c.target},
                     {"integration_time", c.integration_time},
                     {"time_since_power_on", number(c.time_since_power_on)},
                     {"sources", c.sources},
                     {"ambient", c.ambient},
                     {"rail", stated(c.rail)},
                     {"reference", stated(c.reference)},
                     {"roll", c.roll}}},
                   {"text", sentence(next)}});
  }
  return all;
}

json trace_of(const Diagnosis& d) {
  json all = json::array();
  for (const Step& step : d.search.trace) {
    json one = {{"step", step.what}, {"effects", step.effects}, {"outcome", step.outcome}};
    for (const auto& [name, value] : step.numbers) one[name] = number(value);
    all.push_back(std::move(one));
  }
  return all;
}

/// Estimated nuisances.
json nuisances_json(const Diagnosis& d) {
  const RandomEffectSd& v = d.search.after.state.random_sd;
  json result = {
      {"board_jitter", {{"value", v.jitter}, {"unit", "m"}}},
      {"camera_offset", {{"value", number(d.measurements.design->tells_offset() ? v.offset : NAN)}, {"unit", "m"}}},
      {"light", {{"value", v.light}, {"unit", ""}}}};
  for (const Misplaced& one : d.search.misplaced)
    result["misplaced"].push_back(
        {{"condition", d.measurements.design->conditions()[one.condition].id}, {"value", one.error}, {"unit", "m"}});
  if (const auto& smooth_field = d.search.after.state.nuisances.smooth_field)
    result["smooth_residue"] = {{"value", smooth_field->sd()}, {"unit", "m"}};
  if (const auto& boards = d.search.after.state.nuisances.boards)
    result["boards"] = {{"value", boards->sd}, {"unit", "m"}};
  const Problem& problem = *d.problem;
  for (const auto& [name, which, unit] :
       {std::tuple("drift", &RandomEffectSd::drift, "m"), std::tuple("drift_light", &RandomEffectSd::drift_light, ""),
        std::tuple("session", &RandomEffectSd::session, "m"),
        std::tuple("session_light", &RandomEffectSd::session_light, "")}) {
    if (contains(problem.nuisances.sd, which)) result[name] = {{"value", v.*which}, {"unit", unit}};
  }
  if (d.contrast)
    result["contrast"] = {{"profile", d.contrast->profile},
                          {"value", d.contrast->value},
                          {"low", d.contrast->low},
                          {"high", d.contrast->high}};
  for (std::size_t t = 0; t < problem.targets.size(); ++t)
    result["reflectivities"][problem.targets[t]] =
        settings.unknown_reflectivity * std::exp(d.search.after.state.log_reflectivity[t]);
  return result;
}

json confidence_of(const Confidence& c) {
  return {{"cases", c.cases()},
          {"named", c.named},
          {"named_right", c.named_right},
          {"nothing_found", c.silent},
          {"nothing_found_right", c.silent_right}};
}

json spread_of(const PixelSpread& spread) {
  json result = {{"rows", spread.rows},
                 {"within_25_percent", spread.within},
                 {"held_out_within_25_percent", number(spread.held_out_within)},
                 {"rms_of_logarithm", spread.rms},
                 {"held_out_rms_of_logarithm", number(spread.held_out_rms)},
                 {"laws", json::array()},
                 {"light", spread.light},
                 {"residual", nullptr}};
  for (const SpreadTerm& term : spread.terms)
    result["laws"].push_back(
        {{"name", spread_law_name(term.law)}, {"value", term.value}, {"unit", spread_law_unit(term.law)}});
  if (spread.residual)
    result["residual"] = {{"setting", spread.residual->setting},
                          {"level", spread.residual->level},
                          {"ratio", spread.residual->ratio},
                          {"rows", spread.residual->rows}};
  return result;
}

/// Comparison of the written model with the given one.
json verification_of(const Diagnosis& d) {
  const SearchResult& search = d.search;
  const auto gaps = [](const GapComparison& of) {
    return json{{"given", number(of.given)}, {"written", number(of.model)}};
  };
  return {{"unit", "m"},
          {"all_data", gaps({d.gaps[distance].before, d.gaps[distance].after})},
          {"held_out", gaps(search.verified.held_out)},
          {"given_unchanged", search.is_given},
          {"not_written", search.not_better.empty() ? json() : json(search.not_better)},
          {"time_limit", d.time_limit > 0 ? json(d.time_limit) : json()},
          {"time_limit_reached", d.time_expired}};
}

}  // namespace

json report_json(const Diagnosis& d) {
  json report = {
      {"format", "tofgraph-gap-report"}, {"version", 1}, {"verdict", verdict_name(d.verdict)}, {"summary", summary(d)}};
  report["effects"] = json::array();
  for (const EffectResult& effect : d.effects)
    report["effects"].push_back(effect_of(effect, d.measurements.design->conditions()));
  report["gap"] = gap_of(d.gaps[distance], "m");
  for (std::size_t o = 1; o < observables; ++o) {
    if (std::isfinite(d.gaps[o].before))
      report["observables"][observable_names[o]] = gap_of(d.gaps[o], observable_units[o]);
  }
  if (d.unsearched) report["unsearched"] = unsearched_of(*d.unsearched);
  report["where"] = json::array();
  for (const Pattern& p : d.search.where) report["where"].push_back(pattern_of(p));
  report["blind"] = json::array();
  report["visible"] = json::object();
  for (const Visibility& seen : d.audit.effects) {
    if (seen.blind)
      report["blind"].push_back(seen.candidate->name());
    else
      report["visible"][seen.candidate->name()] = {{"standard_deviations", seen.norm},
                                                   {"smallest_share_of_typical", seen.smallest}};
  }
  report["alike"] = json::array();
  for (const Alike& pair : d.audit.alike)
    report["alike"].push_back({{"effects", {pair.first->name(), pair.second->name()}}, {"cosine", pair.cosine}});
  report["unexplained"] = unexplained_of(d);
  report["model"] = "model.yaml";
  report["notes"] = json::array();
  for (const Note& note : d.notes) report["notes"].push_back(note.text);
  report["lack_of_fit"] = {{"chi2_over_freedom", d.search.lack_of_fit}, {"freedom", d.search.freedom}};
  report["nuisances"] = nuisances_json(d);
  report["campaign"] = {{"name", d.campaign_name}, {"notes", d.campaign_notes}};
  report["data"] = {{"conditions", d.conditions()}, {"frames", d.measurements.frames}};
  if (const auto& noise = d.measurements.noise)
    report["noise"] = {{"over_profile", noise->middle}, {"least", noise->least}, {"most", noise->most}};
  if (d.spread) report["pixel_spread"] = spread_of(*d.spread);
  report["folds"] = folds_json(d);
  for (const Stability& one : d.stability)
    report["resampled"].push_back({{"put_aside", one.put_aside},
                                   {"runs", one.chosen.size()},
                                   {"chosen", one.counts()},
                                   {"gap_before", number(one.gap.before)},
                                   {"gap_after", number(one.gap.after)},
                                   {"gap_low", number(one.gap.low)},
                                   {"gap_high", number(one.gap.high)}});
  report["trace"] = trace_of(d);
  report["verification"] = verification_of(d);
  report["conditions"] = conditions_of(d);
  report["correlations"] = correlations_of(d);
  report["next"] = next_of(d);
  report["seed"] = d.seed;
  report["inputs"] = json::array();
  for (const InputFile& input : d.inputs) report["inputs"].push_back({{"file", input.file}, {"sha256", input.sha256}});
  if (d.confidence) report["confidence"] = confidence_of(*d.confidence);
  return report;
}

}  // namespace tofgraph::diagnosis
