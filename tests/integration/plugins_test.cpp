// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: PluginCache.DamagedEntries*
// Rooms: graph cli
// Deliberately faulty plugins: each is rejected with name and reason, none crashes the program.
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <elf.h>

namespace tofgraph::tests {
namespace {

const std::string broken = TOFGRAPH_BINARY_DIR "/tests/broken";

Outcome with_broken(const std::string& arguments) {
  return shell("\"$TOFGRAPH\" --plugin-path " + broken + " " + arguments, "/tmp");
}

struct Case {
  const char* plugin;
  const char* reason;
};

class Refusal : public testing::TestWithParam<Case> {};

TEST_P(Refusal, NamesFileAndReason) {
  const std::string plugin = GetParam().plugin;
  const Outcome run = with_broken("run 'ramp ! " + plugin + " ! null'");
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_NE(run.err.find("tofgraph_filter_" + plugin + ".so"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find(GetParam().reason), std::string::npos) << run.err;
  const Outcome describe = with_broken("describe " + plugin);
  EXPECT_EQ(describe.exit_code, 2);
  EXPECT_NE(describe.err.find(GetParam().reason), std::string::npos) << describe.err;
}

INSTANTIATE_TEST_SUITE_P(Broken, Refusal,
                         testing::Values(Case{"no_symbol", "has no symbol 'tofgraph_plugin'"},
                                         Case{"old_version", "was built for plugin API 0.0, this program has 2.1"},
                                         Case{"new_version", "was built for plugin API 2.99, this program has 2.1"},
                                         Case{"no_descriptor", "returned no descriptor"},
                                         Case{"joins_streams", "is a filter that takes any number of streams"},
                                         Case{"crashes_when_loaded", "crashed while it was being loaded (signal 11"},
                                         Case{"ends_the_process", "ended the process that loaded it (exit code 7)"},
                                         Case{"missing_library",
                                              "needs the library 'libtofgraph_absent.so', which is not installed"},
                                         Case{"undefined_symbol", "needs the symbol 'tofgraph_defined_nowhere'"}),
                         [](const auto& info) { return std::string(info.param.plugin); });

TEST(BrokenPlugin, ThatThrowsInItsConstructorIsToldWithItsWords) {
  const Outcome run = with_broken("run 'ramp ! throws_in_constructor ! null'");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("the stage cannot be created: the constructor gave up"), std::string::npos) << run.err;
}

TEST(BrokenPlugin, ThatThrowsWhileRunningEndsTheRunInOrder) {
  const TemporaryFolder folder;
  const Outcome run = shell(
      "\"$TOFGRAPH\" --plugin-path " + broken + " run 'ramp ! throws_in_process ! collect path=a.txt'", folder.path());
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find(
                "node 'throws_in_process' (throws_in_process), frame 3: threw something that is not a std::exception"),
            std::string::npos)
      << run.err;
  EXPECT_EQ(read_text(folder.path() / "a.txt"),
            "0 throws_in_process=0\n1 throws_in_process=1\n2 throws_in_process=2\n");
}

TEST(BrokenPlugin, ThatThrowsWhenItIsStoppedEndsTheRunInOrder) {
  const TemporaryFolder folder;
  const Outcome failed =
      shell("\"$TOFGRAPH\" run 'throws_in_stop ! make_depth fail_at=3 ! collect path=a.txt'", folder.path());
  EXPECT_EQ(failed.exit_code, 1) << failed.err;
  EXPECT_NE(failed.err.find("node 'make_depth' (make_depth), frame 3: told to fail"), std::string::npos) << failed.err;
  EXPECT_NE(failed.err.find("throws_in_stop: warning: cannot be stopped: the device does not answer"),
            std::string::npos)
      << failed.err;
  const Outcome interrupted = shell(
      "\"$TOFGRAPH\" run 'throws_in_stop ! collect path=b.txt' & " + once_it_writes("b.txt") + "kill -INT $!; wait $!",
      folder.path());
  EXPECT_EQ(interrupted.exit_code, 130) << interrupted.err;
}

TEST(BrokenPlugin, ThatGivesAnotherShapeIsRefused) {
  const Outcome run = with_broken("run 'ramp ! wrong_shape ! null'");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("frame 0: 'depth' is float32 2 x 3, but float32 4 x 8, m was announced"), std::string::npos)
      << run.err;
}

TEST(BrokenPlugin, ThatWritesWhatItDidNotAnnounceIsRefused) {
  const Outcome run = with_broken("run 'ramp ! writes_undeclared ! null'");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("wrote 'surprise', which it had not announced"), std::string::npos) << run.err;
}

