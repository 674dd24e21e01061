// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/diagnosis.hpp"

#include "diagnosis/maps.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/exposures.hpp>

#include <algorithm>
#include <cmath>
#include <set>

namespace tofgraph::diagnosis {
namespace {

/// Effects of the catalogue but those that are to be left out. Names that are none are mistakes.
std::vector<std::unique_ptr<Candidate>> candidates_of(const graph::PluginRegistry& catalogue,
                                                      const std::vector<std::string>& without,
                                                      std::vector<std::string>& notes) {
  std::vector<std::string> names;
  std::vector<graph::PluginFile> files;
  for (const graph::PluginFile& file : catalogue.files()) {
    if (file.kind != "effect") continue;
    names.push_back(file.name);
    files.push_back(file);
  }
  for (const std::string& name : without) {
    if (std::ranges::find(names, name) == names.end())
      throw config::ConfigurationError(fmt::format("--without: error: there is no effect '{}'\n         {}", name,
                                                   config::suggestion(name, names, "effects")));
  }
  std::vector<std::unique_ptr<Candidate>> candidates;
  const auto seen = catalogue.describe(files);
  for (const graph::PluginFile& file : files) {
    if (std::ranges::find(without, file.name) != without.end()) continue;
    try {
      candidates.push_back(std::make_unique<Candidate>(catalogue.load(file, seen)));
    } catch (const std::runtime_error& error) {
      notes.push_back(fmt::format("The effect {} is left out: {}", file.name, error.what()));
    }
  }
  return candidates;
}

class Run {
 public:
  Run(const graph::PluginRegistry& catalogue, const DiagnosisOptions& options)
      : catalogue_(catalogue), options_(options) {}

  std::unique_ptr<Diagnosis> run() {
    const io::Campaign campaign = read();
    IngestOptions ingest{d_->model.physical, options_.skip_missing, {}};
    ingest.progress = [this](double share) { progress(0.4 * share, "reading captures"); };
    d_->measurements = campaign.from_table ? measure_table(campaign, d_->model.physical) : measure(campaign, ingest);
    note_measurements();
    problem_.emplace(make_problem(*d_->measurements.design, d_->measurements.observations));
    note_light();
    progress(0.4, "asking what these data can show");
    d_->audit = audit(*problem_, d_->model_terms, d_->candidates);
    SearchOptions search_options = options_.search;
    search_options.progress = [this](const std::string& what) { progress(share_ += 0.04, what); };
    d_->search = search(*problem_, d_->model_terms, d_->candidates, search_options);
    problem_->correction = d_->search.correction;
    problem_->brightening = d_->search.brightening;
    progress(0.95, "checking on conditions that were put aside");
    validate();
    describe();
    judge();
    if (options_.confidence > 0)
      d_->confidence = confidence(*problem_, d_->model_terms, d_->candidates, d_->audit, d_->search.after.state,
                                  options_.confidence, search_options);
    return std::move(d_);
  }

 private:
  void progress(double share, const std::string& what) const {
    if (options_.progress) options_.progress(std::min(share, 0.99), what);
  }

  io::Campaign read() {
    config::Diagnostics diagnostics;
    d_->model = simulation::load_model(options_.model, catalogue_, diagnostics);
    io::Campaign campaign = io::read_campaign(
        options_.data, diagnostics, options_.skip_missing ? io::Captures::may_be_missing : io::Captures::must_be_there);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    if (const auto problem = physics::not_the_four(physics::exposures_of(campaign.camera->view())); !problem.empty())
      throw std::invalid_argument(
          fmt::format("the camera '{}' cannot be used: a search {}", campaign.camera_name, problem));
    if (!simulation::is_for(d_->model, *campaign.camera))
      d_->notes.push_back(
          fmt::format("The model is for the camera '{}', the campaign was made with '{}': its profile is used.",
                      d_->model.camera, campaign.camera_name));
    d_->candidates = candidates_of(catalogue_, options_.without, d_->notes);
    for (const simulation::ModelEffect& effect : d_->model.effects) {
      d_->own_candidates.push_back(std::make_unique<Candidate>(effect));
      d_->model_terms.push_back({d_->own_candidates.back().get(), d_->own_candidates.back()->start()});
    }
    return campaign;
  }

