// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Files.SimulateSays*:Terminal.ABarEnds*:Terminal.ABarIs*:Terminal.ABarNever*:Terminal.WhatThe*
// Rooms: graph cli
// The command line itself: its help, its suggestions, its output on a terminal and its messages about files.
#include "cli/progress.hpp"
#include "graph/plugin.hpp"
#include "tests/program.hpp"

#include <pty.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <sstream>
#include <thread>

namespace tofgraph::tests {
namespace {

const char* const commands[] = {"run",      "check",   "explain", "list",    "describe",
                                "simulate", "gallery", "info",    "diagnose"};

/// Output of a child process on its own terminal.
std::string printed(const std::function<void()>& child, unsigned short columns = 120) {
  int terminal = -1;
  const winsize size{24, columns, 0, 0};
  const pid_t process = forkpty(&terminal, nullptr, nullptr, &size);
  if (process == 0) {
    child();
    _exit(0);
  }
  std::string text;
  char block[4096];
  for (ssize_t n = 0; (n = read(terminal, block, sizeof block)) > 0;) text.append(block, static_cast<std::size_t>(n));
  close(terminal);
  waitpid(process, nullptr, 0);
  return text;
}

/// Same for a command line.
std::string on_a_terminal(const std::string& command, const std::filesystem::path& folder,
                          unsigned short columns = 120) {
  const std::string line = "cd '" + folder.string() +
                           "' && export TERM=xterm TOFGRAPH='" TOFGRAPH_PROGRAM
                           "' TOFGRAPH_PLUGIN_PATH='" TOFGRAPH_BINARY_DIR "/tests/plugins'; unset NO_COLOR; " +
                           command;
  return printed([&line] { execl("/bin/sh", "sh", "-c", line.c_str(), nullptr); }, columns);
}

bool has(const std::string& text, const std::string& words) { return text.find(words) != std::string::npos; }

TEST(Commands, AnUnknownOneIsNamedWithTheNearest) {
  const TemporaryFolder folder;
  const auto said = [&](const std::string& arguments) {
    const Outcome outcome = shell("\"$TOFGRAPH\" " + arguments, folder.path());
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_EQ(outcome.out, "");
    return outcome.err;
  };
  EXPECT_EQ(said("simulat"), "error: there is no command 'simulat', did you mean 'simulate'?\n");
  EXPECT_EQ(said("simulat s.yaml -o x.h5"), "error: there is no command 'simulat', did you mean 'simulate'?\n");
  EXPECT_TRUE(has(said("zebra"), "there is no command 'zebra'\n         commands: run, check, explain"));
  EXPECT_EQ(said("run a.yaml --frmaes=3"), "error: there is no option '--frmaes', did you mean '--frames'?\n");
  EXPECT_EQ(said("list --quite"), "error: there is no option '--quite', did you mean '--quiet'?\n");
  EXPECT_EQ(said("--plugin-pth here run a.yaml"),
            "error: there is no option '--plugin-pth', did you mean '--plugin-path'?\n");
  EXPECT_TRUE(has(said("info a.h5 b.h5"), "'b.h5' is one argument too many"));
}

TEST(Commands, AnOptionBeforeItsCommandIsToldWhereItBelongs) {
  const TemporaryFolder folder;
  const Outcome outcome = shell("$TOFGRAPH --camera camcube2 run p.yaml", folder.path());
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err, "error: '--camera' is an option of 'run': write it after that word\n");
}

/// The exit code is right even if no message can be written.
TEST(Commands, AStandardErrorThatIsFullEndsNothing) {
  const TemporaryFolder folder;
  EXPECT_EQ(shell("$TOFGRAPH check nothing.yaml 2>/dev/full", folder.path()).exit_code, 2);
}

TEST(Commands, HelpIsInWordsAndListsTheOptionsOfAllCommands) {
  const TemporaryFolder folder;
  for (const std::string command : commands) {
    const Outcome help = shell("\"$TOFGRAPH\" " + command + " --help", folder.path());
    EXPECT_EQ(help.exit_code, 0);
    for (const char* option : {"--quiet", "--verbose", "--plugin-path FOLDER"})
      EXPECT_TRUE(has(help.out, option)) << command << " " << option << "\n" << help.out;
    for (const char* type : {"TEXT", "UINT", "INT", "FLOAT", "REQUIRED", "[1 - ", "{"})
      EXPECT_FALSE(has(help.out, type)) << command << " " << type << "\n" << help.out;
  }
  EXPECT_TRUE(has(shell("\"$TOFGRAPH\" run --help", folder.path()).out, "--frames N "));
  EXPECT_TRUE(has(shell("\"$TOFGRAPH\" diagnose --help", folder.path()).out, "--model FILE (required)"));
}

TEST(Commands, AFolderOfTheEnvironmentThatIsNotThereIsARemark) {
  const TemporaryFolder folder;
  const std::string away = "export TOFGRAPH_PLUGIN_PATH=/away; \"$TOFGRAPH\" list cameras";
  const Outcome told = shell(away, folder.path());
  EXPECT_EQ(told.exit_code, 0);
  EXPECT_EQ(told.err, "warning: TOFGRAPH_PLUGIN_PATH: /away is not a folder\n");
  EXPECT_EQ(shell(away + " --quiet", folder.path()).err, "");
}

TEST(Commands, CamerasAreComparedAsInTables11And12OfTheReference) {
  const TemporaryFolder folder;
  const Outcome table = shell("\"$TOFGRAPH\" list cameras --compare", folder.path());
  ASSERT_EQ(table.exit_code, 0) << table.err;
  const std::map<std::string, std::vector<std::string>> published = {
      {"camcube2", {"204 x 204", "PhotonICs PMD 41k-S2", "0.3 to 7 m", "40 x 40 deg", "80", "USB"}},
      {"sr4000", {"176 x 144", "0.8 to 8 m", "43 x 34 deg", "50", "USB/Ethernet"}},
      {"o3", {"64 x 48", "PhotonICs PMD", "0.3 to 7 m", "40 x 30 deg", "25", "Ethernet"}},
      {"s3", {"64 x 48", "PhotonICs PMD 3k-S2", "0.3 to 7 m", "40 x 30 deg", "20", "Ethernet"}}};
  for (const auto& [camera, words] : published) {
    std::istringstream lines(table.out);
    std::string line;
    while (std::getline(lines, line) && !line.starts_with(camera + " ")) {
    }
    for (const std::string& word : words) EXPECT_TRUE(has(line, word)) << camera << ": " << line;
    // Each camera can be simulated: the optimized model measures the true distance of the board.
    const Outcome run = shell(
        "\"$TOFGRAPH\" run \"simulator noise=none distance='1 m' ! four_phase_decoder ! "
        "optimized_bistatic ! statistics\" --camera " +
            camera,
        folder.path());
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_TRUE(has(run.out, "1000.00")) << run.out;
  }
  EXPECT_EQ(shell("\"$TOFGRAPH\" list effects --compare", folder.path()).exit_code, 2);
}

TEST(Commands, DescribeSaysOfEachValueWhetherItWasMeasured) {
  const TemporaryFolder folder;
  const auto line_of = [](const std::string& text, const std::string& key) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
      if (has(line, "  " + key + " ")) return line;
    return std::string();
  };
  const std::string own = shell("\"$TOFGRAPH\" describe camcube2_calibrated", folder.path()).out;
  for (const char* key : {"focal_length", "principal_point", "distortion"})
    EXPECT_TRUE(has(line_of(own, key), " measured ")) << key << "\n" << own;
  EXPECT_TRUE(has(line_of(own, "pixel_pitch"), " nominal ")) << own;
  EXPECT_THAT(own, testing::HasSubstr("[101.3, 101.7] px, the first pixel's centre is 0"));
  const std::string camcube = shell("\"$TOFGRAPH\" describe camcube2", folder.path()).out;
  for (const char* key : {"width", "focal_length", "modulation_frequency", "sources", "gain"})
    EXPECT_TRUE(has(line_of(camcube, key), std::string_view(key) == "gain" ? " assumed " : " nominal ")) << key << "\n"
                                                                                                         << camcube;
}

