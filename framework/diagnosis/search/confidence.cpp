// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/confidence.hpp"

#include "io/output_file.hpp"
#include "io/sha256.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// True if the only effect found is the truth or tied with it, or if the truth is tied with all found together.
bool right(const SearchResult& result, const Candidate& truth) {
  const bool alone = result.found.size() == 1;
  const auto is_right = [&](const EffectFinding& found) {
    return (alone && &found.candidate->root() == &truth) || std::ranges::any_of(found.rivals, [&](const Rival& rival) {
             return rival.tied && rival.candidate == &truth && (alone || rival.of_several());
           });
  };
  return !result.found.empty() && std::ranges::all_of(result.found, is_right);
}

/// Text form of the cases of this rank, and its parser.
std::string text_of(const std::map<std::size_t, CaseOutcome>& cases) {
  std::string text;
  for (const auto& [k, outcome] : cases) text += fmt::format("{} {:d} {:d}\n", k, outcome.named, outcome.right);
  return text;
}
void add_cases(const std::string& text, std::map<std::size_t, CaseOutcome>& cases) {
  std::istringstream lines(text);
  std::size_t k = 0;
  for (CaseOutcome outcome; lines >> k >> outcome.named >> outcome.right;) cases[k] = outcome;
}

constexpr const char* case_format = "tofgraph-confidence-case";
constexpr int case_version = 1;

}  // namespace

Confidence confidence(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates,
                      const Audit& audit, const State& found, std::size_t cases, SearchOptions options,
                      const CaseDivision& division) {
  std::vector<const Candidate*> truths = {nullptr};
  for (const Visibility& seen : audit.effects) {
    if (!seen.blind) truths.push_back(seen.candidate);
  }
  const auto progress = options.progress;
  options.progress = {};
  const auto search_case = [&](std::size_t k) {
    const Candidate* truth = truths[k % truths.size()];
    const std::uint64_t seed = options.seed + 1000 * (k + 1);
    State state{model, found.log_reflectivity, found.random_sd, found.nuisances};
    if (truth != nullptr) state.terms.push_back(random_term(*truth, 1, seed));
    const std::vector<Observations> data = injected(problem, state, seed + 1);
    const Problem injected_problem{problem.design, data, problem.targets, problem.target, problem.nuisances};
    const SearchResult searched = search(injected_problem, model, candidates, options);
    const bool named = !searched.found.empty();
    return CaseOutcome{named, named ? truth != nullptr && right(searched, *truth) : truth == nullptr};
  };
  const config::Ranks& ranks = config::ranks();
  std::map<std::size_t, CaseOutcome> outcomes;
  std::size_t turn = 0;
  for (std::size_t k = 0; k < cases; ++k) {
    // The turn does not depend on the files, because other ranks and runs write them at the same time.
    const bool mine = division.shard.has(k) && turn++ % ranks.size() == ranks.rank();
    if (const auto before = division.files.load(k)) {
      outcomes[k] = *before;
    } else if (mine) {
      if (progress) progress(fmt::format("injecting case {} of {}", k + 1, cases));
      outcomes[k] = search_case(k);
      if (!division.shard.is_whole()) division.files.save(k, outcomes[k]);
    }
  }
  for (const std::string& text : ranks.gather(text_of(outcomes))) add_cases(text, outcomes);
  for (std::size_t k = division.shard.index; k < cases; k += division.shard.count)
    if (!outcomes.contains(k)) throw std::logic_error(fmt::format("case {} was searched by no rank", k + 1));
  Confidence result;
  for (const auto& [k, outcome] : outcomes) {
    (outcome.named ? result.named : result.silent) += 1;
    if (outcome.right) (outcome.named ? result.named_right : result.silent_right) += 1;
  }
  return result;
}

