// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace tofgraph::diagnosis {

Findings::Findings(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates,
                   const SearchOptions& options, const std::map<std::string, std::string>& refused)
    : selection(problem, model, candidates, options, refused),
      finder(selection.problem()),
      trials(selection.problem(), candidates),
      rivals_(selection, trials, candidates, options.seed + 2) {}

std::vector<Pattern> Findings::patterns_of(const ModelFit& fit) const {
  return finder.find(fit, options().seed + 1).patterns;
}

void Findings::drop_with_reason(const ModelTerm& addition, EffectFinding finding) {
  selection.task().report_progress(fmt::format("dropping {}", finding.name));
  compared_ = false;
  selection.drop(addition);
  std::erase_if(result.dropped, [&](const EffectFinding& one) { return one.name == finding.name; });
  result.dropped.push_back(std::move(finding));
}

void Findings::drop_found(std::size_t f) {
  EffectFinding finding = std::move(result.found[f]);
  result.found.erase(result.found.begin() + static_cast<std::ptrdiff_t>(f));
  drop_with_reason({given_terms().size() + f, std::nullopt}, std::move(finding));
}

void Findings::drop_all(const std::string& why) {
  for (std::vector<ModelTerm> left = selection.additions(); !left.empty(); left = selection.additions()) {
    const Term& term = selection.terms()[left.back().term];
    EffectFinding finding{.candidate = term.candidate, .name = name_of(term, left.back()), .refutation = why};
    note({"questioned", {finding.name}, {}, why});
    drop_with_reason(left.back(), std::move(finding));
  }
}

bool Findings::drop_refuted(const std::function<std::string(EffectFinding&)>& test) {
  bool changed = false;
  for (std::size_t f = result.found.size(); f-- > 0;) {
    result.found[f].refutation = test(result.found[f]);
    if (result.found[f].refutation.empty()) continue;
    drop_found(f);
    changed = true;
  }
  return changed;
}

bool Findings::replace_by_others(EffectFinding finding, const Unidentified& why) {
  Replaced replaced{std::move(finding), best(), why, {}};
  selection.task().report_progress(fmt::format("looking for others in the place of {}", replaced.name()));
  const bool others = selection.exchange(*replaced.finding.candidate) || simplify(*replaced.finding.candidate);
  for (const Term& term : selection.terms())
    if (!is_in(replaced.fit.state, *term.candidate)) replaced.by.push_back(term.candidate->name());
  note({"exchanged",
        others ? replaced.by : std::vector{replaced.name()},
        {{"bic_rise", others ? selection.bic(best()) - selection.bic(replaced.fit) : NAN}},
        others ? "as good as " + replaced.name() : "others do not explain as much: all stays as it was"});
  if (others) replaced_.push_back(std::move(replaced));
  return others;
}

/// Replaces a form with refinements by a simpler form of the same effect, with others beside it: a refinement may have
/// imitated these, so that no value was determined. @returns true if those of the simpler form are
bool Findings::simplify(const Candidate& form) {
  SelectedModel before = selection.selected();
  if (&form == &form.root() || !selection.exchange(form, form)) return false;
  const std::size_t term = term_of(best().state, form);
  if (term < selection.terms().size() && identifiability_of(problem(), best(), term, options().seed + 2).why.empty())
    return true;
  selection.select(std::move(before));
  return false;
}

void Findings::compare_with_rivals() {
  if (compared_) return;
  for (std::size_t t = given_terms().size(); t < selection.terms().size(); ++t) compare(t);
  rivals_.add_of_several(result.found, given_terms().size());
  compared_ = true;
}

void Findings::compare_with_choices_of_folds(std::size_t term) {
  EffectFinding& finding = result.found[term - given_terms().size()];
  std::vector<std::string> instead;
  for (const FoldResult& fold : result.cross_fit.folds)
    if (!fold.chose(finding.names())) std::ranges::copy(fold.chosen, std::back_inserter(instead));
  std::ranges::copy(rivals_.among(instead, finding, term), std::back_inserter(finding.rivals));
}

void Findings::compare(std::size_t term) {
  EffectFinding& finding = result.found[term - given_terms().size()];
  selection.task().report_progress(fmt::format("comparing {} with its rivals", finding.name));
  finding.where = patterns_of(selection.without({term, std::nullopt}));
  finding.rivals = rivals_.of(finding, term);
  for (const Replaced& replaced : replaced_) {
    if (!stays_replaced(replaced) || !contains(replaced.by, finding.name)) continue;
    const Candidate* const other = &replaced.finding.candidate->root();
    std::erase_if(finding.rivals, [&](const Rival& rival) { return rival.candidate == other; });
    finding.rivals.insert(
        finding.rivals.begin(),
        {other, replaced.by, replaced.fit.deviance - best().deviance,
         selection.bic(replaced.fit) - selection.bic(best()), !replaced.unidentified.at_limit, replaced.fit.state,
         replaced.unidentified.nonlinear, replaced.unidentified.at_limit ? replaced.unidentified.why : ""});
  }
}

bool Findings::stays_replaced(const Replaced& replaced) const {
  return differ_only_by(best().state, replaced.by, replaced.fit.state, replaced.name());
}

void Findings::report_dropped() {
  for (Replaced& replaced : replaced_)
    if (!stays_replaced(replaced)) result.dropped.push_back(std::move(replaced.finding));
  std::erase_if(result.dropped, [&](const EffectFinding& tried) {
    const auto is = [&](const EffectFinding& one) { return one.name == tried.name; };
    return std::ranges::any_of(result.found, is) || std::ranges::any_of(result.refinements, is);
  });
}

}  // namespace tofgraph::diagnosis
