// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: *
// Rooms: sdk graph cli conformance
// `plugin new` with the installed package alone: its output builds, passes its test and `plugin check` unchanged.
#include "tests/installed.hpp"

#include <gmock/gmock.h>

namespace tofgraph::tests {
namespace {

using testing::HasSubstr;

class PluginNew : public InstalledPrefix {
 protected:
  static void SetUpTestSuite() { InstalledPrefix::SetUpTestSuite(); }
};

class Project : public PluginNew, public testing::WithParamInterface<std::tuple<const char*, const char*>> {
 protected:
  const std::string kind = std::get<1>(GetParam()), language = std::get<0>(GetParam());
  const std::string library = "made/tofgraph_" + kind + "_first_try.so";

  /// Installed compilers for the language.
  std::vector<std::string> compilers() const {
    std::vector<std::string> all = {"g++ -std=c++20", "clang++ -std=c++20"};
    if (language == "c") all = {"gcc -std=c99 -pedantic", "clang -std=c99 -pedantic"};
    std::erase_if(all, [&](const std::string& one) { return !is_there(one.substr(0, one.find(' '))); });
    return all;
  }
  /// Command that builds the library.
  std::string built(const std::string& compiler) const {
    return "mkdir -p made && " + compiler +
           " -Wall -Wextra -Werror -shared -fPIC -fvisibility=hidden $(pkg-config --cflags tofgraph) "
           "-DTOFGRAPH_PLUGIN_NAME='\"first_try\"' -DTOFGRAPH_PLUGIN_VERSION='\"1.0\"' first_try/first_try." +
           (language == "c" ? "c" : "cpp") + " -o " + library;
  }
};

TEST_P(Project, BuildsAndPassesItsTestsAsItIs) {
  succeeds("$PREFIX/bin/tofgraph --quiet plugin new first_try --kind " + kind + " --language " + language);
  succeeds(
      "cd first_try && cmake -B build -DCMAKE_PREFIX_PATH=$PREFIX -DCMAKE_CXX_FLAGS='-Wconversion -Werror' "
      "-DCMAKE_C_FLAGS='-Wconversion -Werror' >log && cmake --build build >>log");
  const Outcome tested = run("cd first_try && ctest --test-dir build --output-on-failure");
  EXPECT_EQ(tested.exit_code, 0) << tested.out;
  EXPECT_THAT(tested.out, HasSubstr("100% tests passed, 0 tests failed out of 2"));
  const Outcome checked =
      run("$PREFIX/bin/tofgraph plugin check --strictness 10 first_try/build/tofgraph_" + kind + "_first_try.so");
  EXPECT_EQ(checked.exit_code, 0) << checked.out;
}

/// All compilers and optimisation levels; a C plugin is C99.
TEST_P(Project, IsTheSameWithEveryCompiler) {
  succeeds("$PREFIX/bin/tofgraph --quiet plugin new first_try --kind " + kind + " --language " + language);
  for (const std::string& compiler : compilers()) {
    for (const std::string level : {"-O0", "-O2"}) {
      succeeds(built(compiler + " " + level));
      const Outcome checked = run("$PREFIX/bin/tofgraph plugin check --strictness 2 " + library);
      EXPECT_EQ(checked.exit_code, 0) << compiler << ' ' << level << '\n' << checked.out;
    }
  }
}

/// The project's test under the address, leak and undefined behaviour sanitizers. The tofgraph programs are not
/// sanitized, so the sanitizer's library is preloaded.
TEST_P(Project, PassesItsTestUnderSanitizers) {
  succeeds("$PREFIX/bin/tofgraph --quiet plugin new first_try --kind " + kind + " --language " + language);
  std::string missing;
  for (const std::string& compiler : compilers()) {
    const bool clang = compiler.starts_with("clang");
    const std::string flags = std::string(" -O1 -fsanitize=address,undefined -fno-sanitize-recover=undefined") +
                              (clang ? " -shared-libsan" : "");
    if (run("mkdir -p made && echo 'int main() { return 0; }' >made/empty.cpp && " +
            std::string(clang ? "clang++" : "g++") + flags + " made/empty.cpp -o made/empty")
            .exit_code != 0) {
      missing += " " + compiler;
      continue;
    }
    succeeds(built(compiler + flags));
    succeeds((clang ? "clang++" : "g++") + flags +
             " -std=c++20 first_try/first_try_test.cpp $(pkg-config --cflags --libs tofgraph) -o made/test");
    // Its name contains the architecture or a version, depending on the compiler: the one that the test needs.
    const std::string runtime =
        compiler.substr(0, compiler.find(' ')) +
        " -print-file-name=$(readelf -d made/test | sed -n 's/.*NEEDED.*\\[\\(lib.*asan[^]]*\\).*/\\1/p')";
    const Outcome tested = run("RUNTIME=$(" + runtime +
                               "); LD_LIBRARY_PATH=$PREFIX/lib:$(dirname $RUNTIME) LD_PRELOAD=$RUNTIME "
                               "ASAN_OPTIONS=handle_segv=0:intercept_tls_get_addr=0 made/test made");
    EXPECT_EQ(tested.exit_code, 0) << compiler << '\n' << tested.err;
  }
  if (!missing.empty()) GTEST_SKIP() << "the sanitizers' libraries are not there for:" << missing;
}

INSTANTIATE_TEST_SUITE_P(Languages, Project,
                         testing::Combine(testing::Values("c++", "c"),
                                          testing::Values("source", "filter", "sink", "effect")),
                         [](const auto& info) {
                           return std::string(std::get<0>(info.param)) == "c"
                                      ? std::string("C_") + std::get<1>(info.param)
                                      : std::string("Cpp_") + std::get<1>(info.param);
                         });

TEST_F(PluginNew, StagesInPythonPassTheirTest) {
  if (run("PYTHONPATH=$PREFIX/lib/python3/dist-packages /usr/bin/python3 -c 'import tofgraph'").exit_code != 0)
    GTEST_SKIP() << "the Python package is not there";
  for (const std::string kind : {"source", "filter", "sink"}) {
    succeeds("$PREFIX/bin/tofgraph --quiet plugin new my_" + kind + " --language python --kind " + kind);
    const Outcome tested =
        run("cd my_" + kind + " && PYTHONPATH=$PREFIX/lib/python3/dist-packages /usr/bin/python3 -m unittest");
    EXPECT_EQ(tested.exit_code, 0) << tested.err;
    EXPECT_THAT(tested.err, testing::ContainsRegex("Ran [12] test"));
  }
}

TEST_F(PluginNew, RefusesWhatCannotBeDone) {
  const auto expect_refused = [&](const std::string& arguments, const std::string& words) {
    const Outcome outcome = run("$PREFIX/bin/tofgraph plugin new " + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_THAT(outcome.err, HasSubstr(words)) << arguments;
  };
  expect_refused("9lives", "'9lives' cannot be a plugin's name: small letters, digits and _, a letter first");
  expect_refused("Edge", "example: tofgraph plugin new edge_mask --kind filter");
  expect_refused("../edge", "cannot be a plugin's name");
  expect_refused("median", "there is a filter 'median' already: ");
  expect_refused("edge --kind colour", "'colour' is unknown, expected source, filter, sink, effect");
  expect_refused("edge --kind effect --language python", "an effect is evaluated for every ray");
  succeeds("mkdir -p edge && touch edge/kept");
  expect_refused("edge", "edge exists already, and nothing is overwritten");
  EXPECT_EQ(run("ls edge").out, "kept\n");
}

TEST_F(PluginNew, IsNamedAndHasNoLicenceOfOurs) {
  succeeds("$PREFIX/bin/tofgraph --quiet plugin new edge_mask2 -o here");
  EXPECT_THAT(read_text(folder_.path() / "here/edge_mask2.cpp"),
              HasSubstr("struct EdgeMask2 final : tofgraph::Filter"));
  EXPECT_EQ(run("grep -rE 'SPDX|my_plugin|MyPlugin|my_kind|my_source' here").out, "");
}

}  // namespace
}  // namespace tofgraph::tests
