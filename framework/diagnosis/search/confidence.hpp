// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Frequency with which a search is right on this very design: truths are injected and searched for.
#pragma once

#include "config/shard.hpp"
#include "diagnosis/data/ingest.hpp"
#include "diagnosis/model/fit.hpp"
#include "diagnosis/search/audit.hpp"
#include "diagnosis/search/crossfit.hpp"
#include "diagnosis/search/search.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>

namespace tofgraph::diagnosis {

struct Confidence {
  std::size_t named = 0, named_right = 0;    ///< searches that named an effect; rightly, ties counted
  std::size_t silent = 0, silent_right = 0;  ///< that found nothing; where nothing was
  std::size_t cases() const { return named + silent; }
};

/// Outcome of the search of one injected case.
struct CaseOutcome {
  bool named = false;  ///< an effect was named
  bool right = false;  ///< rightly; of a search that found nothing: nothing was injected
};

/// Division of the cases among runs. A case depends on its number alone, not on the number of cases.
struct CaseDivision {
  config::Shard shard;                                          ///< cases that are searched in this run
  std::function<std::optional<CaseOutcome>(std::size_t)> load;  ///< of a case that was searched before; may be empty
  std::function<void(std::size_t, const CaseOutcome&)> save;    ///< called after each search; may be empty
};

/// Injects, in turn, nothing and each effect that the audit calls visible at its typical size, with the noise, jitter
/// and light that were estimated, and searches. Cases of other shards that cannot be loaded are left out; those of this
/// shard are spread over the ranks and counted in the order of their numbers.
/// @param found the state whose reflectivities and variances are taken; what it has beyond the model is not injected
Confidence confidence(const Problem& problem, const std::vector<Term>& model,
                      const std::vector<std::unique_ptr<Candidate>>& candidates, const Audit& audit, const State& found,
                      std::size_t cases, SearchOptions options, const CaseDivision& division = {});

// ---- Campaigns of which the truth is known ----

/// Observations of the problem's own conditions and masks under another state: its effects, reflectivities, and
/// normal noise of the data's variances; jitter of board, camera and light, a wander, sessions and a residue of the
/// state's standard deviations; the boards as they are. A residue is new in each condition, whatever the data's
/// stays for. @throws simulation::EffectError
std::vector<Observations> injected(const Problem& problem, const State& state, std::uint64_t seed);

/// A term with each size at a factor of its typical value, of random sign where both are allowed, and shapes about
/// theirs (angles anywhere).
Term random_term(const Candidate& candidate, double factor, std::uint64_t seed);

// ---- Stability of the names ----

/// Runs with different conditions held out.
struct Stability {
  std::string put_aside;                         ///< each_distance, each_target, any_half
  std::vector<std::vector<std::string>> chosen;  ///< effects that a run added, for each run that gave a number
  CrossFit::Gap gap;                             ///< distance, of held-out conditions, m

  /// Share of the runs that added at least one of these: an effect, or what it is tied with.
  double chosen_share(std::span<const std::string> names) const;
  /// Number of runs that added an effect, by its name.
  std::map<std::string, std::size_t> counts() const;
};

/// Each distance held out alone; each target; and random halves of the levels (Meinshausen and Buehlmann, Stability
/// selection, 2010: halves without replacement vary as a bootstrap does, and no condition stands for a repetition of
/// itself). What could not be held out is left out.
/// @param halves how many of them
std::vector<Stability> stability(const Problem& problem, const std::vector<Term>& model,
                                 const std::vector<std::unique_ptr<Candidate>>& candidates, std::size_t halves,
                                 const SearchOptions& options);

// ---- Outcomes of injected cases in files, one a case, so that they can be searched in several runs ----

/// Files FOLDER/KEY-CASE.json. Those with another key are of other data or options and are ignored.
class CaseFiles {
 public:
  /// @param inputs, options all that the outcome of a case depends on, beside its number
  CaseFiles(std::filesystem::path folder, std::span<const InputFile> inputs, const std::string& options);

  /// Nothing for a case that is not there, or whose file is damaged.
  std::optional<CaseOutcome> load(std::size_t number) const;
  /// Writes the file whole or not at all. @throws std::runtime_error
  void save(std::size_t number, const CaseOutcome& outcome) const;

 private:
  std::filesystem::path path(std::size_t number) const;

  std::filesystem::path folder_;
  std::string key_;
};

}  // namespace tofgraph::diagnosis