  void note_measurements() {
    const Measurements& m = d_->measurements;
    for (const std::string& text : m.left_out) d_->notes.push_back("Left out: " + text);
    if (!m.replicates)
      d_->notes.push_back(
          "Some conditions have one frame only: there the noise is that of the camera's profile, not measured.");
    if (m.bad_pixels > 0.001)
      d_->notes.push_back(
          fmt::format("{:.2f} % of the pixels do not fit their neighbours and were not used.", 100 * m.bad_pixels));
    if (m.saturated > 0)
      d_->notes.push_back(fmt::format("{:.2f} % of the pixels are saturated and were not used.", 100 * m.saturated));
    if (m.table)
      d_->notes.push_back(
          "The data are one mean a condition: nothing is known of the pixels, and what a board's mean differs by from "
          "one condition to the next is estimated with the model.");
    else if (!m.taps)
      d_->notes.push_back(m.phases ? "The captures have phases and no taps: nothing is known of the intensity."
                                   : "The captures have distances only: nothing is known of the null channels.");
    if (!m.design->tells_order())
      d_->notes.push_back(
          "The conditions do not all have an `order`: whether the camera wandered while they were measured was not "
          "asked.");
    std::set<double> distances;
    for (const io::Condition& c : m.design->conditions()) distances.insert(c.board_distance);
    if (distances.size() == 1)
      d_->notes.push_back(
          "All conditions have one distance: what changes with the distance cannot be told from an offset.");
  }

  void note_light() {
    if (problem_->light_seen() || problem_->targets.empty()) return;
    d_->notes.push_back(fmt::format(
        "No amplitudes are known: the first target's reflectivity is taken as {}, the others' are estimated from what "
        "effects do. What stands beside the light, as crosstalk does, is relative to that.",
        unknown_reflectivity));
  }

  void validate() {
    d_->held_out = hold_out(*d_->measurements.design, options_.search.seed);
    std::vector<double> weight;
    for (const bool held : d_->held_out) weight.push_back(held ? 0 : 1);
    const std::vector<double> all(weight.size(), 1);
    const std::vector<bool> every(weight.size(), true);
    d_->put_aside = static_cast<std::size_t>(std::ranges::count(d_->held_out, true));
    const bool some = d_->put_aside > 0;
    if (!some) {
      d_->notes.push_back("No setting has four levels: nothing could be put aside, the gap is that of the fit itself.");
      d_->held_out = every;
    }
    // The model as it was is not refitted, only the reflectivities are; the extended one does not see what is held out.
    State as_it_was = d_->search.before.state;
    as_it_was.terms = d_->model_terms;
    Problem original{problem_->design, problem_->data, problem_->targets, problem_->target};
    if (!d_->model_terms.empty()) correct(original, as_it_was);
    before_ = fit_nuisances(original, as_it_was, all).state;
    const State& after = d_->search.after.state;
    trained_ = some ? fit(*problem_, with_maps_of(*problem_, after, weight), weight).state : after;
    State effects_held = fit_nuisances(*problem_, trained_, all).state;
    effects_held.variances = d_->search.after.state.variances;
    for (std::size_t o = 0; o < observables; ++o) {
      d_->gaps[o] = {gap(original, before_, o, every), gap(*problem_, d_->search.after.state, o, every),
                     some ? gap(original, before_, o, d_->held_out) : NAN,
                     some ? gap(*problem_, effects_held, o, d_->held_out) : NAN,
                     noise_floor(*problem_, d_->search.after.state, o, d_->held_out)};
    }
    trained_ = effects_held;
  }

