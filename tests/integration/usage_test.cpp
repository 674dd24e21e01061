// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Invalid command lines: missing, out of range or unknown arguments are reported in the program's own words.
#include "tests/program.hpp"

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

class Usage : public testing::Test {
 protected:
  std::string refused(const std::string& arguments) const {
    const Outcome outcome = shell("\"$TOFGRAPH\" " + arguments, folder.path());
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_EQ(outcome.out, "") << arguments;
    return outcome.err;
  }
  static std::string error(const std::string& text, const std::string& example) {
    return "error: " + text + "\n         example: tofgraph " + example + "\n";
  }
  TemporaryFolder folder;
};

TEST_F(Usage, WhatIsMissingIsNamedWithAnExample) {
  EXPECT_EQ(refused(""), error("the command is missing", "run pipelines/quickstart.yaml"));
  EXPECT_EQ(refused("run"), error("PIPELINE is missing", "run pipelines/quickstart.yaml --force"));
  EXPECT_EQ(refused("list --quiet --plugin-path"), error("--plugin-path needs a value", "list effects"));
  EXPECT_EQ(refused("gallery"), error("--out is missing", "gallery -o effects.html"));
  EXPECT_EQ(refused("simulate s.yaml"), error("-o OUT or --preview OUT.png is missing",
                                              "simulate pipelines/scenes/boxes.yaml -o boxes.h5 --preview boxes.png"));
}

TEST_F(Usage, ValuesAreCheckedInWords) {
  const std::string run = "run pipelines/quickstart.yaml --force";
  EXPECT_EQ(refused("run p.yaml --frames 0"), error("--frames: '0' is not a whole number from 1 to 1000000000", run));
  EXPECT_EQ(refused("run p.yaml --threads 1.5"), error("--threads: '1.5' is not a whole number from 1 to 1024", run));
  EXPECT_EQ(refused("run p.yaml --camera a --camera b"), error("--camera is given more than once", run));
  EXPECT_EQ(refused("list stges"), error("WHAT: 'stges' is unknown, did you mean 'stages'?", "list effects"));
  EXPECT_EQ(refused("gallery -o a.html --light blue"),
            error("--light: 'blue' is unknown, expected reference, physical", "gallery -o effects.html"));
  EXPECT_EQ(refused("diagnose --model a --data b -o c --seed x"),
            error("--seed: 'x' is not a whole number of at least 0",
                  "diagnose --model ideal.yaml --data campaign/campaign.yaml -o gap"));
}

TEST_F(Usage, HelpAndVersionAreNoErrors) {
  for (const char* arguments : {"--help", "--version", "run --help"}) {
    const Outcome outcome = shell("\"$TOFGRAPH\" " + std::string(arguments), folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << arguments;
    EXPECT_NE(outcome.out, "") << arguments;
    EXPECT_EQ(outcome.err, "") << arguments;
  }
}

/// A symbolic link to itself: inaccessible, even for root.
TEST_F(Usage, APluginFolderThatCannotBeEnteredIsTold) {
  fs::create_symlink("loop", folder.path() / "loop");
  EXPECT_EQ(refused("--plugin-path loop list"),
            "plugin path loop: error: this cannot be entered: Too many levels of symbolic links\n"
            "         a plugin path is the folder that holds tofgraph_KIND_NAME.so\n");
  const Outcome told = shell("export TOFGRAPH_PLUGIN_PATH=$PWD/loop; \"$TOFGRAPH\" list cameras", folder.path());
  EXPECT_EQ(told.exit_code, 0);
  EXPECT_EQ(told.err, "warning: TOFGRAPH_PLUGIN_PATH: " + (folder.path() / "loop").string() +
                          " cannot be entered: Too many levels of symbolic links\n");
}

TEST_F(Usage, ARecordingThatIsCheckedIsToldToBeOne) {
  const std::string file = TOFGRAPH_SOURCE_DIR "/pipelines/data/o3d303_scene.h5";
  EXPECT_EQ(refused("check " + file), file + ": error: this is a recording (HDF5), not text\n         tofgraph info " +
                                          file + " shows what it holds; capture_reader file=" + file + " reads it\n");
}

TEST_F(Usage, OneIsNotPlural) {
  const Outcome check = shell("\"$TOFGRAPH\" check ramp", folder.path());
  EXPECT_TRUE(check.err.ends_with("ramp: the pipeline is valid, 1 node\n")) << check.err;
  const Outcome run = shell("\"$TOFGRAPH\" run 'ramp frames=1 ! null'", folder.path());
  EXPECT_EQ(run.err.substr(0, 11), "1 frame in ") << run.err;
}

/// These commands have no `overwrite: true`.
TEST_F(Usage, AnOutputThatExistsIsReplacedByForce) {
  for (const std::string file : {"a.png", "a.html", "gap/report.html"}) write_text(folder.path() / file, "mine");
  write_text(folder.path() / "s.yaml",
             "scene: 1\ncamera: camcube2\nobjects: [{type: board, distance: 1 m}]\nintegration_time: 1 ms\n");
  for (const std::string arguments : {"simulate s.yaml --preview a.png", "simulate s.yaml -o a.html",
                                      "gallery -o a.html", "diagnose --model m.yaml --data d.yaml -o gap"}) {
    const std::string said = refused(arguments);
    EXPECT_NE(said.find(" already exists: --force allows it to be replaced\n"), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace tofgraph::tests
