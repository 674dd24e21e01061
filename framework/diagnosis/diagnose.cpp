// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/diagnose.hpp"

#include "config/paths.hpp"
#include "diagnosis/data/plausibility.hpp"
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/report/diagnosis.hpp"
#include "diagnosis/search/confidence.hpp"
#include "diagnosis/search/maps.hpp"
#include "io/captures/campaign_captures.hpp"
#include "io/serial.hpp"
#include "io/sha256.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// All effects of the catalogue except the excluded ones. An unknown name is an error.
Candidates candidates_of(const graph::PluginRegistry& catalogue, const std::vector<std::string>& without,
                         std::vector<Note>& notes) {
  std::vector<std::string> names;
  std::vector<graph::PluginFile> files;
  for (const graph::PluginFile& file : catalogue.files()) {
    if (file.kind != "effect") continue;
    names.push_back(file.name);
    files.push_back(file);
  }
  for (const std::string& name : without) {
    if (!contains(names, name))
      throw config::ConfigurationError(fmt::format("--exclude-effect: error: there is no effect '{}'\n         {}",
                                                   name, config::suggestion(name, names, "effects")));
  }
  Candidates candidates;
  const auto seen = catalogue.describe(files);
  for (const graph::PluginFile& file : files) {
    if (contains(without, file.name)) continue;
    try {
      candidates.push_back(std::make_unique<Candidate>(catalogue.load(file, seen)));
    } catch (const std::runtime_error& error) {
      notes.push_back({.text = fmt::format("The effect {} is excluded: {}", file.name, error.what())});
    }
  }
  return candidates;
}

/// Removes conditions from a campaign. An unknown id is an error.
void leave_out(io::Campaign& campaign, const std::vector<std::string>& skip, std::vector<Note>& notes) {
  for (const std::string& id : skip) {
    const auto found = std::ranges::find(campaign.conditions, id, &io::Condition::id);
    if (found == campaign.conditions.end()) {
      std::vector<std::string> ids;
      for (const io::Condition& condition : campaign.conditions) ids.push_back(condition.id);
      throw config::ConfigurationError(
          fmt::format("--exclude-condition: error: there is no condition '{}'\n         {}", id,
                      config::suggestion(id, ids, "conditions")));
    }
    notes.push_back({.text = fmt::format("Excluded: {}: by --exclude-condition", id)});
    campaign.conditions.erase(found);
  }
}

/// Fractions of the progress: end of reading, start of the folds, end of the search; and the share of the remaining
/// progress that one step of the search takes.
constexpr double read_by = 0.1, folds_from = 0.55, found_by = 0.95, step_share = 0.04;

/// Parameters that are not fitted: refinements that the data do not require, and values of the given model that the
/// data do not determine.
std::vector<ParameterResult> fixed_of(const Candidate& candidate) {
  std::vector<ParameterResult> fixed;
  const auto add = [&](const FreeParameter& p, double value) {
    fixed.push_back({.name = p.name, .unit = p.unit, .value = value, .interval = {NAN, NAN}});
  };
  for (std::size_t r = 0; r < candidate.refinements().size(); ++r) {
    if (candidate.refined(r)) continue;
    const FreeParameter& size = candidate.refinements()[r].parameters.front();
    add(size, size.off);
  }
  for (const std::size_t index : candidate.held()) add(candidate.parameter(index), candidate.written(index));
  return fixed;
}

class Run {
 public:
  Run(const graph::PluginRegistry& catalogue, const DiagnosisOptions& options)
      : catalogue_(catalogue), options_(options) {}

