// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A fixture with an installed prefix, which is the only information about tofgraph's location.
#pragma once

#include "tests/program.hpp"

namespace tofgraph::tests {

/// A prefix installed once for all tests; the original installation path is empty.
struct Prefix {
  TemporaryFolder folder;
  Outcome installed = shell("cmake --install '" TOFGRAPH_BINARY_DIR "' --prefix first && mv first kept", folder.path());
};

/// A moved prefix, $PREFIX, for the test alone; $OUTSIDE: sources of a third-party project. Nothing else indicates
/// tofgraph's location.
class InstalledPrefix : public testing::Test {
 protected:
  static void SetUpTestSuite() { ASSERT_EQ(prefix().installed.exit_code, 0) << prefix().installed.err; }
  static const Prefix& prefix() {
    static const Prefix made;
    return made;
  }
  void SetUp() override {  // links take no time; files added by a test remain its own
    const Outcome moved = run("cp -a --link '" + (prefix().folder.path() / "kept").string() + "' moved");
    ASSERT_EQ(moved.exit_code, 0) << moved.err;
  }
  Outcome run(const std::string& command) const {
    return shell(
        "unset TOFGRAPH TOFGRAPH_PLUGIN_PATH LD_LIBRARY_PATH; "
        "export PREFIX=\"$PWD/moved\" OUTSIDE='" TOFGRAPH_SOURCE_DIR
        "/tests/fixtures/outside' PKG_CONFIG_PATH=\"$PWD/moved/lib/pkgconfig\"; " +
            command,
        folder_.path());
  }
  bool is_there(const std::string& compiler) const {
    const bool found = run("command -v " + compiler).exit_code == 0;
    if (!found) std::fprintf(stderr, "%s is not there: left out\n", compiler.c_str());
    return found;
  }
  void succeeds(const std::string& command) const {
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 0) << command << '\n' << outcome.out << outcome.err;
    EXPECT_EQ(outcome.err, "") << command;  // no warning
  }
  TemporaryFolder folder_;
};

}  // namespace tofgraph::tests