TEST(Files, RunSaysHowManyThereAreAndTheFirstAndTheLast) {
  const TemporaryFolder folder;
  const std::string line = "\"$TOFGRAPH\" run 'ramp frames=3 ! notes path=out/b_{frame}.csv total=sum.txt' ";
  const Outcome run = shell(line, folder.path());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(has(run.err, "wrote 5 files: out/b_0.csv ... sum.txt\n")) << run.err;
  EXPECT_EQ(shell(line + "--force --quiet", folder.path()).err, "");
}

TEST(Files, OfAFormerRunDoNotCount) {
  const TemporaryFolder folder;
  const std::string line = " 'ramp frames=9 ! notes path=b_{frame}.csv' --force";
  ASSERT_EQ(shell("\"$TOFGRAPH\" run" + line, folder.path()).exit_code, 0);
  const Outcome again = shell("\"$TOFGRAPH\" run --frames 2" + line, folder.path());
  EXPECT_TRUE(has(again.err, "wrote 3 files: b_0.csv ... b.notes.txt\n")) << again.err;
  const Outcome failing =
      shell("\"$TOFGRAPH\" run 'ramp frames=9 ! notes path=c_{frame}.csv fail_at=1' --force", folder.path());
  EXPECT_EQ(failing.exit_code, 1);
  EXPECT_TRUE(has(failing.err, "wrote 2 files: c_0.csv ... c.notes.txt\n")) << failing.err;
}

