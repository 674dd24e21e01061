// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Result of a gap search with its verdict, and the files written from it.
#pragma once

#include "diagnosis/data/ingest.hpp"
#include "diagnosis/model/intervals.hpp"
#include "diagnosis/model/nuisances.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/confidence.hpp"
#include "diagnosis/search/given_model.hpp"
#include "diagnosis/search/maps.hpp"
#include "diagnosis/search/next_condition.hpp"
#include "diagnosis/search/pixel_spread.hpp"
#include "diagnosis/search/search.hpp"
#include "diagnosis/search/trials.hpp"
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
  double off = 0, typical = 0;  ///< off: of an amplitude parameter only
};

struct EffectResult {
  std::string name;
  const EffectFinding* found = nullptr;  ///< in Diagnosis::search; null: an effect of the given model, refitted
  std::vector<ParameterResult> parameters;
  std::vector<ParameterResult> fixed;  ///< not fitted; their intervals are NaN
  double chosen_by_halves = NAN;       ///< fraction of random halves of the data; NaN: not searched
  std::vector<double> influence;       ///< share of each condition in the gain, see influence()

  std::span<const Rival> rivals() const { return found != nullptr ? found->rivals : std::span<const Rival>(); }
  /// Tie with the most important experiment: that in place of several effects, else the first one; null: none.
  const Rival* main_tie() const;
  /// True if most random halves of the data do not choose it.
  bool is_weak() const { return chosen_by_halves < settings.min_share_of_halves; }
};

/// Gap in one observable, SI.
struct Gap {
  double before = 0, after = 0;
  double held_out_before = 0, held_out_after = 0, held_out_low = 0, held_out_high = 0;  ///< NaN: nothing held out
  double noise_floor = 0;                                                               ///< NaN: not measured
  double scatter_left = 0;                                                              ///< beyond the noise floor
  double noise_and_scatter = 0;                                                         ///< gap of a complete model
};

/// Conditions that were only predicted, because the campaign has more than are searched.
struct Unsearched {
  std::size_t conditions = 0;
  std::array<CrossFit::Gap, observables> gaps;  ///< NaN: not predicted
};

/// Sections of the report with notes of their own.
enum class NoteOn { data, names, nuisances, dropped };
struct Note {
  NoteOn on = NoteOn::data;
  std::string text;
};

/// Origin of a diagnosis; not in report.json, which is reproducible.
struct Origin {
  std::string command, date;  ///< date: UTC
  double seconds = 0;
};

/// Everything that the reports need. Candidates and terms point into the members that own them.
struct Diagnosis {
  Verdict verdict = Verdict::nothing_found;
  std::vector<EffectResult> effects;
  std::array<Gap, observables> gaps;  ///< NaN for observables without data
  std::optional<Unsearched> unsearched;
  std::vector<Note> notes;  ///< for the reader: masks, noise, exclusions
  Audit audit;
  SearchResult search;
  State given_as_written;           ///< the given model with its parameters, reflectivities and variances fitted
  std::vector<NextCondition> next;  ///< conditions to measure, most informative first; ties before blind effects
  std::vector<InputFile> inputs;
  Origin origin;
  std::uint64_t seed = 1;
  std::optional<Confidence> confidence;
  std::vector<Stability> stability;          ///< if requested, or if the noise is unknown
  std::vector<PixelMap> maps;                ///< maps in the extended model
  std::optional<MeasuredContrast> contrast;  ///< if intensities are known
  std::optional<PixelSpread> spread;         ///< if a table states standard deviations over pixels
  double time_limit = 0;                     ///< s; 0: none
  bool time_expired = false;                 ///< true: the time limit ended the search or what follows it
  Measurements measurements;                 ///< of the searched conditions
  std::optional<Problem> problem;            ///< of these measurements
  std::string campaign_name;
  std::vector<std::string> campaign_notes;  ///< notes in the campaign itself
  simulation::Model model;
  std::unique_ptr<GivenModel> given;
  Candidates candidates;  ///< effects that may be added

  std::vector<std::string> notes_on(NoteOn section) const;
  /// Number of conditions, searched and not.
  std::size_t conditions() const { return measurements.design->size() + (unsearched ? unsearched->conditions : 0); }
};

/// Summary in one sentence.
std::string summary(const Diagnosis& diagnosis);
/// Sentence on the conditions that were only predicted; "" if all were searched.
std::string text_on_unsearched(const Diagnosis& diagnosis);
/// Contents of report.json and of the extended model's file.
nlohmann::json report_json(const Diagnosis& diagnosis);
std::string model_yaml(const Diagnosis& diagnosis);
/// Scene of the most informative condition, with the extended model; "" if no condition is informative.
std::string next_condition_yaml(const Diagnosis& diagnosis);
inline constexpr const char* next_condition_name = "next_condition.yaml";
inline constexpr const char* map_file_name = "maps.h5";
inline constexpr const char* unexplained_map_name = "unexplained.svg";  ///< in the folder of report.json, unless empty
/// Writes the maps that the extended model names, beside it; without estimated maps, removes those of an earlier
/// search. @throws std::runtime_error
void write_maps(const Diagnosis& diagnosis, const std::filesystem::path& folder, io::OutputFiles& files);

/// report.html: the verdict; measured, simulated and extended over the distance, by condition and over the sensor;
/// parameters; the evidence for each effect; effects that the data could not show; what to measure next.
report::Page gap_report(const Diagnosis& diagnosis);
/// SVG image of the unexplained residual; "" if nothing is unexplained.
std::string unexplained_map(const Diagnosis& diagnosis);

// ---- Notes on the data for a report: sentences in the order of the report ----

/// Notes on exclusions, and on what the measurements cannot determine. @param problem of these measurements
std::vector<std::string> notes_on(const Measurements& measurements, const Problem& problem);

/// Notes on alternatives to the effects and values found, and on assumptions that were not measured. Empty if nothing
/// was found. @param problem of the measurements
std::vector<std::string> notes_on_found(const Problem& problem, const SearchResult& search);

/// Notes on the nuisances of conditions that are large enough to matter, except misplaced boards.
/// @param problem of the measurements
std::vector<std::string> notes_on_nuisances(const Problem& problem, const SearchResult& search);

/// Sentences about misplaced boards, each with the distance error and the stated distance; empty if something is
/// unexplained, which may be the cause.
std::vector<std::string> notes_on_misplaced(const Design& design, const SearchResult& search);

/// Note with the contrast that fits the taps, for a profile whose contrast is wrong.
std::string note_on_contrast(const MeasuredContrast& contrast);

/// Sentence on effects or values that were not written because the model would be worse than the given one; or "".
std::string note_on_not_written(const SearchResult& search);

/// Notes on effects that were not written, with reasons: note_on_not_written(), and those that a time limit excluded.
/// @param time_limit s
std::vector<std::string> notes_on_verification(const SearchResult& search, double time_limit);

/// Notes on the spread of the pixels in the maps, and on their uncertainty.
std::vector<std::string> notes_on_maps(const std::vector<PixelMap>& maps);

}  // namespace tofgraph::diagnosis