std::vector<Observations> injected(const Problem& problem, const State& state, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  State whole = state;
  update_precomputed(problem, whole);          // captures are averaged over whole superpixels
  const auto rows = expected(problem, whole);  // with the boards' flatness
  std::vector<Observations> result = problem.data;
  Eigen::VectorXd shared(static_cast<Eigen::Index>(problem.nuisances.sd.size()));  // drift, sessions
  for (std::size_t u = 0; u < problem.nuisances.sd.size(); ++u) {
    const bool drawn = problem.nuisances.sd[u] != &RandomEffectSd::contrast;  // a constant of the camera
    const double sd = drawn ? state.random_sd.*problem.nuisances.sd[u] : 0;
    shared(static_cast<Eigen::Index>(u)) = sd > 0 ? sd * normal(generator) : 0;
  }
  for (std::size_t i = 0; i < result.size(); ++i) {
    const RandomEffectSd& sd = state.random_sd;
    const double jitter = sd.jitter * normal(generator);
    const double offset = sd.offset * normal(generator);
    double light = sd.light * normal(generator), uniform = 0;
    for (const Shared& one : problem.nuisances.of_condition[i])
      if (one.direction != contrast_direction)
        (one.direction == uniform_direction ? uniform : light) += one.factor * shared(one.unknown);
    Eigen::VectorXd smooth_field;  // in the distances, which are the first rows
    if (state.nuisances.smooth_field) smooth_field = state.nuisances.smooth_field->drawn(i, generator);
    for (std::size_t row = 0; row < rows[i].size(); ++row) {
      if (std::isinf(result[i].variance[row])) continue;
      const auto at = static_cast<Eigen::Index>(row);
      result[i].value[row] =
          rows[i][row] + jitter * problem.design.shift(i)[row] + offset * problem.offset_response(i, row) +
          light * whole.light_response(problem, i, row) + uniform * problem.uniform_response(i, row) +
          std::sqrt(result[i].variance[row]) * (normal(generator) + (at < smooth_field.size() ? smooth_field(at) : 0));
    }
  }
  return result;
}

Term random_term(const Candidate& candidate, double factor, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform;
  Term term{&candidate, {}};
  for (const FreeParameter& p : candidate.free()) {
    double value = 0;
    if (!p.nonlinear)
      value = p.off + (p.minimum < p.off && uniform(generator) < 0.5 ? -1 : 1) * factor * p.typical;
    else if (p.is_angle())
      value = p.minimum + uniform(generator) * (p.maximum - p.minimum);
    else
      value = p.typical * (0.7 + 0.6 * uniform(generator));
    term.values.push_back(std::clamp(value, p.minimum, p.maximum));
  }
  return term;
}

double Stability::chosen_share(std::span<const std::string> names) const {
  const auto added_any = [&](const std::vector<std::string>& added) {
    return std::ranges::find_first_of(added, names) != added.end();
  };
  return static_cast<double>(std::ranges::count_if(chosen, added_any)) / static_cast<double>(chosen.size());
}

std::map<std::string, std::size_t> Stability::counts() const {
  std::map<std::string, std::size_t> counts;
  for (const std::vector<std::string>& added : chosen) {
    for (const std::string& name : added) ++counts[name];
  }
  return counts;
}

std::vector<Stability> stability(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates,
                                 std::size_t halves, const SearchOptions& options) {
  std::vector<Fold> folds = single_levels(problem.design);
  for (Fold& half : random_halves(problem.design, halves, options.seed)) folds.push_back(std::move(half));
  const CrossFit all = cross_fit(folds, problem.design, problem.data, model, candidates, options);
  std::vector<Stability> result;
  for (const char* setting : {each_distance, each_target, any_half}) {
    Stability one{setting, {}, all.gap(distance, setting, options.seed)};
    for (const FoldResult& fold : all.folds) {
      if (fold.fold.setting == setting && fold.failed.empty()) one.chosen.push_back(fold.chosen);
    }
    if (!one.chosen.empty()) result.push_back(std::move(one));
  }
  return result;
}

CaseFiles::CaseFiles(std::filesystem::path folder, std::span<const InputFile> inputs, const std::string& options)
    : folder_(std::move(folder)) {
  std::string all = fmt::format("version {}\n{}\n", case_version, options);
  for (const InputFile& input : inputs) all += input.sha256 + "\n";
  key_ = io::sha256_of(all);
}

std::filesystem::path CaseFiles::path(std::size_t number) const {
  return folder_ / fmt::format("{}-{}.json", key_.substr(0, 16), number + 1);
}

std::optional<CaseOutcome> CaseFiles::load(std::size_t number) const {
  if (folder_.empty()) return std::nullopt;
  std::ifstream stream(path(number));
  if (!stream) return std::nullopt;
  const nlohmann::json j = nlohmann::json::parse(stream, nullptr, false);
  if (!j.is_object() || j.value("key", "") != key_ || !j.contains("named") || !j["named"].is_boolean() ||
      !j.contains("right") || !j["right"].is_boolean())
    return std::nullopt;
  return CaseOutcome{j["named"], j["right"]};
}

void CaseFiles::save(std::size_t number, const CaseOutcome& outcome) const {
  const nlohmann::json j = {{"format", case_format}, {"version", case_version}, {"key", key_},
                            {"case", number + 1},    {"named", outcome.named},  {"right", outcome.right}};
  io::write_file(path(number), j.dump(1) + "\n");
}

}  // namespace tofgraph::diagnosis