/// Also with --force: pipelines, scenes and models are never overwritten.
TEST(Files, InputsAreNeverReplaced) {
  const TemporaryFolder folder;
  const std::string pipeline =
      "pipeline: 1\ncamera: camcube2\nnodes:\n  - {stage: simulator, distance: 1 m, frames: 1}\n  - {stage: null}\n";
  const std::string scene = "scene: 1\ncamera: camcube2\nobjects:\n  - {name: board, type: board, distance: 1 m}\n";
  write_text(folder.path() / "p.yaml", pipeline);
  write_text(folder.path() / "s.yaml", scene);
  write_text(folder.path() / "model.yaml", "model: 1\ncamera: camcube2\neffects: []\n");
  for (const char* name : {"kept.h5", "kept.yaml"}) write_text(folder.path() / name, "kept");
  for (const std::string words :
       {"run p.yaml --stats p.yaml", "run 'simulator scene=s.yaml ! null' --stats s.yaml", "simulate s.yaml -o s.yaml",
        "simulate s.yaml -o a.h5 --preview s.yaml", "diagnose --model model.yaml --data p.yaml -o .",
        "inspect kept.h5 -o kept.h5", "convert kept.yaml -o kept.yaml", "gallery --camera ./kept.yaml -o kept.yaml",
        "pose kept.h5 --pattern '{type: circles}' --camera ./kept.yaml -o kept.yaml"}) {
    const Outcome outcome = shell("$TOFGRAPH " + words + " --force", folder.path());
    EXPECT_EQ(outcome.exit_code, 2) << words;
    EXPECT_NE(outcome.err.find("is an input, so it cannot also be written"), std::string::npos) << words << outcome.err;
  }
  EXPECT_EQ(read_text(folder.path() / "p.yaml"), pipeline);
  EXPECT_EQ(read_text(folder.path() / "s.yaml"), scene);
  for (const char* name : {"kept.h5", "kept.yaml"}) EXPECT_EQ(read_text(folder.path() / name), "kept");
}

TEST(Files, StatisticsReplaceNoOutputOfTheirRun) {
  const TemporaryFolder folder;
  const Outcome outcome = shell(
      "\"$TOFGRAPH\" run 'ramp frames=3 ! notes path=out/b_{frame}.csv' --stats out/b_1.csv --force", folder.path());
  EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
  EXPECT_TRUE(has(outcome.err, "--stats out/b_1.csv: error: node 'notes' writes this file")) << outcome.err;
}

TEST(Files, OfAFormerRunAreToldBehindALink) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "real");
  std::filesystem::create_directory_symlink("real", folder.path() / "link");
  const std::string line =
      "\"$TOFGRAPH\" run \"simulator distance='1 m' frames=FRAMES ! four_phase_decoder ! image_writer channel=distance "
      "path='link/a_{frame}.png'\" --camera camcube2 --force";
  const auto run = [&](const std::string& frames) {
    std::string words = line;
    words.replace(words.find("FRAMES"), 6, frames);
    return shell(words, folder.path());
  };
  ASSERT_EQ(run("3").exit_code, 0) << run("3").err;
  const Outcome shorter = run("2");
  EXPECT_NE(shorter.err.find("older files of this series remain: a_2.png"), std::string::npos) << shorter.err;
}

TEST(Files, SimulateSaysWhatItWrote) {
  const TemporaryFolder folder;
  write_text(folder.path() / "s.yaml",
             "scene: 1\ncamera: camcube2\nframes: 1\nobjects:\n  - {type: board, distance: 1 m}\n");
  EXPECT_EQ(shell("\"$TOFGRAPH\" simulate s.yaml -o a.h5 --preview a.png", folder.path()).err,
            "wrote a.png: a picture of the first frame\nwrote a.h5: 1 condition, 1 frame\n");
}

