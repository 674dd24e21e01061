// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Frequency of correct search results for this design: known truths are injected and searched for.
#pragma once

#include "config/shard.hpp"
#include "diagnosis/data/ingest.hpp"
#include "diagnosis/model/fit.hpp"
#include "diagnosis/search/crossfit.hpp"
#include "diagnosis/search/search.hpp"
#include "diagnosis/search/trials.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

namespace tofgraph::diagnosis {

struct Confidence {
  std::size_t named = 0, named_right = 0;    ///< searches that named an effect; correctly, ties included
  std::size_t silent = 0, silent_right = 0;  ///< searches that found nothing; those of them without an injected effect
  std::size_t cases() const { return named + silent; }
};

/// Outcome of the search of one injected case.
struct CaseOutcome {
  bool named = false;  ///< an effect was named
  bool right = false;  ///< correctly; if nothing was found: nothing was injected
};

class CaseFiles;

/// Division of the cases among runs. A case depends on its number only, not on the number of cases.
struct CaseDivision {
  config::Shard shard;     ///< cases searched in this run
  const CaseFiles& files;  ///< outcomes of earlier searches, to which a shard adds its own
};

/// Injects in turn nothing and each effect that is visible at its typical value according to the audit, with the
/// estimated noise, jitter and light, and searches. Cases of other shards that cannot be loaded are left out; those of
/// this shard are divided among the ranks and counted in the order of their numbers.
/// @param found state whose reflectivities and variances are used; its effects beyond the model are not injected
Confidence confidence(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates,
                      const Audit& audit, const State& found, std::size_t cases, SearchOptions options,
                      const CaseDivision& division);

// ---- Campaigns with known truth ----

/// Observations of the problem's conditions and masks under another state: its effects and reflectivities, normal noise
/// with the variances of the data, and jitter of board, camera and light, drift, sessions and smooth field with the
/// state's standard deviations; the boards' flatness is unchanged. The smooth field is drawn independently for each
/// condition, even if that of the data lasts. @throws simulation::EffectError
std::vector<Observations> injected(const Problem& problem, const State& state, std::uint64_t seed);

/// A term with each amplitude at a factor of its typical value, of random sign if both are allowed, and nonlinear
/// parameters near their typical values (angles anywhere).
Term random_term(const Candidate& candidate, double factor, std::uint64_t seed);

// ---- Stability of the names ----

/// Runs with different conditions held out.
struct Stability {
  std::string put_aside;                         ///< each_distance, each_target, any_half
  std::vector<std::vector<std::string>> chosen;  ///< added effects, one entry per run that succeeded
  CrossFit::Gap gap;                             ///< distance gap of held-out conditions, m

  /// Share of the runs that added at least one of these: an effect, or one tied with it.
  double chosen_share(std::span<const std::string> names) const;
  /// Number of runs that added an effect, by its name.
  std::map<std::string, std::size_t> counts() const;
};

/// Searches with each distance held out alone, with each target held out alone, and on random halves of the clusters
/// (Meinshausen and Buehlmann, Stability selection, 2010: halves drawn without replacement vary like bootstrap samples,
/// and no condition occurs twice). Levels that cannot be held out are skipped.
/// @param halves number of random halves
std::vector<Stability> stability(const Problem& problem, const std::vector<Term>& model, const Candidates& candidates,
                                 std::size_t halves, const SearchOptions& options);

// ---- Outcomes of injected cases in files, one file per case, so that several runs can share the search ----

/// Files FOLDER/KEY-CASE.json. Files with another key belong to other data or options and are ignored.
class CaseFiles {
 public:
  /// @param inputs, options everything that determines the outcome of a case, apart from its number
  CaseFiles(std::filesystem::path folder, std::span<const InputFile> inputs, const std::string& options);

  /// Returns nullopt if no folder is given, or the file is missing or damaged.
  std::optional<CaseOutcome> load(std::size_t number) const;
  /// Writes the file completely or not at all. @throws std::runtime_error
  void save(std::size_t number, const CaseOutcome& outcome) const;

 private:
  std::filesystem::path path(std::size_t number) const;

  std::filesystem::path folder_;
  std::string key_;
};

}  // namespace tofgraph::diagnosis
