// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Checks of `plugin check`: each has a name, a sentence and a function that throws on failure.
#pragma once

#include "graph/plugin.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::conformance {

/// Failure of a check; what() describes the plugin's error.
class Violation : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Check that does not apply to the plugin; what() gives the reason.
class NotApplicable : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Plugin under test. Each check runs in a process of its own.
struct Subject {
  std::filesystem::path path;
  std::uint64_t seed = 1;             ///< of the random values
  std::vector<std::string> settings;  ///< PARAMETER=VALUE
  std::filesystem::path scratch;      ///< initially empty; the working folder
  const graph::Plugin& plugin() const { return graph::load_plugin(graph::plugin_file(path)); }
};

struct Check {
  const char* name;
  const char* sentence;                ///< property that the check requires
  const char* kinds;                   ///< applicable kinds of plugin, blank-separated
  unsigned strictness;                 ///< 1 to 10: lowest level that includes this check
  unsigned seconds;                    ///< time limit
  std::string (*run)(const Subject&);  ///< @returns a remark, or nothing @throws Violation, NotApplicable
};

/// All checks in the order of their execution.
std::span<const Check> checks();

// One file per group. All throw Violation.
std::string loads(const Subject&);
std::string describes_itself(const Subject&);
std::string has_texts(const Subject&);
std::string keeps_units(const Subject&);
std::string reads_its_values(const Subject&);
std::string takes_values(const Subject&);
std::string lives_often(const Subject&);
std::string leaves_the_process(const Subject&);

std::string runs(const Subject&);
std::string writes_its_own(const Subject&);
std::string keeps_lengths(const Subject&);
std::string takes_sizes(const Subject&);
std::string takes_empty(const Subject&);
std::string takes_invalid(const Subject&);
std::string takes_extremes(const Subject&);
std::string takes_larger(const Subject&);
std::string takes_gaps(const Subject&);

std::string repeats(const Subject&);
std::string remembers_nothing(const Subject&);
std::string runs_on_threads(const Subject&);
std::string is_steady(const Subject&);
std::string keeps_its_memory(const Subject&);
std::string is_quick(const Subject&);

std::string is_off(const Subject&);
std::string stays_finite(const Subject&);
std::string changes_smoothly(const Subject&);
std::string touches_what_it_says(const Subject&);
std::string effect_repeats(const Subject&);

std::string refuses_rubbish(const Subject&);

}  // namespace tofgraph::conformance
