// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The checks of `plugin check`: each has a name, a sentence and a function that throws.
#pragma once

#include "graph/plugin.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::conformance {

/// Failure of a check: what() says what the plugin does wrong.
class Violation : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A check that has nothing to look at: what() says why.
class NotApplicable : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The plugin under test. A check has the process to itself.
struct Subject {
  std::filesystem::path path;
  std::uint64_t seed = 1;             ///< of random values
  std::vector<std::string> settings;  ///< PARAMETER=VALUE
  std::filesystem::path scratch;      ///< an empty folder, the working folder
  const graph::Plugin& plugin() const { return graph::load_plugin(graph::plugin_file(path)); }
};

struct Check {
  const char* name;
  const char* sentence;                ///< what a plugin that passes does
  const char* kinds;                   ///< that it is for, blank-separated
  unsigned strictness;                 ///< from 1 to 10: runs from this one on
  unsigned seconds;                    ///< limit of its time
  std::string (*run)(const Subject&);  ///< @returns a remark, or nothing @throws Violation, NotApplicable
};

/// All checks, in the order in which they run.
std::span<const Check> checks();

// By group, a file each. Throw Violation.
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
