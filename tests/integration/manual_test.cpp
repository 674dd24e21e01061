// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Files generated from the declarations: the pages of docs/reference, docs/schema, man pages, completion.
#include "tests/program.hpp"

#include <gmock/gmock.h>

namespace tofgraph::tests {
namespace {

using testing::HasSubstr;

/// Expects the files to equal the output of the current program.
void expect_fresh(const std::string& what, const std::string& place, const std::string& file = "") {
  const TemporaryFolder made;
  const Outcome outcome = shell("\"$TOFGRAPH\" manual " + what + " -o made", made.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Outcome difference =
      shell("diff -r made" + file + " '" TOFGRAPH_SOURCE_DIR "/" + place + file + "' | head -20", made.path());
  EXPECT_EQ(difference.out + difference.err, "") << "stale: build/bin/tofgraph manual " << what << " -o " << place;
}

TEST(Manual, ThePagesOfTheReferenceAreNotStale) { expect_fresh("reference", "docs/reference"); }
TEST(Manual, TheSchemasAreNotStale) {  // others are hand-written and checked by tests/schemas.py
  expect_fresh("schemas", "docs/schema", "/pipeline.json");
  expect_fresh("schemas", "docs/schema", "/model.json");
}
TEST(Manual, TheTypeStubsOfPythonAreNotStaleAndParse) {
  expect_fresh("stubs", "framework/python/tofgraph", "/_stages.pyi");
  const Outcome parsed =
      shell("python3 -c 'import ast; tree = ast.parse(open(\"_stages.pyi\").read()); print(len(tree.body))'",
            TOFGRAPH_SOURCE_DIR "/framework/python/tofgraph");
  EXPECT_EQ(parsed.exit_code, 0) << parsed.err;
}

TEST(Manual, ManPagesHaveNoWarnings) {
  const TemporaryFolder made;
  ASSERT_EQ(shell("\"$TOFGRAPH\" manual pages -o .", made.path()).exit_code, 0);
  EXPECT_THAT(read_text(made.path() / "man/man1/tofgraph-run.1"), HasSubstr("\\fB\\-\\-frames N\\fR"));
  if (shell("command -v man", "/tmp").exit_code != 0) GTEST_SKIP() << "man is not there";
  const Outcome shown =
      shell("for page in man/man1/*.1; do LC_ALL=C.UTF-8 man --warnings -l $page >/dev/null; done", made.path());
  EXPECT_EQ(shown.err, "");
}

TEST(Manual, BashCompletesCommandsAndOptions) {
  const TemporaryFolder made;
  ASSERT_EQ(shell("\"$TOFGRAPH\" manual pages -o .", made.path()).exit_code, 0);
  const auto completed = [&](const std::string& words, int last) {
    return shell("bash -c 'source bash-completion/completions/tofgraph; COMP_WORDS=(" + words +
                     "); COMP_CWORD=" + std::to_string(last) + "; _tofgraph; echo \"${COMPREPLY[*]}\"'",
                 made.path())
        .out;
  };
  EXPECT_EQ(completed("tofgraph plu", 1), "plugin\n");
  EXPECT_EQ(completed("tofgraph run --fra", 2), "--frames\n");
  EXPECT_EQ(completed("tofgraph --quiet plugin check --stri", 4), "--strictness\n");
  EXPECT_THAT(completed("tofgraph run bash", 2), HasSubstr("bash-completion"));
  EXPECT_EQ(completed("tofgraph man", 1), "\n");  // the command that generates these files is internal
}

}  // namespace
}  // namespace tofgraph::tests
