// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Misbehaviour/*:Broken/*:BuiltIn/*:PluginCheck.NothingWrong*:PluginCheck.ACrash*
// Slow: PluginCheck.Finds*
// Rooms: conformance plugins graph cli
// `plugin check`: each misbehaviour is found by its check and reported with its sentence; correct plugins pass.
#include "tests/program.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include <set>

namespace tofgraph::tests {
namespace {

using testing::HasSubstr;

const std::string misbehaviour = TOFGRAPH_BINARY_DIR "/tests/misbehaviour";

Outcome check(const std::string& arguments) { return shell("\"$TOFGRAPH\" plugin check " + arguments, "/tmp"); }

struct Case {
  const char *kind, *name, *check, *sentence, *folder = "misbehaviour";
  std::string file() const {
    return std::string(TOFGRAPH_BINARY_DIR "/tests/") + folder + "/tofgraph_" + kind + "_" + name + ".so";
  }
};

const Case cases[] = {
    {"filter", "leaks_lives", "lifetime", "it leaks: "},
    {"filter", "leaks_frames", "growth", "it leaks: 10"},
    {"filter", "allocates", "steady", "it asks for memory 1 times a frame, but says that it does not"},
    {"filter", "data_race", "threads", "when several are in work at the same time: a data race"},
    {"filter", "wrong_unit", "lengths", "where about 1 m arrives: is it in another unit?"},
    {"filter", "declares_seconds", "units", "its port 'depth' has 'depth' in 's', but that channel is in 'm'"},
    {"filter", "writes_input", "memory", "the stage changed 'depth', which it only reads"},
    {"filter", "writes_behind", "memory", "the stage wrote beyond the end of the memory of 'depth'"},
    {"filter", "invalid_unflagged", "memory", "'depth' is NaN without the flag 'invalid' at 1 pixel"},
    {"filter", "remembers_frames", "stateless", "it remembers frames although it says that it is stateless"},
    {"filter", "changes_locale", "process", "it changes the locale of the process"},
    {"filter", "changes_folder", "process", "it changes the working folder of the process"},
    {"filter", "catches_signals", "process", "it changes the handlers of signals of the process"},
    {"filter", "rounds_down", "process", "floating-point numbers of the process"},
    {"filter", "leaves_files_open", "process", "it leaves files open"},
    {"filter", "leaves_threads", "process", "it leaves threads behind"},
    {"filter", "ignores_strides", "gaps", "when the rows of a channel have gaps between them"},
    {"filter", "throws_dice", "repeats", "two stages with the same settings give other frames for the same frames"},
    {"filter", "crashes_when_empty", "empty", "crashed (signal 6, Aborted): node 'crashes_when_empty'"},
    {"filter", "has_no_text", "texts", "parameter 'size' has no text"},
    {"filter", "refuses_frames", "runs", "it is prepared for a stream and then refuses its frames: not today"},
    {"filter", "crashes_at_a_bound", "values", "in prepare() of plugin"},
    {"filter", "crashes_when_invalid", "invalid", "in process() of plugin"},
    {"filter", "crashes_at_odd_sizes", "sizes", "in process() of plugin"},
    {"effect", "never_off", "off", "it changes the light although all its sizes are off"},
    {"effect", "wrong_derivative", "smooth", "the light does not change smoothly with 'size'"},
    {"effect", "becomes_nan", "finite", "it turns finite light into NaN or infinity at size: "},
    {"effect", "touches_other", "touches", "it changes 'distance' as much as anything, and does not declare it"},
    {"effect", "mixes_lights", "same", "it gives other light for the same light"},
};

/// Plugins with other defects.
const Case broken[] = {
    {"filter", "no_symbol", "descriptor", "has no symbol 'tofgraph_plugin'", "broken"},
    {"filter", "no_descriptor", "descriptor", "returned no descriptor", "broken"},
    {"filter", "old_version", "descriptor", "was built for plugin API 0.0, this program has ", "broken"},
    {"filter", "new_version", "descriptor", "was built for plugin API 2.99, this program has ", "broken"},
    {"filter", "joins_streams", "descriptor", "is a filter that takes any number of streams", "broken"},
    {"filter", "crashes_when_loaded", "loads", "crashed (signal", "broken"},
    {"filter", "ends_the_process", "loads", "ended the process (exit code 7)", "broken"},
    {"filter", "missing_library", "loads", "libtofgraph_absent.so: cannot open shared object file", "broken"},
    {"filter", "undefined_symbol", "loads", "undefined symbol: tofgraph_defined_nowhere", "broken"},
    {"filter", "throws_in_constructor", "runs", "the stage cannot be created: the constructor gave up", "broken"},
    {"filter", "throws_in_process", "stateless", "threw something that is not a std::exception", "broken"},
    {"filter", "crashes_in_prepare", "runs", "crashed (signal 11, Segmentation fault): node ", "broken"},
    {"filter", "crashes_in_process", "runs", "crashed (signal 11, Segmentation fault): node ", "broken"},
    {"filter", "ends_the_program", "runs", "ended the process", "broken"},
    {"filter", "wrong_shape", "runs", "was announced", "broken"},
    {"filter", "writes_undeclared", "runs", "wrote 'surprise', which it had not announced", "broken"},
    {"filter", "never_returns", "runs", "does not end within 30 s", "broken"},
    {"filter", "never_stops_calling", "runs", "crashed (signal 11, Segmentation fault): node ", "broken"},
    {"filter", "prepares_slowly", "lifetime", "does not end within 60 s", "broken"},
    {"filter", "loads_slowly", "loads", "it waits for ", "noisy"},
    {"filter", "prints_when_loaded", "loads", "it prints 'a licence is needed' to standard output", "noisy"},
    {"filter", "prints_an_empty_line", "loads", "it prints '' to standard output", "noisy"},
    {"effect", "gives_nan", "finite", "it turns finite light into NaN or infinity", "broken_effects"},
    {"effect", "gives_up", "finite", "and then refuses the light: effect gives_up: there is no table",
     "broken_effects"},
    {"effect", "crashes_in_apply", "same", "in apply() of plugin", "crashing"},
    {"filter", "self_null", "runs", "create() returned nothing", "misuse"},
    {"filter", "provides_without_name", "runs", "the plugin announced a channel without a name", "misuse"},
    {"filter", "provides_without_size", "runs", "a struct is smaller than in API 2.0", "misuse"},
    {"filter", "provides_null", "runs", "the plugin gave null as a channel", "misuse"},
    {"filter", "message_null", "runs", "the plugin gave null as the text of a message", "misuse"},
    {"filter", "camera_without_size", "runs", "a struct is smaller than in API 2.0", "misuse"},
    {"effect", "effect_provides", "off", "the plugin called provide(), but an effect has no stream", "misuse"},
    {"effect", "effect_output", "off", "output() was asked for 'path', which is not an output", "misuse"},
};

class Misbehaves : public testing::TestWithParam<Case> {};
TEST_P(Misbehaves, IsFoundByItsCheck) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer ends the process first";
#endif
  const Outcome outcome = check(GetParam().file() + " --only " + GetParam().check);
  EXPECT_EQ(outcome.exit_code, 1) << outcome.out << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr(GetParam().sentence));
}
INSTANTIATE_TEST_SUITE_P(Misbehaviour, Misbehaves, testing::ValuesIn(cases),
                         [](const auto& info) { return std::string(info.param.name); });