  std::unique_ptr<Diagnosis> run() {
    io::Campaign campaign = read();
    IngestOptions ingest{d_->model.physical, options_.skip_missing, options_.max_conditions, {}};
    ingest.progress = [this](double share) {
      if (limit_.at(settings.searched_by).has_passed())
        throw std::runtime_error("--time-limit: error: it ended while captures were read, nothing was searched");
      progress(read_by * share, "reading captures");
    };
    d_->measurements = campaign.from_table ? measure_table(campaign, ingest) : measure(campaign, ingest);
    check_serial();
    require_consistent(d_->measurements);
    set_unsearched_aside(campaign);
    const Problem& problem = d_->problem.emplace(make_problem(*d_->measurements.design, d_->measurements.observations));
    note(notes_on(d_->measurements, problem));
    progress(read_by, "determining what these data can show");
    d_->given->hold_undetermined(problem, d_->candidates);
    d_->audit = audit(problem, given_terms(), d_->candidates);
    const SearchOptions search_options = searching();
    d_->search = search(problem, given_terms(), d_->candidates, search_options);
    if (!options_.shard.is_whole()) {
      inject(of_other_data(search_options));
      return std::move(d_);
    }
    note(d_->given->notes());
    if (has_maps(d_->search.after.state)) {
      progress(found_by, "fitting every pixel");
      d_->maps = pixel_maps(d_->measurements, problem, d_->search.after.state);
      note(notes_on_maps(d_->maps));
    }
    progress(found_by, "computing values and intervals");
    compute_gaps();
    if (whole_ && !d_->search.time_expired) predict_rest();
    const bool time_expired = d_->time_expired = d_->search.time_expired || limit_.at(1).has_passed();
    if (time_expired && !d_->search.time_expired)
      note({"The time limit passed after the search: nothing was searched again, and no next condition is advised."});
    for (EffectFinding& found : d_->search.found) sort_ties(found.rivals);
    describe();
    d_->spread = pixel_spread(campaign, d_->model.physical, problem, d_->search.after.state);
    if (d_->spread) note(notes_on_spread(*d_->spread));
    if (!time_expired)
      d_->next = next_conditions(
          problem, open_questions(problem, d_->search.after.state, d_->search.found, d_->search.dropped, d_->audit));
    judge();
    const SearchOptions further = of_other_data(search_options);
    if (const std::size_t halves = halves_to_search(); halves > 0 && !time_expired) search_again(halves, further);
    if (options_.confidence > 0 && !time_expired) inject(further);
    return std::move(d_);
  }

 private:
  /// Options for a search of other data: the given model is kept as it is now.
  static SearchOptions of_other_data(SearchOptions options) {
    options.given = nullptr;
    options.fold_done = nullptr;
    options.deadline = options.following = options.verification = options.comparison = {};
    return options;
  }

  /// Keeps only the conditions to be searched, in the diagnosis and in a campaign with too many of them.
  void set_unsearched_aside(io::Campaign& campaign) {
    const std::size_t all = d_->measurements.design->size(), searched = d_->measurements.searched.size();
    if (searched == all) return;
    d_->unsearched = Unsearched{.conditions = all - searched};
    Measurements kept = part(d_->measurements, d_->measurements.searched);
    whole_ = std::exchange(d_->measurements, std::move(kept));
    std::set<std::string_view> rest;
    for (const std::size_t i : left_by({.held = whole_->searched}, all))
      rest.insert(whole_->design->conditions()[i].id);
    std::erase_if(campaign.conditions, [&](const io::Condition& c) { return rest.contains(c.id); });
  }

  /// Predicts the conditions that were not searched.
  void predict_rest() {
    progress(found_by, "predicting the conditions that were not searched");
    const std::vector<std::size_t> rest = left_by({.held = whole_->searched}, whole_->design->size());
    const CrossFit predicted = predict_unsearched(*d_->problem, *whole_->design, whole_->observations, rest,
                                                  d_->given_as_written, d_->search.after.state, limit_.at(1));
    for (std::size_t o = 0; o < observables; ++o) d_->unsearched->gaps[o] = predicted.gap(o, "", options_.search.seed);
    if (const std::string& why = predicted.folds.front().failed; !why.empty())
      note({fmt::format("The conditions that were not searched could not be predicted: {}", why)});
  }