  void describe() {
    const Fit& after = d_->search.after;
    const std::vector<Interval> all = intervals(*problem_, after, options_.search.seed + 2);
    std::size_t at = 0;
    for (std::size_t t = 0; t < after.state.terms.size(); ++t) {
      const Term& term = after.state.terms[t];
      EffectResult effect;
      effect.name = term.candidate->name();
      effect.change = t < d_->model_terms.size() ? "refitted" : "added";
      effect.experiment = term.candidate->border().experiment;
      for (std::size_t k = 0; k < term.values.size(); ++k, ++at)
        effect.parameters.push_back(
            {term.candidate->free()[k].name, term.candidate->free()[k].unit, term.values[k],
             term.maps ? Interval{NAN, NAN} : all[at]});  // of a scale only the product with its maps is known
      for (std::size_t r = 0; r < term.candidate->refinements().size(); ++r) {
        if (term.candidate->refined(r)) continue;
        const FreeParameter& size = term.candidate->refinements()[r].parameters.front();
        effect.fixed.push_back({size.name, size.unit, size.off, {NAN, NAN}});
      }
      if (t >= d_->model_terms.size()) {
        const Found& found = d_->search.found[t - d_->model_terms.size()];
        effect.gain = found.gain;
        effect.p_value = found.p_value;
        effect.capture = found.capture;
        effect.rivals = found.rivals;
        for (const Rival& rival : found.rivals) {
          if (rival.tied) effect.tied_with.push_back(rival.candidate->name());
        }
        if (!found.where.empty()) effect.where = name_of(found.where[0]);
        State without = trained_;
        without.terms.erase(without.terms.begin() + static_cast<std::ptrdiff_t>(t));
        Problem dimmed = *problem_;
        brighten(dimmed, without);
        without = fit_nuisances(dimmed, without, std::vector<double>(d_->held_out.size(), 1)).state;
        effect.held_out_before = d_->put_aside > 0 ? gap(*problem_, without, distance, d_->held_out) : NAN;
        effect.held_out_after = d_->gaps[distance].held_out_after;
      }
      d_->effects.push_back(std::move(effect));
    }
    if (!d_->search.rest.empty())
      d_->notes.push_back(fmt::format(
          "Noise alone has {:.2f} mm from one condition to the next, as the fit needs it. With something unexplained a "
          "part of that is no noise.",
          1e3 * std::hypot(after.state.variances.jitter, after.state.variances.offset)));
    for (const auto& [name, why] : d_->search.refused)
      d_->notes.push_back(fmt::format("The effect {} was left out: {}", name, why));
    for (const Found& tried : d_->search.dropped)
      d_->notes.push_back(fmt::format("{} was tried and is not named: {}.", tried.name, tried.refutation));
  }

  /// The first that fits, in the order of the verdicts.
  void judge() {
    const bool rest = d_->search.something_left();
    const bool named = !d_->search.found.empty();
    const bool tied = std::ranges::any_of(d_->effects, [](const EffectResult& e) { return !e.tied_with.empty(); });
    d_->verdict = rest && !named ? Verdict::unknown
                  : rest         ? Verdict::named_with_rest
                  : tied         ? Verdict::tie
                  : named        ? Verdict::named
                                 : Verdict::nothing_found;
  }

  const graph::PluginRegistry& catalogue_;
  const DiagnosisOptions& options_;
  std::unique_ptr<Diagnosis> d_ = std::make_unique<Diagnosis>();
  std::optional<Problem> problem_;
  State before_, trained_;
  double share_ = 0.45;
};

}  // namespace

std::string_view verdict_name(Verdict verdict) {
  constexpr std::array<std::string_view, 5> names = {"unknown", "named_with_rest", "tie", "named", "nothing_found"};
  return names[static_cast<std::size_t>(verdict)];
}

std::unique_ptr<Diagnosis> diagnose(const graph::PluginRegistry& catalogue, const DiagnosisOptions& options) {
  return Run(catalogue, options).run();
}

}  // namespace tofgraph::diagnosis
