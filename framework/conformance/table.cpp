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
    {"texts", "Says in words what it, its ports and its parameters are", all, 3, 20, has_texts},
    {"units", "Gives the channels of the table their unit, type and shape", stages, 2, 20, keeps_units},
    {"parameters", "Every value of a parameter is the same when it is written and read again", made, 2, 20,
     reads_its_values},
    {"values", "Takes random values within its bounds and those at them, or refuses them in words", made, 4, 60,
     takes_values},
    {"lifetime", "Is made and destroyed 1000 times without keeping memory", made, 3, 60, lives_often},
    {"process", "Leaves the process as it was: locale, folder, signals, rounding, environment, files, threads", made, 4,
     60, leaves_the_process},
    {"runs", "Runs with its defaults on the channels that it declares, and hands on what it announces", stages, 1, 30,
     runs},
    {"memory", "Writes only its own memory and channels, and keeps the promise of the channel flags", stages, 2, 30,
     writes_its_own},
    {"lengths", "Makes lengths from 1 mm to 100 m of lengths from 0.5 m to 3 m", stages, 5, 30, keeps_lengths},
    {"sizes", "Takes frames of odd sizes and of one pixel, or refuses them in words", stages, 3, 60, takes_sizes},
    {"empty", "Takes frames without a pixel, or refuses them in words", readers, 4, 30, takes_empty},
    {"invalid", "Takes frames without a valid pixel", readers, 3, 30, takes_invalid},
    {"extremes", "Takes denormal, tiny and huge values", readers, 5, 30, takes_extremes},
    {"larger", "Takes a frame larger than announced without leaving its memory, or refuses it", readers, 6, 30,
     takes_larger},
    {"gaps", "Reads channels whose rows have gaps between them right, or refuses them", readers, 6, 30, takes_gaps},
    {"repeats", "Gives the same frames for the same frames", stages, 3, 60, repeats},
    {"stateless", "Remembers no frame when it says so: their order does not matter", readers, 4, 60, remembers_nothing},
    {"threads", "Works on several frames at the same time when it says so", readers, 5, 60, runs_on_threads},
    {"steady", "Asks for no memory after its first frames when it says so", stages, 4, 60, is_steady},
    {"growth", "Keeps no more memory with every frame", stages, 5, 60, keeps_its_memory},
    {"time", "Takes at most 1000 times as long for a frame as the median of its kind, or 0.1 s", filters, 9, 90,
     is_quick},
    {"off", "Changes no bit when all its sizes are off", "effect", 1, 30, is_off},
    {"finite", "Leaves finite light finite everywhere within its bounds", "effect", 2, 60, stays_finite},
    {"smooth", "Changes the light smoothly: differences over a hundredth and a thousandth of a size agree", "effect", 4,
     60, changes_smoothly},
    {"touches", "Changes the observables that it declares, and no others", "effect", 5, 60, touches_what_it_says},
    {"same", "Gives the same light for the same light, on several threads as well", "effect", 3, 60, effect_repeats},
    {"rubbish", "Refuses empty, random and cut files in words", "format", 2, 60, refuses_rubbish},
};

}  // namespace

std::span<const Check> checks() { return table; }

}  // namespace tofgraph::conformance
