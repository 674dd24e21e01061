// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Installed.EveryHeader*:Installed.HeadersCompile*:Installed.CMake*:Installed.ThePage*:Compilers/*
// Rooms: sdk graph cli
// The installation serves plugin authors and embedders without the source tree, also after moving the prefix.
#include "tests/installed.hpp"

#include <gmock/gmock.h>

#include <sstream>

namespace tofgraph::tests {
namespace {

using testing::HasSubstr;

class Installed : public InstalledPrefix {
 protected:
  static void SetUpTestSuite() { InstalledPrefix::SetUpTestSuite(); }
  /// The plugins in folder `plugins` and the program `embed` work as documented in their sources.
  void work() const {
    const Outcome filter = run("$PREFIX/bin/tofgraph --plugin-path plugins describe depth_gain");
    EXPECT_EQ(filter.exit_code, 0) << filter.err;
    EXPECT_THAT(filter.out, HasSubstr("Multiplies the depth by a factor"));
    EXPECT_EQ(run("$PREFIX/bin/tofgraph --plugin-path plugins describe path_error").exit_code, 0);
    // The board at 1 m with and without the gain of 1.01.
    EXPECT_EQ(run("./embed depth_gain plugins").out, "1.0100\n1.0100\n") << run("./embed depth_gain plugins").err;
    EXPECT_EQ(run("./embed flying_pixels plugins").out, "1.0000\n1.0000\n");
    EXPECT_THAT(depth_with("path_error, size: 20 mm"), HasSubstr(" 1020.0"));
  }
  /// Measured depth of a board at 1 m, with the effect of a model.
  std::string depth_with(const std::string& effect) const {
    write_text(folder_.path() / "model.yaml", "model: 1\neffects:\n  - {effect: " + effect + "}\n");
    const Outcome measured =
        run("$PREFIX/bin/tofgraph $([ -d plugins ] && echo --plugin-path plugins) run \"simulator model=model.yaml "
            "distance='1 m' frames=1 noise=none ! four_phase_decoder ! optimized_bistatic ! statistics value='1 m'\" "
            "--camera camcube2");
    return measured.out + measured.err;
  }
};

const char* const all_headers =
    "cd $PREFIX/include && find tofgraph -name '*.h' -o -name '*.hpp' | sort | sed 's/.*/#include <&>/'";
/// Compiles the standard input; the headers of PCL and Eigen are treated as system headers.
const std::string compiles =
    "-std=c++20 -fsyntax-only -Wall -Wextra -Wconversion -Werror $(pkg-config --cflags tofgraph) -isystem "
    "/usr/include/eigen3 $(printf ' -isystem %s' /usr/include/pcl-*) -DTOFGRAPH_PLUGIN_NAME='\"x\"' "
    "-DTOFGRAPH_PLUGIN_VERSION='\"1\"' -x c++ -";

TEST_F(Installed, EveryHeaderCompilesAlone) {
  EXPECT_THAT(run(all_headers).out, HasSubstr("tofgraph/physics/lens.hpp"));
  succeeds("(" + std::string(all_headers) + ") >all && while read -r line; do echo \"$line\" | g++ " + compiles +
           " || exit 1; done <all");
}

TEST_F(Installed, HeadersCompileTogetherInBothOrders) {
  for (const std::string compiler : {"g++ ", "clang++ "}) {
    if (!is_there(compiler)) continue;
    succeeds("(" + std::string(all_headers) + ") | " + compiler + compiles);
    succeeds("(" + std::string(all_headers) + ") | tac | " + compiler + compiles);
  }
}

TEST_F(Installed, TheBorderIsC) {
  for (const std::string header : {"plugin.h", "effect.h"}) {
    succeeds("echo '#include <tofgraph/" + header +
             ">' | gcc -std=c99 -pedantic -Wall -Wextra -Werror -fsyntax-only $(pkg-config --cflags tofgraph) -x c -");
  }
}

TEST_F(Installed, WhatIsLoadedLiesInTheMovedPrefix) {
  const Outcome loaded =
      run("find $PREFIX -type f \\( -name '*.so*' -o -path '*/bin/*' -o -name tofgraph-scan \\) -exec ldd {} + | "
          "sed -n 's/^\\t\\(libtofgraph[^(]*\\).*/\\1/p' | sed 's/.* => //' | xargs realpath | sort -u");
  std::string libraries;
  for (const std::string room : {"", "_config", "_io", "_io_captures"})
    libraries += (folder_.path() / ("moved/lib/libtofgraph" + room + ".so." TOFGRAPH_VERSION)).string() + "\n";
  EXPECT_EQ(loaded.out, libraries);
  const Outcome paths =
      run("find $PREFIX -type f -exec readelf -d {} + 2>/dev/null | sed -n 's/.*R.*PATH.*\\[\\(.*\\)]/\\1/p' | "
          "tr ':' '\\n' | LC_ALL=C sort -u");
  // The last but one is the Python package's.
  EXPECT_EQ(paths.out, "$ORIGIN\n$ORIGIN/..\n$ORIGIN/../..\n$ORIGIN/../../..\n$ORIGIN/../lib\n");
}

TEST_F(Installed, ProgramCommandsAndModulesWork) {
  // A profile, plugins with and without libtofgraph_io_captures, and the module that reads images.
  const std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (204, 204), }\n";
  std::string map("\x93NUMPY\x01\x00", 8);
  map += {static_cast<char>(header.size()), '\0'};
  map += header;
  const double offset = 0.02;
  for (int pixel = 0; pixel < 204 * 204; ++pixel) map.append(reinterpret_cast<const char*>(&offset), sizeof offset);
  write_text(folder_.path() / "map.npy", map);
  EXPECT_THAT(depth_with("fixed_pattern, scale: 1, map: {file: map.npy, unit: m}"), HasSubstr(" 1020.0"));
  // A command implemented as a module.
  write_text(folder_.path() / "scene.yaml",
             "scene: 1\ncamera: camcube2\nobjects:\n  - {name: board, type: board, distance: 1 m}\n");
  succeeds("$PREFIX/bin/tofgraph simulate scene.yaml -o board.h5 2>log");
  succeeds("$PREFIX/bin/tofgraph run --quiet 'capture_reader file=board.h5 ! null'");
}

TEST_F(Installed, CMakeBuildsPluginsAndPrograms) {
  succeeds(
      "cmake -S $OUTSIDE -B build -DCMAKE_PREFIX_PATH=$PREFIX -DCMAKE_BUILD_TYPE=Release "
      "-DCMAKE_CXX_FLAGS='-Wall -Wextra -Wconversion -Werror' >log && cmake --build build >>log && "
      "mkdir plugins && cp build/tofgraph_*.so plugins && cp build/embed .");
  work();
  EXPECT_THAT(run("$PREFIX/bin/tofgraph --plugin-path plugins describe depth_gain --json").out,
              testing::AllOf(HasSubstr("A. Uthor"), HasSubstr("MIT"), HasSubstr("1.2")));
  // Plugins installed into tofgraph's own prefix are found without options.
  succeeds("cmake --install build --prefix $PREFIX >log && $PREFIX/bin/tofgraph describe depth_gain >log");
}

/// Text of a page's code blocks in one language.
std::string blocks(const std::string& page, const std::string& language) {
  std::istringstream lines(read_text(page));
  std::string found;
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("```"))
      inside = line == "```" + language;
    else if (inside)
      found += line + '\n';
  }
  return found;
}