INSTANTIATE_TEST_SUITE_P(Broken, Misbehaves, testing::ValuesIn(broken),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(PluginCheck, EveryMisbehaviourIsTested) {
  std::set<std::string> tested = {misbehaviour + "/tofgraph_filter_well.so",
                                  misbehaviour + "/tofgraph_effect_well_effect.so"};
  std::set<std::string> made;
  for (const Case& one : cases) tested.insert(one.file());
  for (const Case& one : broken) {
    if (std::string_view(one.folder) != "misuse") tested.insert(one.file());  // all cases of misuse are tested below
  }
  for (const char* folder : {"misbehaviour", "broken", "broken_effects", "crashing", "noisy"}) {
    for (const auto& entry : std::filesystem::directory_iterator(std::string(TOFGRAPH_BINARY_DIR "/tests/") + folder))
      made.insert(entry.path());
  }
  EXPECT_EQ(made, tested);
}

TEST(PluginCheck, FindsEveryMisuse) {
  for (const auto& entry : std::filesystem::directory_iterator(TOFGRAPH_BINARY_DIR "/tests/misuse")) {
    const bool well = entry.path().stem().string().find("nothing_wrong") != std::string::npos;
    const Outcome outcome = check(entry.path().string() + " --strictness 1");
    EXPECT_EQ(outcome.exit_code, well ? 0 : 1) << entry.path() << '\n' << outcome.out << outcome.err;
  }
}

TEST(PluginCheck, FindsRulesThatASettingBreaks) {
  const std::string file =
      TOFGRAPH_BINARY_DIR "/tests/invalid/tofgraph_filter_bends_rules.so --only memory --set rule=";
  EXPECT_EQ(check(file + "none").exit_code, 0);
  for (const auto& [rule, sentence] :
       {std::pair("nan", "'depth' is NaN without the flag 'invalid'"),
        std::pair("flag", "'depth' is a number despite the flag 'invalid'"),
        std::pair("reads", "the stage changed 'distance', which it only reads"),
        std::pair("before", "the stage wrote before the memory of 'depth'"),
        std::pair("behind", "the stage wrote beyond the end of the memory of 'depth'")}) {
    const Outcome outcome = check(file + rule);
    EXPECT_EQ(outcome.exit_code, 1) << rule;
    EXPECT_THAT(outcome.out, HasSubstr(sentence));
  }
}

TEST(PluginCheck, NothingWrongPassesAtTheHighestStrictness) {
  for (const char* name : {"filter_well", "effect_well_effect"}) {
    const Outcome outcome = check(misbehaviour + "/tofgraph_" + name + ".so --strictness 10 --json");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.out;
    const auto report = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(report.at("failed"), 0);
    EXPECT_EQ(report.at("seed"), 1);
    for (const auto& one : report.at("checks")) {
      const bool steady = one.at("name") == "steady";  // it does not declare that property
      EXPECT_EQ(one.at("result"), steady ? "skipped" : "passed") << one;
    }
  }
}

TEST(PluginCheck, ACrashTakesOnlyItsCheckDown) {
  const std::string broken = TOFGRAPH_BINARY_DIR "/tests/broken/tofgraph_filter_";
  const Outcome crashes = check(broken + "crashes_in_process.so");
  EXPECT_EQ(crashes.exit_code, 1) << crashes.err;
  EXPECT_THAT(crashes.out, HasSubstr("crashed (signal 11, Segmentation fault): node 'crashes_in_process'"));
  EXPECT_THAT(crashes.out, HasSubstr("passed   texts"));
  const Outcome ends = check(broken + "ends_the_process.so --only runs");
  EXPECT_EQ(ends.exit_code, 1) << ends.err;
  EXPECT_THAT(ends.out, HasSubstr("ended the process (exit code"));
  const Outcome loading = check(broken + "crashes_when_loaded.so --only loads");
  EXPECT_EQ(loading.exit_code, 1) << loading.err;
  EXPECT_THAT(loading.out, HasSubstr("crashed (signal"));
}

TEST(PluginCheck, ListsItsChecks) {
  const Outcome list = check("--list");
  EXPECT_EQ(list.exit_code, 0);
  for (const Case& one : cases) EXPECT_THAT(list.out, HasSubstr(std::string("  ") + one.check + " "));
}

TEST(PluginCheck, WrongUseIsTold) {
  const auto expect_refused = [](const std::string& arguments, const std::string& words) {
    const Outcome outcome = check(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_THAT(outcome.err, HasSubstr(words)) << arguments;
  };
  const std::string well = misbehaviour + "/tofgraph_filter_well.so";
  expect_refused("", "FILE is missing");
  expect_refused("/nowhere/tofgraph_filter_a.so", "there is no file /nowhere/tofgraph_filter_a.so");
  expect_refused("/bin/sh", "a plugin must be called tofgraph_KIND_NAME.so");
  expect_refused(well + " --only dreams", "there is no check 'dreams'");
  expect_refused(well + " --only off", "the check 'off' is for effect, not for a filter");
  expect_refused(well + " --strictness 11", "'11' is not a whole number from 1 to 10");
  expect_refused(well + " --set size", "'size' is not PARAMETER=VALUE");
}

/// Parameter values of plugins that require some; $CAPTURE is a recording.
const std::map<std::string, std::string> settings = {
    {"filter_channels", "--set 'drop=[amplitude]'"},
    {"filter_orient", "--set turn=180"},
    {"filter_intrinsics", "--set 'fx=316 px'"},
    {"filter_mask", "--set 'min_amplitude=50 counts'"},
    {"sink_live_view", "--set port=0"},
    {"sink_ply_writer", "--set 'path=cloud_{frame:06}.ply'"},
    {"source_capture_reader", "--set file=" TOFGRAPH_SOURCE_DIR "/pipelines/data/o3d303_scene.h5"},
};

class BuiltInPlugin : public testing::TestWithParam<std::string> {};
TEST_P(BuiltInPlugin, PassesAtTheHighestStrictness) {
  const auto set = settings.find(GetParam());
  const Outcome outcome = check(TOFGRAPH_BINARY_DIR "/lib/tofgraph/plugins/tofgraph_" + GetParam() +
                                ".so --strictness 10 " + (set != settings.end() ? set->second : ""));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
}

std::vector<std::string> built_in() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(TOFGRAPH_BINARY_DIR "/lib/tofgraph/plugins"))
    names.push_back(entry.path().stem().string().substr(9));
  std::ranges::sort(names);
  return names;
}
INSTANTIATE_TEST_SUITE_P(BuiltIn, BuiltInPlugin, testing::ValuesIn(built_in()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace tofgraph::tests
