// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "conformance/check.hpp"

namespace tofgraph::conformance {
namespace {

constexpr const char *all = "source filter sink effect format", *made = "source filter sink effect",
                     *stages = "source filter sink", *readers = "filter sink", *filters = "filter";

constexpr Check table[] = {
    {"loads", "Loads with all its symbols, within 100 ms of processor time, and prints nothing to standard output", all,
     1, 20, loads},
    {"descriptor", "Describes itself by the rules of the interface", all, 1, 20, describes_itself},
    {"texts", "Describes itself, its ports and its parameters in words", all, 3, 20, has_texts},
    {"units", "Gives the standard channels their unit, type and shape", stages, 2, 20, keeps_units},
    {"parameters", "Each value of a parameter is the same after it is written and read again", made, 2, 20,
     reads_its_values},
    {"values", "Accepts random values within its bounds and the bounds themselves, or refuses them with a message",
     made, 4, 60, takes_values},
    {"lifetime", "Is created and destroyed 1000 times without keeping memory", made, 3, 60, lives_often},
    {"process", "Leaves the process unchanged: locale, folder, signals, rounding, environment, files, threads", made, 4,
     60, leaves_the_process},
    {"runs", "Runs with its defaults on the channels that it declares, and outputs the channels that it announces",
     stages, 1, 30, runs},
    {"memory", "Writes only its own memory and channels, and keeps the promise of the channel flags", stages, 2, 30,
     writes_its_own},
    {"lengths", "Turns lengths from 0.5 m to 3 m into lengths from 1 mm to 100 m", stages, 5, 30, keeps_lengths},
    {"sizes", "Accepts frames of odd sizes and of one pixel, or refuses them with a message", stages, 3, 60,
     takes_sizes},
    {"empty", "Accepts frames without pixels, or refuses them with a message", readers, 4, 30, takes_empty},
    {"invalid", "Accepts frames without a valid pixel", readers, 3, 30, takes_invalid},
    {"extremes", "Accepts denormal, tiny and huge values", readers, 5, 30, takes_extremes},
    {"larger", "Accepts a frame larger than announced without accessing memory out of bounds, or refuses it", readers,
     6, 30, takes_larger},
    {"gaps", "Reads channels whose rows have gaps between them correctly, or refuses them", readers, 6, 30, takes_gaps},
    {"repeats", "Gives the same results for the same frames", stages, 3, 60, repeats},
    {"stateless", "Remembers no frame if it declares so: their order does not matter", readers, 4, 60,
     remembers_nothing},
    {"threads", "Works on several frames at the same time if it declares so", readers, 5, 60, runs_on_threads},
    {"steady", "Allocates no memory after its first frames if it declares so", stages, 4, 60, is_steady},
    {"growth", "Does not use more memory with every frame", stages, 5, 60, keeps_its_memory},
    {"time", "Takes at most 1000 times the median time of its kind per frame, or 0.1 s", filters, 9, 90, is_quick},
    {"off", "Changes nothing if all its sizes are off", "effect", 1, 30, is_off},
    {"finite", "Leaves finite light finite everywhere within its bounds", "effect", 2, 60, stays_finite},
    {"smooth", "Changes the light smoothly: differences over a hundredth and a thousandth of a size agree", "effect", 4,
     60, changes_smoothly},
    {"touches", "Changes the observables that it declares, and no others", "effect", 5, 60, touches_what_it_says},
    {"same", "Gives the same results for the same light, also on several threads", "effect", 3, 60, effect_repeats},
    {"rubbish", "Refuses empty, random and truncated files with a message", "format", 2, 60, refuses_rubbish},
};

}  // namespace

std::span<const Check> checks() { return table; }

}  // namespace tofgraph::conformance
