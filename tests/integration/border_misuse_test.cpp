// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Plugins that are correct except for one error: each is reported in a sentence that names the plugin's file and the
// error. They are built from tests/fixtures/misuse/misuse.cpp.
#include "tests/program.hpp"

#include <fmt/format.h>
#include <tofgraph/plugin.h>

#include <set>

namespace tofgraph::tests {
namespace {

const std::string misuse = TOFGRAPH_BINARY_DIR "/tests/misuse";

struct Case {
  const char *kind, *name, *sentence;
  std::string file() const { return fmt::format("{}/tofgraph_{}_{}.so", misuse, kind, name); }
};

/// Errors in the descriptor, found when the plugin is loaded.
const Case refused[] = {
    {"filter", "kind_null", "its kind is null"},
    {"filter", "kind_other", "calls itself sink 'kind_other'"},
    {"filter", "name_null", "its name is null"},
    {"filter", "name_other", "calls itself filter 'another'"},
    {"filter", "summary_null", "its summary is null"},
    {"filter", "version_null", "its version is null"},
    {"filter", "flags_unknown", "its flags are 64, which has unknown bits"},
    {"filter", "create_null", "its create() is null"},
    {"filter", "prepare_null", "its prepare() is null"},
    {"filter", "process_null", "its process() is null"},
    {"filter", "destroy_null", "its destroy() is null"},
    {"filter", "descriptor_small", "its descriptor has 100 bytes, expected at least 184"},
    {"filter", "ports_null", "its array of ports is null"},
    {"filter", "port_size_small", "its ports have 16 bytes each, expected at least 96"},
    {"filter", "port_size_absurd", "its ports have 4000000000 bytes each: is the size set?"},
    {"filter", "port_count_absurd", "it has 18446744073709551615 ports: is the count set?"},
    {"filter", "port_name_null", "its port's name is null"},
    {"filter", "port_name_empty", "its port '' has no name"},
    {"filter", "port_channel_null", "its channel of port 'distance' is null"},
    {"filter", "port_channel_empty", "its port 'distance' has no channel"},
    {"filter", "port_type_unknown", "its port 'distance' has the invalid element type 7"},
    {"filter", "port_direction_unknown", "its port 'distance' has the invalid direction 0"},
    {"filter", "port_flags_unknown", "its port 'distance' has the flags 8, some of which are unknown"},
    {"filter", "port_every_without_star", "its port 'distance' has the channel '*' without the flag EVERY"},
    {"filter", "port_unit_unknown", "its port 'distance' has the invalid unit 'furlong'"},
    {"filter", "port_shape_unknown", "its port 'distance' has the shape 'H x W', expected up to four of"},
    {"filter", "port_twice", "its port 'distance' is declared twice"},
    {"source", "source_reads", "its port 'distance' reads a channel, but nothing arrives at a source"},
    {"sink", "sink_makes", "its port 'distance' makes or changes a channel, but nothing leaves a sink"},
    {"effect", "effect_with_port", "its port 'distance' is a port, but an effect has parameters only"},
    {"filter", "parameters_null", "its array of parameters is null"},
    {"filter", "parameter_size_small", "its parameters have 8 bytes each, expected at least 80"},
    {"filter", "parameter_name_null", "its parameter's name is null"},
    {"filter", "parameter_name_empty", "its parameter '' has a name that cannot be written as a key"},
    {"filter", "parameter_name_blank", "its parameter 'a size' has a name that cannot be written as a key"},
    {"filter", "parameter_name_reserved", "its parameter 'inputs' has a name that is reserved: every node has it"},
    {"filter", "parameter_twice", "its parameter 'size' is declared twice"},
    {"filter", "parameter_kind_unknown", "its parameter 'size' has the invalid kind 99"},
    {"filter", "parameter_unit_unknown", "its parameter 'size' has the invalid unit 'furlong'"},
    {"filter", "parameter_flags_unknown", "its parameter 'size' has the flags 32, some of which are unknown"},
    {"filter", "default_no_number", "the default of a parameter cannot be used: 'size' is 'much': it is not a number"},
    {"filter", "default_wrong_unit", "the default of a parameter cannot be used: 'size' is"},
    {"filter", "default_out_of_range", "the default of a parameter cannot be used: 'size' is"},
    {"filter", "choices_none", "its parameter 'size' is a choice but lists no choices"},
    {"filter", "default_no_choice", "the default of a parameter cannot be used: 'size' is 'three'"},
    {"filter", "bounds_crossed", "its parameter 'size' has bounds of 5 to 2"},
    {"effect", "off_out_of_bounds", "its parameter 'size' is off at -1, which is outside its bounds"},
    {"effect", "typical_out_of_bounds", "its parameter 'size' is typically 7, which is outside its bounds"},
    {"effect", "typical_zero", "its parameter 'size' is typically 0: a search has no step for it"},
    {"filter", "required_with_default", "its parameter 'size' is required and has a default"},
    {"filter", "live_without_change", "its parameter 'size' may change, but change() is null"},
    {"effect", "extension_none", "has no extension \"effect\" of version 1"},
    {"effect", "extension_name_null", "its extension's name is null"},
    {"effect", "extension_data_null", "its effect's data is null"},
    {"effect", "extension_newer", "has no extension \"effect\" of version 1"},
    {"effect", "effect_small", "its effect has 8 bytes, expected at least 48"},
    {"effect", "apply_null", "its apply() is null"},
    {"effect", "level_unknown", "it acts on the invalid level 5"},
    {"effect", "scope_unknown", "its scope 2 is invalid"},
    {"effect", "touches_null", "its effect's touches is null"},
    {"effect", "touches_unknown", "it touches 'colour', expected distance"},
};

/// Errors in a call.
const Case starting[] = {
    {"filter", "self_null", "node 'self_null' (self_null): the stage cannot be created: create() returned nothing"},
    {"filter", "provides_without_name", "(provides_without_name): the plugin announced a channel without a name"},
    {"filter", "provides_without_size", "(provides_without_size): a struct is smaller than in API 2.0"},
    {"filter", "provides_null", "(provides_null): the plugin gave null as a channel"},
    {"filter", "message_null", "(message_null): the plugin gave null as the text of a message"},
    {"filter", "camera_without_size", "(camera_without_size): a struct is smaller than in API 2.0"},
};
const Case running[] = {
    {"filter", "provides_while_running", "frame 0: the plugin called provide() outside of prepare()"},
    {"filter", "view_without_size", "frame 0: the view for channel 'distance' has no size"},
    {"filter", "reads_null", "frame 0: the plugin gave null to read()"},
    {"filter", "writes_rank_0", "frame 0: channel 'depth' was to be written with 0 dimensions of type float32"},
    {"filter", "uses_file_while_running", "frame 0: uses_file() is for prepare()"},
    {"filter", "output_of_no_file", "frame 0: output() was asked for 'size', which is not an output"},
};
const Case simulating[] = {
    {"effect", "effect_provides", "effect effect_provides: the plugin called provide(), but an effect has no stream"},
    {"effect", "effect_output", "effect effect_output: output() was asked for 'path', which is not an output"},
};

void expect_told(const Case& wrong, const Outcome& outcome, int exit_code) {
  EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
  for (const std::string& words : {std::string(wrong.sentence), wrong.file()})
    EXPECT_NE(outcome.err.find(words), std::string::npos) << words << "\nis not in:\n" << outcome.err;
}

std::string name_of(const testing::TestParamInfo<Case>& info) { return info.param.name; }

class Refused : public testing::TestWithParam<Case> {};
TEST_P(Refused, IsTold) {
  expect_told(GetParam(), shell("\"$TOFGRAPH\" --plugin-path " + misuse + " describe " + GetParam().name, "/tmp"), 2);
}
INSTANTIATE_TEST_SUITE_P(Misuse, Refused, testing::ValuesIn(refused), name_of);

Outcome run(const std::string& name) {
  return shell("\"$TOFGRAPH\" --plugin-path " + misuse + " run 'ramp frames=2 ! " + name + " ! null'", "/tmp");
}

class Starting : public testing::TestWithParam<Case> {};
TEST_P(Starting, IsTold) { expect_told(GetParam(), run(GetParam().name), 2); }
INSTANTIATE_TEST_SUITE_P(Misuse, Starting, testing::ValuesIn(starting), name_of);

class Running : public testing::TestWithParam<Case> {};
TEST_P(Running, IsToldWithNodeAndFrame) {
  const Outcome outcome = run(GetParam().name);
  expect_told(GetParam(), outcome, 1);
  const std::string node = fmt::format("node '{0}' ({0}), frame 0", GetParam().name);
  EXPECT_NE(outcome.err.find(node), std::string::npos) << outcome.err;
}
INSTANTIATE_TEST_SUITE_P(Misuse, Running, testing::ValuesIn(running), name_of);

Outcome simulate(const std::string& effect) {
  const TemporaryFolder folder;
  write_text(folder.path() / "s.yaml",
             "scene: 1\ncamera: camcube2\nframes: 1\nintegration_time: 1 ms\nobjects:\n  - {type: board, distance: 1 "
             "m}\nmodel: {effects: [{effect: " +
                 effect + "}]}\n");
  return shell("\"$TOFGRAPH\" --plugin-path " + misuse + " simulate s.yaml -o a.h5", folder.path());
}

class Simulating : public testing::TestWithParam<Case> {};
TEST_P(Simulating, IsTold) {
  const bool at_once = std::string_view(GetParam().name) == "effect_provides";
  expect_told(GetParam(), simulate(GetParam().name), at_once ? 2 : 1);
}
INSTANTIATE_TEST_SUITE_P(Misuse, Simulating, testing::ValuesIn(simulating), name_of);

TEST(Misuse, NothingWrongIsNotRefused) {
  EXPECT_EQ(run("nothing_wrong").exit_code, 0) << run("nothing_wrong").err;
  EXPECT_EQ(simulate("nothing_wrong_effect").exit_code, 0) << simulate("nothing_wrong_effect").err;
}

TEST(Misuse, AFailureWithoutAWordIsToldAsThat) {
  const Outcome outcome = run("fails_without_a_word");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("frame 0: the stage failed without saying why"), std::string::npos) << outcome.err;
}

TEST(Misuse, EveryDefectIsTested) {
  std::set<std::string> tested = {"tofgraph_filter_nothing_wrong.so", "tofgraph_effect_nothing_wrong_effect.so",
                                  "tofgraph_filter_fails_without_a_word.so"};
  const auto add = [&](const auto& cases) {
    for (const Case& wrong : cases) tested.insert(std::filesystem::path(wrong.file()).filename());
  };
  add(refused), add(starting), add(running), add(simulating);
  std::set<std::string> made;
  for (const auto& entry : std::filesystem::directory_iterator(misuse)) made.insert(entry.path().filename());
  EXPECT_EQ(made, tested);
}

TEST(NewerPlugin, IsRefusedWithBothVersions) {
  const Outcome outcome =
      shell("\"$TOFGRAPH\" --plugin-path " TOFGRAPH_BINARY_DIR "/tests/grown/plugins describe grown_stage", "/tmp");
  EXPECT_EQ(outcome.exit_code, 2);
  const std::string sentence =
      fmt::format("tofgraph_filter_grown_stage.so: was built for plugin API {}.{}, this program has {}.{}",
                  TOFGRAPH_API_MAJOR, TOFGRAPH_API_MINOR + 1, TOFGRAPH_API_MAJOR, TOFGRAPH_API_MINOR);
  EXPECT_NE(outcome.err.find(sentence), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace tofgraph::tests