  void inject(const SearchOptions& options) {
    std::string basis = fmt::format("seed {} effects {} searched {} skip {}\n", options.seed, options.max_effects,
                                    d_->problem->data.size(), fmt::join(options_.exclude_conditions, ","));
    const io::Camera& camera = *d_->problem->design.camera_pointer();
    for (const std::filesystem::path& file : {camera.file, camera.bad_pixels_file})
      if (!file.empty()) basis += io::sha256_of_file(file) + "\n";
    for (const graph::PluginFile& file : catalogue_.files()) {
      const bool excluded = contains(options_.exclude_effects, file.name);
      if (file.kind == "effect" && !excluded) basis += io::sha256_of_file(file.path) + "\n";
    }
    if (const auto program = config::command_folder() / "diagnose.so"; std::filesystem::exists(program))
      basis += io::sha256_of_file(program);  // another version of the search may give other results
    const CaseFiles files(options_.cases, d_->inputs, basis);
    d_->confidence = confidence(*d_->problem, given_terms(), d_->candidates, d_->audit, d_->search.after.state,
                                options_.confidence, options, {options_.shard, files});
  }

  /// @throws config::ConfigurationError for a model of another device
  void check_serial() {
    const std::string problem = io::serial_problem(d_->model.serial, d_->measurements.serial, "the captures");
    if (problem.empty()) return;
    if (!options_.other_serial)
      throw config::ConfigurationError(
          fmt::format("{}: error: the model {}\n         give a model of that device, or --other-serial uses this one",
                      options_.model.string(), problem));
    note({fmt::format("The model {}: --other-serial uses it anyway.", problem)});
  }

  void progress(double share, const std::string& what) const {
    if (options_.progress) options_.progress(std::min(share, 0.99), what);
  }

  /// Options of the search. Each step takes a share of the remaining progress; the folds report their number.
  SearchOptions searching() {
    SearchOptions search = options_.search;
    search.deadline = limit_.at(settings.searched_by);
    search.following = limit_.at(settings.followed_by);
    search.verification = limit_.at(settings.verified_by);
    search.comparison = limit_.at(settings.compared_by);
    search.progress = [this](const std::string& what) {
      const std::lock_guard lock(mutex_);
      progress(share_ += step_share * (found_by - share_), what);
    };
    search.fold_done = [this](std::size_t done, std::size_t all) {
      const std::lock_guard lock(mutex_);
      share_ =
          std::max(share_, folds_from + (found_by - folds_from) * static_cast<double>(done) / static_cast<double>(all));
      progress(share_, fmt::format("predicting held-out conditions, fold {} of {}", done, all));
    };
    search.given = d_->given.get();
    search.alike = d_->audit.alike;
    return search;
  }

  void note(const std::vector<std::string>& notes, NoteOn section = NoteOn::data) {
    for (const std::string& text : notes) d_->notes.push_back({section, text});
  }

  /// Terms of the given model, with those values held that the data do not determine.
  const std::vector<Term>& given_terms() const { return d_->given->terms(); }

  io::Campaign read() {
    config::Diagnostics diagnostics;
    d_->model = simulation::load_model(options_.model, catalogue_, diagnostics);
    io::Campaign campaign = io::read_campaign(options_.data, diagnostics, io::Captures::may_be_missing);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    leave_out(campaign, options_.exclude_conditions, d_->notes);
    for (const io::Condition& condition : campaign.conditions) {
      if (!options_.skip_missing && !condition.capture.empty() && !std::filesystem::exists(condition.capture))
        diagnostics.error(
            condition.place("capture"), fmt::format("'capture': there is no file {}", condition.capture.string()),
            fmt::format("--exclude-condition {} continues without it, --skip-missing without all missing captures",
                        condition.id));
    }
    if (!simulation::is_for(d_->model, *campaign.camera))
      diagnostics.error(
          d_->model.camera_at,
          fmt::format("the model is for the camera '{}', the campaign {} was made with '{}'", d_->model.camera,
                      options_.data.string(), campaign.camera_name),
          "give the model that was made for this camera, or change its camera: if it is intended for this camera");
    io::check_captures(campaign, io::CapturesFor::search, diagnostics);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    warn_of_targets(campaign);
    d_->campaign_name = campaign.name;
    d_->campaign_notes = campaign.notes;
    d_->inputs = hashed_inputs(options_.model, options_.data, campaign.conditions);
    d_->seed = options_.search.seed;
    d_->time_limit = options_.time_limit;
    d_->candidates = candidates_of(catalogue_, options_.exclude_effects, d_->notes);
    d_->given = std::make_unique<GivenModel>(d_->model.effects, d_->seed);
    return campaign;
  }