TEST(BrokenPlugin, DoesNotKeepTheOthersFromBeingListed) {
  const Outcome list = with_broken("list --json");
  EXPECT_EQ(list.exit_code, 0);
  EXPECT_NE(list.out.find("\"make_depth\""), std::string::npos);
  EXPECT_NE(list.out.find("crashed while it was being loaded"), std::string::npos);
}

TEST(PluginPath, ThatIsNoFolderIsAMistake) {
  const TemporaryFolder folder;
  write_text(folder.path() / "file", "");
  for (const std::string& command : {std::string("list"), std::string("list cameras"), std::string("describe scale"),
                                     std::string("check 'ramp ! null'")}) {
    for (const char* path : {"absent", "file"}) {
      const Outcome outcome = shell(std::string("\"$TOFGRAPH\" --plugin-path ") + path + " " + command, folder.path());
      EXPECT_EQ(outcome.exit_code, 2) << command;
      EXPECT_EQ(outcome.err.find(std::string("plugin path ") + path + ": error: this is not a folder\n"), 0U)
          << outcome.err;
    }
  }
}

TEST(PluginPath, FilesThatAreNoPluginsAreToldOnceByList) {
  const TemporaryFolder folder;
  for (const char* name : {"tofgraph_filtre_mine.so", "mine.so", "notes.txt"}) write_text(folder.path() / name, "");
  const std::string program = "\"$TOFGRAPH\" --plugin-path " + folder.path().string();
  for (const char* what : {" list", " list effects", " list plugins", " list --json"}) {
    const Outcome outcome = shell(program + what, folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << what;
    EXPECT_EQ(outcome.err,
              "warning: " + folder.path().string() +
                  ": ignored, because a plugin must be called tofgraph_KIND_NAME.so (KIND: source, filter, sink, "
                  "effect, format): mine.so, notes.txt, tofgraph_filtre_mine.so\n")
        << what;
  }
  EXPECT_EQ(shell(program + " list --quiet", folder.path()).err, "");
}

TEST(PluginPath, FilesForAnotherArchitectureAreNamedWithIt) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "tofgraph_filter_foreign.so").string();
  std::string elf = read_text(TOFGRAPH_BINARY_DIR "/tests/plugins/tofgraph_filter_scale.so");
  elf[18] = static_cast<char>(EM_AARCH64);
  elf[19] = 0;
  write_text(file, elf);
  const std::string program = "\"$TOFGRAPH\" --plugin-path " + folder.path().string();
  const std::string reason = "is for another architecture: ARM of 64 bits, this program is x86-64\n";
  write_text(folder.path() / "p.yaml",
             "pipeline: 1\nnodes:\n  - {stage: ramp}\n  - {stage: foreign}\n  - {stage: null}\n");
  for (const char* command : {" check p.yaml", " run p.yaml"}) {
    const Outcome outcome = shell(program + command, folder.path());
    EXPECT_EQ(outcome.exit_code, 2) << command;
    EXPECT_EQ(outcome.err.find("p.yaml:4:13: error: plugin " + file + ": " + reason), 0U) << outcome.err;
  }
  const Outcome list = shell(program + " list", folder.path());
  EXPECT_EQ(list.exit_code, 0);
  EXPECT_NE(list.err.find("warning: plugin " + file + ": " + reason), std::string::npos) << list.err;
  const Outcome check = shell(program + " plugin check " + file + " --only loads", folder.path());
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_NE(check.out.find(reason), std::string::npos) << check.out;
}

TEST(PluginPath, OfTwoPluginsOfOneNameTheFirstIsUsedAndTold) {
  const TemporaryFolder folder;
  const std::filesystem::path theirs = TOFGRAPH_BINARY_DIR "/tests/plugins/tofgraph_filter_scale.so";
  const std::filesystem::path mine = folder.path() / theirs.filename();
  std::filesystem::copy_file(theirs, mine);
  const std::string program = "\"$TOFGRAPH\" --plugin-path " + folder.path().string();
  const std::string words = mine.string() + " is used; it hides " + theirs.string();
  for (const char* command : {" check 'ramp ! scale ! null'", " run 'ramp ! scale ! null'"}) {
    const Outcome outcome = shell(program + command, folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NE((outcome.out + outcome.err).find("scale: warning: " + words), std::string::npos)
        << command << outcome.out << outcome.err;
  }
  EXPECT_NE(shell(program + " list", folder.path()).err.find(mine.string() + " hides " + theirs.string()),
            std::string::npos);
  // A file that is named after one plugin and contains another.
  std::filesystem::rename(mine, folder.path() / "tofgraph_filter_other.so");
  const Outcome other = shell(program + " check 'ramp ! other ! null'", folder.path());
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.err.find("tofgraph_filter_other.so: calls itself filter 'scale'"), std::string::npos) << other.err;
}

