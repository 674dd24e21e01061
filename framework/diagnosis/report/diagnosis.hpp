// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Result of a gap search with its verdict, and the files that are written of it.
#pragma once

#include "diagnosis/data/ingest.hpp"
#include "diagnosis/model/intervals.hpp"
#include "diagnosis/model/nuisances.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/audit.hpp"
#include "diagnosis/search/confidence.hpp"
#include "diagnosis/search/given_model.hpp"
#include "diagnosis/search/next_condition.hpp"
#include "diagnosis/search/pixel_maps.hpp"
#include "diagnosis/search/pixel_spread.hpp"
#include "diagnosis/search/search.hpp"
#include "io/output_files.hpp"
#include "report/page.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

enum class Verdict { unknown, named_with_rest, tie, named, nothing_found };
std::string_view verdict_name(Verdict verdict);

struct ParameterResult {
  std::string name, unit;
  double value = 0;
  Interval interval;
  ParameterStatus status = ParameterStatus::determined;
  bool nonlinear = false;
  double off = 0, typical = 0;  ///< the former only of a size: where it changes nothing
};

struct EffectResult {
  std::string name, change;  ///< added, or refitted
  std::vector<std::string> tied_with;
  std::string where;
  std::vector<ParameterResult> parameters;
  std::vector<ParameterResult> fixed;              ///< that these data do not ask to vary; their intervals say nothing
  double held_out_before = 0, held_out_after = 0;  ///< gap of a fold, m: taken out of the model, and with it
  double chosen = NAN;                             ///< share of the folds; NaN: nothing could be held out
  double chosen_by_halves = NAN;                   ///< share of random halves of the data; NaN: not asked
  double gain = 0, p_value = 1, explained_fraction = 0;
  std::vector<Rival> rivals;
  std::string experiment;         ///< what tells it from what it is tied with
  std::vector<double> influence;  ///< share of each condition in the gain, see influence()

  /// True if most halves of the data do without it.
  bool is_weak() const { return chosen_by_halves < settings.min_share_of_halves; }
};

/// Gap in one observable, SI.
struct Gap {
  double before = 0, after = 0;
  double held_out_before = 0, held_out_after = 0, held_out_low = 0, held_out_high = 0;  ///< NaN: nothing held out
  double noise_floor = 0;                                                               ///< NaN: not measured
  double scatter_left = 0;                                                              ///< beside it
  double noise_and_scatter = 0;                                                         ///< without any gap
};

/// Origin of a diagnosis. Not in report.json, which is the same whenever it is made.
struct Origin {
  std::string command, date;  ///< the latter UTC
  double seconds = 0;
};

/// All that the reports need. Candidates and terms point into the members that own them.
struct Diagnosis {
  Verdict verdict = Verdict::nothing_found;
  std::vector<EffectResult> effects;
  std::array<Gap, observables> gaps;  ///< NaN where the data do not have the observable
  std::vector<std::string> notes;     ///< what a reader must know: masks, noise, what was left out; the next two, too
  std::vector<std::string> notes_on_found, notes_on_nuisances;
  Audit audit;
  SearchResult search;
  State as_it_was;                  ///< the model as written, with the reflectivities that suit it
  std::vector<NextCondition> next;  ///< what to measure, most telling first; ties before blind effects
  std::vector<InputFile> inputs;
  Origin origin;
  std::uint64_t seed = 1;
  std::optional<Confidence> confidence;
  std::vector<Stability> stability;          ///< where it was asked for, or the noise is unknown
  std::vector<PixelMap> maps;                ///< that were found
  std::optional<MeasuredContrast> contrast;  ///< where intensities are known
  std::optional<PixelSpread> spread;         ///< where a table states standard deviations over pixels
  double time_limit = 0;                     ///< s; 0: none
  Measurements measurements;
  std::string campaign_name;
  std::vector<std::string> campaign_notes;  ///< what the campaign says itself
  simulation::Model model;
  std::unique_ptr<GivenModel> given;
  std::vector<Term> model_terms;                       ///< of it
  std::vector<std::unique_ptr<Candidate>> candidates;  ///< that may be added
};

/// Summary in one sentence.
std::string summary(const Diagnosis& diagnosis);
/// formats: report.json and the extended model.
nlohmann::json report_json(const Diagnosis& diagnosis);
std::string model_yaml(const Diagnosis& diagnosis);
/// A scene of the most telling condition, with the extended model beside it; "" where none tells anything.
std::string next_condition_yaml(const Diagnosis& diagnosis);
inline constexpr const char* next_condition_name = "next_condition.yaml";
inline constexpr const char* map_file_name = "maps.h5";
inline constexpr const char* unexplained_map_name = "unexplained.svg";  ///< beside report.json, where something is left
/// The maps that the extended model names, for beside it; where none were estimated, those of a search before are
/// dropped. @throws std::runtime_error
void write_maps(const Diagnosis& diagnosis, const std::filesystem::path& folder, io::OutputFiles& files);

/// report.html: the verdict; measured, simulated and extended over the distance, by condition and over the sensor;
/// parameters; what each name rests on; what the data could not show; what to measure next.
report::Page gap_report(const Diagnosis& diagnosis);
/// SVG: what no effect explains, as an image; "" where there is nothing left.
std::string unexplained_map(const Diagnosis& diagnosis);

// ---- Notes on the data of a report: sentences, in the order in which they stand there ----

/// Notes on what was left out, and on what the measurements cannot determine. @param problem of these measurements
std::vector<std::string> notes_on(const Measurements& measurements, const Problem& problem);

/// Experiment that distinguishes an effect from a rival: advice of the author who lists the other as confusable.
std::string separating_experiment(const Candidate& found, const Rival& rival);

/// Sorts rivals: ties that need no value that the conditions leave open come first, then those with fewer parameters.
void sort_ties(std::vector<Rival>& rivals);

/// Notes on what the names and values that were found may stand for, and on assumptions that were not measured. Nothing
/// where nothing was found. @param problem of the measurements
std::vector<std::string> notes_on_found(const Problem& problem, const SearchResult& search);

/// Notes on the nuisances of conditions that are large enough to matter, except boards that stand elsewhere. @param
/// problem with what the search allowed
std::vector<std::string> notes_on_nuisances(const Problem& problem, const SearchResult& search);

/// "Condition white-3 is off by 20.0 mm: its board stands farther than the 1.200 m that are written, check that. It
/// counts less.", for each that is; nothing where something is left that may be the cause.
std::vector<std::string> notes_on_misplaced(const Design& design, const SearchResult& search);

/// Note on the contrast that a profile should have.
std::string note_on_contrast(const MeasuredContrast& contrast);

/// Notes on what was not written, and why: effects with which the model would be worse than the given one, and those
/// that a time limit did not reach. @param time_limit s
std::vector<std::string> notes_on_verification(const SearchResult& search, double time_limit);

/// Notes on the spread of pixels in the maps that were found, and on how well each is known.
std::vector<std::string> notes_on_maps(const std::vector<PixelMap>& maps);

}  // namespace tofgraph::diagnosis
