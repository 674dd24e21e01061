// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A campaign as the tasks of a job on the local machine.
// Slow: *
// Rooms: reduction diagnosis cli
// The tests share the campaign created by SetUpTestSuite.
#include "tests/divided_campaign.hpp"

using namespace tofgraph::tests;
using testing::HasSubstr;
namespace fs = std::filesystem;

namespace {

using Batch = DividedCampaign;

TEST_F(Batch, LocalTasksGiveTheSameReport) {
  done(batch("local", "local"));
  EXPECT_THAT(done("$TOFGRAPH batch --status local").out, HasSubstr("reduce     0 of 6 done"));
  EXPECT_THAT(done("$TOFGRAPH batch --submit -o local").out, HasSubstr("reduce     6 of 6 done"));
  EXPECT_EQ(result_of("local/result"), result_of("whole"));
  // A second submission does nothing.
  const auto time = fs::last_write_time(home() / "local/result/report.json");
  done("$TOFGRAPH batch --submit -o local");
  EXPECT_EQ(fs::last_write_time(home() / "local/result/report.json"), time);
}

TEST_F(Batch, EnvironmentOfTheUserStays) {
  done(batch("local", "environment"));
  write_text(home() / "environment/environment.sh", "echo from the environment\nTOFGRAPH=false\n");
  done(batch("local", "environment") + " --force");
  EXPECT_NE(run("$TOFGRAPH batch --submit -o environment").exit_code, 0);
  EXPECT_THAT(read_text(home() / "environment/log/reduce-1.log"), HasSubstr("ends with exit code 1"));
  EXPECT_THAT(done("$TOFGRAPH batch --status environment").out, HasSubstr("failed: "));
}

TEST_F(Batch, ParallelTasksGiveTheSameReport) {
  if (!is_installed("parallel")) GTEST_SKIP() << "GNU parallel is not installed";
  done(batch("parallel", "'in parallel'") + " --submit");
  EXPECT_EQ(result_of("in parallel/result"), result_of("whole"));
}

TEST_F(Batch, SnakemakeGivesTheSameReport) {
  if (!is_installed("snakemake")) GTEST_SKIP() << "Snakemake is not installed";
  done(batch("local", "snake", 2) + " && sed -i 's/^CASES=.*/CASES=0/' snake/plan.sh");
  done("snakemake --cores 2 --directory snake -s snake/Snakefile");
  done("$TOFGRAPH diagnose --model ideal.yaml --data snake/stats -o snake/other --quiet");
  EXPECT_EQ(result_of("snake/result"), result_of("snake/other"));
}

TEST_F(Batch, PlanHasThePluginPathAndTheMemoryOfThreads) {
  fs::create_directory(home() / "my plugins");
  done(batch("local", "one_thread"));
  done(batch("local", "planned", 2) + " --plugin-path 'my plugins' --threads 16");
  const Outcome path = run(". planned/plan.sh; env | grep TOFGRAPH_PLUGIN_PATH");
  EXPECT_THAT(path.out, HasSubstr("=" + (home() / "my plugins").string()));
  const auto memory = [](const std::string& job) {
    return std::stod(run(". " + job + "/plan.sh; echo $REDUCE_MEMORY").out);
  };
  EXPECT_GT(memory("planned"), memory("one_thread"));
}

TEST_F(Batch, SaysWhatIsWrong) {
  EXPECT_THAT(run("$TOFGRAPH batch --status c").err, HasSubstr("c is not a job"));
  EXPECT_EQ(run("$TOFGRAPH batch c/campaign.yaml --model none.yaml -o job").exit_code, 2);
  EXPECT_EQ(run("$TOFGRAPH batch c/campaign.yaml -o job").exit_code, 2);
  EXPECT_EQ(run("$TOFGRAPH batch c/campaign.yaml --model ideal.yaml -o c").exit_code, 2);
  EXPECT_THAT(run("$TOFGRAPH batch c/campaign.yaml --model ideal.yaml --shards 13 -o job").err,
              HasSubstr("13 tasks are more than the 12 conditions"));
  for (const std::string job : {"\"it's\"", "50%", "'{job}'", "'a\"b'", "'a\\b'"}) {
    const Outcome outcome = run(batch("slurm", job));
    EXPECT_EQ(outcome.exit_code, 2) << job;
    EXPECT_THAT(outcome.err, HasSubstr("--out: error:")) << job;
  }
}

TEST_F(Batch, KeepsAFolderToOneJob) {
  done(batch("local", "kept"));
  write_text(home() / "kept/task.sh", "# mine\n");
  EXPECT_THAT(run(batch("local", "kept")).err, HasSubstr("kept is a job already"));
  EXPECT_EQ(read_text(home() / "kept/task.sh"), "# mine\n");
  write_text(home() / "other.yaml", read_text(home() / "ideal.yaml") + "# another\n");
  std::string other_model = batch("local", "kept");
  other_model.replace(other_model.find("ideal"), 5, "other");
  for (const std::string& command : {other_model, batch("local", "kept", 5), batch("local", "kept", shards, 3)}) {
    const Outcome outcome = run(command + " --force");
    EXPECT_EQ(outcome.exit_code, 2) << command;
    EXPECT_THAT(outcome.err, HasSubstr("of another campaign, model, number of tasks or of cases")) << command;
    EXPECT_EQ(read_text(home() / "kept/task.sh"), "# mine\n");
  }
  done(batch("local", "kept") + " --force");
  EXPECT_THAT(read_text(home() / "kept/task.sh"), HasSubstr("reduce"));
}

TEST_F(Batch, KeepsAFolderToOneProfile) {
  fs::create_directory(home() / "own");
  fs::create_directory_symlink(home() / "c/captures", home() / "own/captures");
  done("sed 's/^camera: .*/camera: .\\/my.yaml/' c/campaign.yaml > own/campaign.yaml");
  const auto profile = [](const std::string& more) {
    write_text(home() / "own/my.yaml", read_text(TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml") + more);
  };
  std::string command = batch("local", "profiled") + " --force";
  command.replace(command.find("c/campaign"), 10, "own/campaign");
  profile("");
  done(command);
  profile("# changed\n");
  const Outcome changed = run(command);
  EXPECT_EQ(changed.exit_code, 2);
  EXPECT_THAT(changed.err, HasSubstr("or the camera's profile has changed, as its plan.sh states"));
  done("sed -i '/^PROFILE_SHA256=/d' profiled/plan.sh");  // a job of an earlier version
  done(command);
}

}  // namespace