TEST(Terminal, HasErrorsInRedAndWarningsInYellow) {
  const TemporaryFolder folder;
  const std::string error = "\"$TOFGRAPH\" simulat", red = "\033[1;31merror\033[0m: there is no command";
  EXPECT_TRUE(has(on_a_terminal(error, folder.path()), red));
  for (const char* plain : {"NO_COLOR=1 ", "TERM=dumb "}) {
    const std::string said = on_a_terminal(plain + error, folder.path());
    EXPECT_TRUE(said.starts_with("error: there is no command")) << said;
  }
  EXPECT_FALSE(has(on_a_terminal(error + " 2>&1 | cat", folder.path()), "\033"));
  EXPECT_TRUE(has(on_a_terminal("TOFGRAPH_PLUGIN_PATH=/away \"$TOFGRAPH\" list cameras", folder.path()),
                  "\033[1;33mwarning\033[0m: TOFGRAPH_PLUGIN_PATH"));
  write_text(folder.path() / "a.yaml", "pipeline: 1\nnodes:\n  - {name: grab, stage: rump}  # error: none\n");
  const std::string check = on_a_terminal("\"$TOFGRAPH\" check a.yaml", folder.path());
  EXPECT_TRUE(has(check, "a.yaml:3:25: \033[1;31merror\033[0m: there is no stage")) << check;
  EXPECT_TRUE(has(check, "# error: none")) << "what the user wrote stays as it is\n" << check;
}

TEST(Terminal, ABarEndsOnALineOfItsOwnWithItsTimes) {
  const TemporaryFolder folder;
  const std::string said = on_a_terminal("\"$TOFGRAPH\" run 'ramp frames=14 pause=0.2s ! null'", folder.path());
  EXPECT_TRUE(has(said, " left")) << said;
  const auto last = said.rfind("\r\033[K[");
  ASSERT_NE(last, std::string::npos) << said;
  const std::string line = said.substr(last, said.find('\n', last) - last);
  EXPECT_TRUE(has(line, "] 100 % 14 of 14 frames")) << line;
  EXPECT_TRUE(has(said.substr(last + line.size()), "\n14 frames in ")) << said;
  EXPECT_FALSE(has(shell("\"$TOFGRAPH\" run 'ramp frames=14 pause=0.2s ! null'", folder.path()).err, "["));
}

TEST(Terminal, ABarIsNoWiderThanTheTerminal) {
  const TemporaryFolder folder;
  const std::string said = on_a_terminal("\"$TOFGRAPH\" run 'ramp frames=11 pause=0.2s ! null'", folder.path(), 40);
  std::size_t bars = 0;
  for (std::size_t at = 0; (at = said.find("\r\033[K[", at)) != std::string::npos; ++bars) {
    at += 4;
    EXPECT_LT(said.find_first_of("\r\n", at) - at, 40U) << said;
  }
  EXPECT_GT(bars, 0U);
}

TEST(Terminal, ABarNeverGoesBack) {
  const std::string said = printed([] {
    const auto wait = [](int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); };
    cli::Progress progress(false);
    wait(2050);
    progress.show(0.5, "first");
    wait(250);
    progress.show(0.2, "second");
    config::print_message("a message");
  });
  EXPECT_TRUE(has(said, " 50 % first")) << said;
  EXPECT_TRUE(has(said, " 50 % second")) << said;
  EXPECT_TRUE(has(said, "\r\033[Ka message\r\n")) << "not behind the bar: " << said;
  EXPECT_TRUE(said.ends_with(" left\r\n")) << said;
}

/// Modules, the graph and the program share one terminal: a message of any of them replaces the progress bar's line.
TEST(Terminal, WhatTheGraphSaysTakesTheBarsLine) {
  const TemporaryFolder cache;
  const std::string said = printed([&] {
    setenv("XDG_CACHE_HOME", cache.path().c_str(), 1);
    cli::Progress progress(false);
    std::this_thread::sleep_for(std::chrono::milliseconds(2050));
    progress.show(0.5, "half");
    const graph::PluginRegistry slow({TOFGRAPH_BINARY_DIR "/tests/noisy"});
    static_cast<void>(slow.describe({*slow.find("loads_slowly")}));
  });
  EXPECT_TRUE(has(said, "\r\033[Kplugin " TOFGRAPH_BINARY_DIR "/tests/noisy/")) << said;
  EXPECT_TRUE(has(said, "still being loaded after 2 s\r\n")) << said;
}

TEST(Terminal, ABarTellsElapsedAndRemainingTime) {
  EXPECT_EQ(cli::progress_bar(0.5, "two", 12), "[==========          ]  50 % two, 12 s, 12 s left");
  EXPECT_EQ(cli::progress_bar(1, "all", 65), "[====================] 100 % all, 1 min 05 s");
  EXPECT_EQ(cli::progress_bar(0.25, "x", 3600), "[=====               ]  25 % x, 1 h 00 min, 3 h 00 min left");
  EXPECT_EQ(cli::progress_bar(std::nullopt, "7 frames", 3), "7 frames, 3 s");
  EXPECT_EQ(cli::progress_bar(1.5, "", 1).find("150"), std::string::npos);
}

}  // namespace
}  // namespace tofgraph::tests