  void warn_of_targets(const io::Campaign& campaign) {
    config::Diagnostics diagnostics;
    io::warn_of_targets(campaign, diagnostics);
    if (options_.warn && !diagnostics.all().empty()) options_.warn(diagnostics.text());
    for (const config::Diagnostic& one : diagnostics.all()) note({fmt::format("The {}: {}", one.message, one.hint)});
  }

  void compute_gaps() {
    const CrossFit& folds = d_->search.cross_fit;
    if (folds.empty() && !d_->search.time_expired && d_->search.not_better.empty())
      note({"No setting has enough levels to hold some out: the gap is that of the fit itself."});
    for (const FoldResult& fold : folds.folds) {
      if (!fold.failed.empty())
        note({fmt::format("Without {} {} no model could be fitted: {}", fold.fold.setting, fold.fold.levels,
                          fold.failed)});
    }
    // The given model is not refitted; only its reflectivities and standard deviations are.
    const Problem& problem = *d_->problem;
    const State& refitted = d_->search.refitted_given.state;
    d_->given_as_written =
        fit_as_written(problem, {given_terms(), refitted.log_reflectivity, refitted.random_sd}).state;
    const State& after = d_->search.after.state;
    const State flat = with_flat_boards(after);
    const std::array<double, observables> scatter = scatter_of(problem, after);
    for (std::size_t o = 0; o < observables; ++o) {
      const CrossFit::Gap out = folds.gap(o, "", options_.search.seed);
      const MeasuredNoise noise = measured_noise(problem, !d_->measurements.table, o);
      d_->gaps[o] = {.before = gap(problem, d_->given_as_written, o),
                     .after = gap(problem, flat, o, contrast_shift(problem, after, o)),
                     .held_out_before = out.before,
                     .held_out_after = out.after,
                     .held_out_low = out.low,
                     .held_out_high = out.high,
                     .noise_floor = noise.floor(),
                     .scatter_left = noise.scatter_left(scatter[o]),
                     .noise_and_scatter = noise.with_scatter(scatter[o])};
    }
    // If the time limit left no folds of the search, those that verified the model are used instead.
    if (const GapComparison& aside = d_->search.verified.held_out; folds.empty() && std::isfinite(aside.model))
      d_->gaps[distance].held_out_before = aside.given, d_->gaps[distance].held_out_after = aside.model;
  }