TEST(PluginPath, OfTheEnvironmentThatIsNoFolderIsARemark) {
  const TemporaryFolder folder;
  const std::string command = "TOFGRAPH_PLUGIN_PATH=$TOFGRAPH_PLUGIN_PATH:absent \"$TOFGRAPH\" ";
  const Outcome outcome = shell(command + "run 'ramp ! null'", folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err.find("warning: TOFGRAPH_PLUGIN_PATH: absent is not a folder\n"), 0U) << outcome.err;
  EXPECT_EQ(shell(command + "--quiet run 'ramp ! null'", folder.path()).err, "");
}

TEST(Describe, OfACameraSaysWhatWasMeasured) {
  const TemporaryFolder folder;
  write_text(folder.path() / "mine.yaml",
             "profile: 1\nname: mine\nwidth: 8\nheight: 6\npixel_pitch: 40 um\nfocal_length: 12.8 mm\n"
             "principal_point: [3.5, 2.5]\nmodulation_frequency: 20 MHz\nmeasured: [principal_point]\n"
             "source: a first try\n");
  const Outcome outcome = shell("\"$TOFGRAPH\" describe ./mine.yaml --json", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto camera = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(camera["kind"], "camera");
  EXPECT_EQ(camera["name"], "mine");
  EXPECT_EQ(camera["source"], "a first try");
  EXPECT_EQ(camera["values"].size(), 6U) << camera;
  for (const auto& value : camera["values"]) EXPECT_EQ(value["measured"], value["key"] == "principal_point") << value;
  EXPECT_EQ(camera["values"][3],
            (nlohmann::json{{"key", "focal_length"}, {"value", "12.8 mm"}, {"measured", false}, {"assumed", false}}));
  const Outcome shown = shell("\"$TOFGRAPH\" describe camcube2", folder.path());
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_NE(shown.out.find("camera camcube2"), std::string::npos) << shown.out;
  EXPECT_NE(shown.out.find("20 MHz"), std::string::npos) << shown.out;
  const Outcome unknown = shell("\"$TOFGRAPH\" describe camcbe2", folder.path());
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_NE(unknown.err.find("did you mean 'camcube2'?"), std::string::npos) << unknown.err;
}

class PluginCache : public testing::Test {
 protected:
  TemporaryFolder folder;
  std::filesystem::path file = folder.path() / "cache" / "tofgraph" / "plugins.json";

  nlohmann::json listed() const {
    const Outcome outcome =
        shell("XDG_CACHE_HOME=" + (folder.path() / "cache").string() + " \"$TOFGRAPH\" list --json", folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  }
};

TEST_F(PluginCache, DamagedEntriesAreReadAnew) {
  const nlohmann::json right = listed(), cache = nlohmann::json::parse(read_text(file));
  ASSERT_GT(cache.size(), 10U);
  const auto without = [](nlohmann::json entry, const char* key) {
    entry.erase(key);
    return entry;
  };
  const auto emptied = [](nlohmann::json entry) {
    entry["plugin"] = nlohmann::json::object();
    return entry;
  };
  for (int kind = 0; kind < 6; ++kind) {
    nlohmann::json damaged = cache;
    for (nlohmann::json& entry : damaged) {
      const nlohmann::json kinds[] = {nlohmann::json(),           5,
                                      nlohmann::json::array({1}), without(entry, "plugin"),
                                      without(entry, "key"),      emptied(entry)};
      entry = kinds[kind];
    }
    write_text(file, damaged.dump());
    EXPECT_EQ(listed(), right) << kind;
    EXPECT_EQ(nlohmann::json::parse(read_text(file)), cache) << kind << ": not written anew";
  }
  for (const char* text : {"", "[1]", "null", "{\"a\":", "\xff\xfe"}) {
    write_text(file, text);
    EXPECT_EQ(listed(), right) << text;
    EXPECT_EQ(nlohmann::json::parse(read_text(file)), cache) << text;
  }
}

}  // namespace
}  // namespace tofgraph::tests