TEST_F(Installed, ThePageOfTheSdkIsRight) {
  const std::string page = TOFGRAPH_SOURCE_DIR "/framework/include/tofgraph/README.md";
  // Each source begins with its name.
  std::istringstream lines(blocks(page, "cpp"));
  std::string name, source;
  for (std::string line; std::getline(lines, line); source += line + '\n') {
    if (!line.starts_with("// ") || !line.ends_with(".cpp")) continue;
    if (!name.empty()) write_text(folder_.path() / name, source);
    name = line.substr(3);
    source.clear();
  }
  ASSERT_EQ(name, "mean_log.cpp") << "the last of the page";
  write_text(folder_.path() / name, source);
  write_text(folder_.path() / "CMakeLists.txt", blocks(page, "cmake"));
  write_text(folder_.path() / "commands", blocks(page, "sh"));
  succeeds("mkdir my_plugins && sed -i \"s|\\bPREFIX\\b|$PREFIX|g\" commands && sh -e commands >log");
  for (const std::string path : {"", "--plugin-path my_plugins "}) {
    const Outcome described = run("$PREFIX/bin/tofgraph " + path + "describe depth_gain");
    EXPECT_THAT(described.out, HasSubstr("Multiplies the depth by a factor")) << described.err;
  }
  succeeds("$PREFIX/bin/tofgraph run --quiet 'ramp frames=3 ! mean_log path=means.csv' --camera camcube2");
  EXPECT_EQ(read_text(folder_.path() / "means.csv"), "frame,mean_m\n0,1\n1,1.01\n2,1.02\n");
}

TEST_F(Installed, CMakeAsksForTheKindThatItCannotTell) {
  succeeds(
      "cp $OUTSIDE/CMakeLists.txt $OUTSIDE/effect.cpp $OUTSIDE/embed.cpp . && "
      "sed 's/tofgraph::Filter/Base/' $OUTSIDE/filter.cpp >filter.cpp");
  // Error text whose lines may be wrapped by CMake.
  const Outcome untold = run("cmake -S . -B build -DCMAKE_PREFIX_PATH=$PREFIX 2>&1 | tr -s '[:space:]' ' '");
  EXPECT_THAT(untold.out, HasSubstr("filter.cpp does not tell what it is"));
  succeeds(
      "sed -i 's/filter.cpp/& KIND filter/' CMakeLists.txt && cmake -S . -B build -DCMAKE_PREFIX_PATH=$PREFIX >log");
}

class PkgConfig : public Installed, public testing::WithParamInterface<const char*> {};

TEST_P(PkgConfig, OneLineBuildsAPluginOrAProgram) {
  if (!is_there(GetParam())) GTEST_SKIP();
  const std::string compiler = GetParam() + std::string(" -std=c++20 -O2 -Wall -Wextra -Wconversion -Werror ");
  const std::string plugin =
      compiler + "-shared -fPIC $(pkg-config --cflags tofgraph) -DTOFGRAPH_PLUGIN_VERSION='\"1\"' ";
  succeeds("mkdir plugins");
  succeeds(plugin +
           "-DTOFGRAPH_PLUGIN_NAME='\"depth_gain\"' $OUTSIDE/filter.cpp -o plugins/tofgraph_filter_depth_gain.so");
  succeeds(plugin +
           "-DTOFGRAPH_PLUGIN_NAME='\"path_error\"' $OUTSIDE/effect.cpp -o plugins/tofgraph_effect_path_error.so");
  succeeds(compiler + "$OUTSIDE/embed.cpp $(pkg-config --cflags --libs tofgraph) -o embed");
  work();
}

INSTANTIATE_TEST_SUITE_P(Compilers, PkgConfig, testing::Values("g++", "clang++"),
                         [](const auto& info) { return info.param == std::string("g++") ? "gcc" : "clang"; });

}  // namespace
}  // namespace tofgraph::tests