  void describe() {
    const Problem& problem = *d_->problem;
    const ModelFit& after = d_->search.after;
    const std::vector<Interval> all = intervals(problem, after, options_.search.seed + 2, d_->search.lack_of_fit);
    Eigen::Index j = 0;
    for (std::size_t t = 0; t < after.state.terms.size(); ++t) {
      const Term& term = after.state.terms[t];
      EffectResult effect{.name = term.candidate->name()};
      for (std::size_t k = 0; k < term.values.size(); ++k, ++j) {
        const FreeParameter& p = term.candidate->free()[k];
        const Interval interval =  // only scale times map is determined
            term.maps ? Interval{NAN, NAN} : all[static_cast<std::size_t>(j)];
        effect.parameters.push_back({p.name, p.unit, term.values[k], interval,
                                     parameter_status(p, interval, after.covariance(j, j)), p.nonlinear, p.off,
                                     p.typical});
      }
      effect.fixed = fixed_of(*term.candidate);
      if (t >= given_terms().size()) {
        effect.found = &d_->search.found[t - given_terms().size()];
        effect.influence = influence(problem, after.state, t);
      }
      d_->effects.push_back(std::move(effect));
    }
    d_->contrast = contrast_of(problem, after.state, d_->search.lack_of_fit);
    note(notes_on_found(problem, d_->search), NoteOn::names);
    if (has_maps(after.state)) note(notes_on_pattern_ties(problem, after, d_->candidates), NoteOn::names);
    note(notes_on_nuisances(problem, d_->search), NoteOn::nuisances);
    if (d_->contrast && d_->contrast->profile_is_off()) note({note_on_contrast(*d_->contrast)}, NoteOn::nuisances);
    note(notes_on_misplaced(problem.design, d_->search));
    note(notes_on_verification(d_->search, options_.time_limit));
    if (d_->search.cross_fit.empty() && !d_->search.found.empty() && !d_->search.time_expired)
      note(
          {"Nothing could be held out: these conditions have neither four distances nor several targets or sessions. "
           "The named effects are not validated out of sample."});
    for (const auto& [name, why] : d_->search.refused) note({fmt::format("The effect {} was excluded: {}", name, why)});
    for (const EffectFinding& tried : d_->search.dropped)
      note({fmt::format("{} was tried and is not named: {}.", tried.name, tried.refutation)}, NoteOn::dropped);
  }

  /// Number of random halves. Without repeated measurements the tests treat all residuals as noise that is independent
  /// between conditions; halves of the data show which effects depend on that assumption.
  std::size_t halves_to_search() const {
    if (options_.random_halves > 0) return options_.random_halves;
    return !d_->search.found.empty() && std::isnan(d_->gaps[distance].noise_floor) ? settings.halves : 0;
  }

  void search_again(std::size_t halves, SearchOptions options) {
    options.fold_done = [this](std::size_t done, std::size_t all) {
      const std::lock_guard lock(mutex_);
      progress(found_by + (1 - found_by) * static_cast<double>(done) / static_cast<double>(all),
               fmt::format("choosing effects again without parts of the data, {} of {}", done, all));
    };
    d_->stability = stability(*d_->problem, given_terms(), d_->candidates, halves, options);
    const auto of_halves = std::ranges::find(d_->stability, any_half, &Stability::put_aside);
    if (of_halves == d_->stability.end()) return;
    for (EffectResult& effect : d_->effects)
      if (effect.found != nullptr) effect.chosen_by_halves = of_halves->chosen_share(effect.found->names());
  }

  /// First verdict that applies, in their order.
  void judge() {
    const bool rest = d_->search.something_left();
    const bool named = !d_->search.found.empty();
    const bool tied = std::ranges::any_of(d_->effects, [](const EffectResult& e) { return e.main_tie() != nullptr; });
    d_->verdict = rest && !named ? Verdict::unknown
                  : rest         ? Verdict::named_with_rest
                  : tied         ? Verdict::tie
                  : named        ? Verdict::named
                                 : Verdict::nothing_found;
  }

  const graph::PluginRegistry& catalogue_;
  const DiagnosisOptions& options_;
  std::unique_ptr<Diagnosis> d_ = std::make_unique<Diagnosis>();
  std::optional<Measurements> whole_;  ///< of all conditions, if only some are searched
  const TimeLimit limit_{options_.time_limit};
  std::mutex mutex_;
  double share_ = read_by;
};

}  // namespace

std::unique_ptr<Diagnosis> diagnose(const graph::PluginRegistry& catalogue, const DiagnosisOptions& options) {
  return Run(catalogue, options).run();
}

}  // namespace tofgraph::diagnosis
