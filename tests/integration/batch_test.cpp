// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A campaign as jobs: on this machine, with GNU parallel, on a real Slurm of one node that the test starts, with MPI.
// Slow: Batch.*
// Rooms: diagnosis cli
// Alone: daemons of Slurm have fixed ports, and tasks are killed by the clock
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/sha256.hpp"
#include "tests/guide.hpp"
#include "tests/unit/full_disk.hpp"

#include <unistd.h>
#include <algorithm>
#include <random>

using namespace tofgraph::tests;
using testing::HasSubstr;
namespace fs = std::filesystem;

namespace {

bool is_installed(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null").c_str()) == 0;
}

/// munged, slurmctld and slurmd in a folder of their own, ended by their process ids.
class OneNodeSlurm {
 public:
  OneNodeSlurm() {
    for (const char* name : {"state", "spool", "log", "run"}) fs::create_directories(path() / name);
    char host[256] = "";
    gethostname(host, sizeof host);
    const std::string node = std::string(host).substr(0, std::string(host).find('.')), here = path().string();
    write_text(path() / "slurm.conf",
               "ClusterName=test\nSlurmctldHost=" + node + "(127.0.0.1)\nSlurmUser=root\nSlurmdUser=root\n" +
                   "AuthType=auth/munge\nAuthInfo=socket=" + here + "/run/munge.sock\nCryptoType=crypto/munge\n" +
                   "SlurmctldPort=26817\nSlurmdPort=26818\nStateSaveLocation=" + here + "/state\nSlurmdSpoolDir=" +
                   here + "/spool\nSlurmctldPidFile=" + here + "/run/slurmctld.pid\nSlurmdPidFile=" + here +
                   "/run/slurmd.pid\nSlurmctldLogFile=" + here + "/log/slurmctld.log\nSlurmdLogFile=" + here +
                   "/log/slurmd.log\nProctrackType=proctrack/pgid\nTaskPlugin=task/none\nMpiDefault=none\n" +
                   "SelectType=select/cons_tres\nSelectTypeParameters=CR_CPU_Memory\n" +
                   "JobAcctGatherType=jobacct_gather/none\nAccountingStorageType=accounting_storage/none\n" +
                   "SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0\nReturnToService=2\n" +
                   "SlurmdTimeout=300\nKillWait=1\nMinJobAge=300\nNodeName=" + node +
                   " NodeAddr=127.0.0.1 CPUs=2 RealMemory=4000 State=UNKNOWN\nPartitionName=all Nodes=" + node +
                   " Default=YES MaxTime=INFINITE State=UP\n");
    run("head -c 1024 /dev/urandom > munge.key && chmod 400 munge.key && munged --force --key-file=$PWD/munge.key "
        "--socket=$PWD/run/munge.sock --pid-file=$PWD/run/munged.pid --log-file=$PWD/log/munged.log "
        "--seed-file=$PWD/run/munge.seed --num-threads=2");
    run("slurmctld");
    start_node();
    for (int i = 0; i < 100 && !is_up_; ++i) {
      is_up_ = run("sinfo -h -o %t | grep -q idle").exit_code == 0;
      if (!is_up_) usleep(200000);
    }
  }
  ~OneNodeSlurm() {
    run("scancel -u root; sleep 1; for d in slurmd slurmctld munged; do [ -e run/$d.pid ] && kill $(cat run/$d.pid); "
        "done; "
        "sleep 1");
  }
  OneNodeSlurm(const OneNodeSlurm&) = delete;
  OneNodeSlurm& operator=(const OneNodeSlurm&) = delete;

  const fs::path& path() const { return folder_.path(); }
  bool is_up() const { return is_up_; }
  std::string logs() const { return read_text(path() / "log/slurmctld.log") + read_text(path() / "log/slurmd.log"); }
  Outcome run(const std::string& command, const fs::path& folder = {}) const {
    return shell("export SLURM_CONF=" + (path() / "slurm.conf").string() + "; " + command,
                 folder.empty() ? path() : folder);
  }
  void start_node() const { run("slurmd"); }
  void kill_node() const { run("kill -9 $(cat run/slurmd.pid)"); }
  /// Waits until no job is left. @returns false after two minutes
  bool wait() const {
    for (int i = 0; i < 600; ++i) {
      if (run("squeue -h | grep -q .").exit_code != 0) return true;
      usleep(200000);
    }
    return false;
  }

 private:
  TemporaryFolder folder_;
  bool is_up_ = false;
};

class Batch : public testing::Test {
 protected:
  static constexpr int shards = 6;

  static void SetUpTestSuite() {
    home_ = std::make_unique<TemporaryFolder>();
    write_text(home() / "scene.yaml",
               "scene: 1\nname: small campaign\ncamera: camcube2\nframes: 40\noutput: phases\nseed: 3\n"
               "model: {light: reference, effects: [{effect: wiggling, amplitude: 6 mm, phase: 0.4 rad}]}\n"
               "objects:\n  - {name: board, type: board, distance: 500 mm, reflectivity: 0.8}\n"
               "sequence:\n"
               "  - {key: board.distance, values: [600 mm, 800 mm, 1000 mm, 1200 mm, 1400 mm, 1600 mm]}\n"
               "  - {key: integration_time, values: [0.5 ms, 1 ms]}\n");
    write_text(home() / "ideal.yaml", "model: 1\ncamera: camcube2\nlight: reference\neffects: []\n");
    done("$TOFGRAPH simulate scene.yaml -o c --quiet");
    done("$TOFGRAPH diagnose --model ideal.yaml --data c/campaign.yaml -o whole --confidence 2 --quiet");
  }
  static void TearDownTestSuite() { home_.reset(); }

  static fs::path home() { return home_->path(); }
  static Outcome run(const std::string& command) { return shell(command, home()); }
  static Outcome done(const std::string& command) {
    Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 0) << command << "\n" << outcome.out << outcome.err;
    return outcome;
  }
  /// SHA-256 of the report without the names of the input files and the campaign's own, and of the model.
  static std::string result_of(const std::string& folder) {
    nlohmann::json report = nlohmann::json::parse(read_text(home() / folder / "report.json"), nullptr, false);
    if (!report.is_object()) return folder + " has no report";
    report["inputs"].erase(1);
    for (auto& input : report["inputs"]) input.erase("file");
    return tofgraph::io::sha256_of(report.dump(1) + read_text(home() / folder / "model.yaml"));
  }
  static std::string batch(const std::string& engine, const std::string& job, int tasks = shards) {
    return "$TOFGRAPH batch c/campaign.yaml --model ideal.yaml --engine " + engine + " --shards " +
           std::to_string(tasks) + " --confidence 2 -o " + job;
  }
  static std::size_t statistics_in(const fs::path& folder) {
    std::size_t count = 0;
    for (const std::string& name : listing(folder)) count += name.ends_with(".stats") ? 1U : 0U;
    return count;
  }

 private:
  static inline std::unique_ptr<TemporaryFolder> home_;
};

TEST_F(Batch, LocalTasksGiveTheSameReport) {
  done(batch("local", "local"));
  EXPECT_THAT(done("$TOFGRAPH batch --status local").out, HasSubstr("reduce     0 of 6 done"));
  EXPECT_THAT(done("$TOFGRAPH batch --submit -o local").out, HasSubstr("reduce     6 of 6 done"));
  EXPECT_EQ(result_of("local/result"), result_of("whole"));
  // Submitting again does nothing.
  const auto time = fs::last_write_time(home() / "local/result/report.json");
  done("$TOFGRAPH batch --submit -o local");
  EXPECT_EQ(fs::last_write_time(home() / "local/result/report.json"), time);
}

TEST_F(Batch, EnvironmentOfTheUserStays) {
  done(batch("local", "environment"));
  write_text(home() / "environment/environment.sh", "echo from the environment\nTOFGRAPH=false\n");
  done(batch("local", "environment"));
  EXPECT_NE(run("$TOFGRAPH batch --submit -o environment").exit_code, 0);
  EXPECT_THAT(read_text(home() / "environment/log/reduce-1.log"), HasSubstr("ends with exit code 1"));
  EXPECT_THAT(done("$TOFGRAPH batch --status environment").out, HasSubstr("failed: "));
}

TEST_F(Batch, ParallelTasksGiveTheSameReport) {
  if (!is_installed("parallel")) GTEST_SKIP() << "GNU parallel is not installed";
  done(batch("parallel", "parallel") + " --submit");
  EXPECT_EQ(result_of("parallel/result"), result_of("whole"));
}

TEST_F(Batch, SlurmGivesTheSameReport) {
  if (geteuid() != 0 || !is_installed("slurmctld") || !is_installed("slurmd") || !is_installed("munged"))
    GTEST_SKIP() << "Slurm's daemons (slurm-wlm, munge) are not installed, or this user may not start them";
  const OneNodeSlurm slurm;
  if (!slurm.is_up()) GTEST_SKIP() << "Slurm does not start here: " << slurm.logs();
  const Outcome submitted = slurm.run(batch("slurm", "slurm") + " --submit", home());
  EXPECT_EQ(submitted.exit_code, 0) << submitted.err;
  EXPECT_THAT(submitted.out, HasSubstr("diagnose: job"));
  ASSERT_TRUE(slurm.wait());
  EXPECT_EQ(result_of("slurm/result"), result_of("whole")) << done("$TOFGRAPH batch --status slurm").out;
}

TEST_F(Batch, SlurmAfterKills) {
  if (geteuid() != 0 || !is_installed("slurmctld") || !is_installed("slurmd") || !is_installed("munged"))
    GTEST_SKIP() << "Slurm's daemons (slurm-wlm, munge) are not installed, or this user may not start them";
  const OneNodeSlurm slurm;
  if (!slurm.is_up()) GTEST_SKIP() << "Slurm does not start here: " << slurm.logs();
  std::mt19937 generator(5);
  std::uniform_int_distribution<int> pause(0, 250);  // ms
  EXPECT_EQ(slurm.run(batch("slurm", "killed", 3), home()).exit_code, 0);
  std::map<std::string, fs::file_time_type> whole;
  std::size_t killed_tasks = 0, killed_nodes = 0;
  const auto check = [&] {
    if (!fs::exists(home() / "killed/stats")) return;
    for (const std::string& name : listing(home() / "killed/stats")) {
      if (!name.ends_with(".stats")) continue;
      const auto time = fs::last_write_time(home() / "killed/stats" / name);
      EXPECT_EQ(whole.try_emplace(name, time).first->second, time) << name << " was made again";
    }
    for (const auto& [name, time] : whole)
      EXPECT_TRUE(fs::exists(home() / "killed/stats" / name)) << name << " is lost";
  };
  for (int round = 0; round < 12 && !fs::exists(home() / "killed/result/report.html"); ++round) {
    EXPECT_EQ(slurm.run("$TOFGRAPH batch --submit -o killed", home()).exit_code, 0);
    for (int k = 0; k < 2; ++k) {
      // A task of this job alone: its command line names the job's folder.
      const Outcome kill =
          slurm.run("for i in $(seq 60); do p=$(pgrep -f '" + (home() / "killed").string() +
                        "/[s]tats --' | head -n 1); [ -n \"$p\" ] && break; sleep 0.05; done; sleep 0." +
                        std::to_string(1000 + pause(generator)).substr(1) + "; [ -n \"$p\" ] && kill -9 $p",
                    home());
      killed_tasks += kill.exit_code == 0 ? 1U : 0U;
      check();
    }
    if (round % 4 == 3) {
      slurm.kill_node();
      ++killed_nodes;
      slurm.start_node();
    }
    slurm.wait();
    check();
  }
  for (int i = 0; i < 5 && !fs::exists(home() / "killed/result/report.html"); ++i) {
    EXPECT_EQ(slurm.run("$TOFGRAPH batch --submit -o killed", home()).exit_code, 0);
    EXPECT_TRUE(slurm.wait());
  }
  check();
  EXPECT_EQ(result_of("killed/result"), result_of("whole")) << done("$TOFGRAPH batch --status killed").out;
  EXPECT_EQ(statistics_in(home() / "killed/stats"), 12U);
  EXPECT_GE(killed_tasks, 5U);
  RecordProperty("killed_tasks", static_cast<int>(killed_tasks));
  RecordProperty("killed_nodes", static_cast<int>(killed_nodes));
  std::cout << killed_tasks << " tasks and " << killed_nodes << " daemons of the node killed\n";
}

TEST_F(Batch, RanksGiveTheSameReport) {
  const fs::path program = fs::path(TOFGRAPH_PROGRAM).parent_path() / "tofgraph-mpi";
  if (!is_installed("mpirun") || !fs::exists(program))
    GTEST_SKIP() << "tofgraph-mpi was not built, or there is no mpirun";
  const std::string mpirun =
      "export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1; mpirun --oversubscribe -n ";
  for (const std::string ranks : {"1", "2", "16"}) {
    const std::string start = mpirun + ranks + " " + program.string(), folder = "ranks" + ranks;
    EXPECT_THAT(done(start + " reduce c/campaign.yaml -o " + folder + "_s").err,
                HasSubstr("12 reduced, 0 there before"));
    done(start + " diagnose --model ideal.yaml --data " + folder + "_s -o " + folder + " --confidence 2 --quiet");
    EXPECT_EQ(result_of(folder), result_of("whole"));
  }
  const Outcome wrong = run(mpirun + "2 " + program.string() + " reduce none.yaml -o none");
  EXPECT_EQ(wrong.exit_code, 2);
  // Ranks that are killed leave whole files, and the next run goes on with them.
  for (int k = 0; k < 5; ++k)
    run("timeout -s KILL 0.8 " + program.string() + " reduce c/campaign.yaml -o ranks_killed");
  done(mpirun + "2 " + program.string() + " reduce c/campaign.yaml -o ranks_killed --quiet");
  EXPECT_EQ(read_text(home() / "ranks_killed/campaign.yaml"), read_text(home() / "ranks2_s/campaign.yaml"));
}

TEST_F(Batch, EveryCommandOfThePage) {
  write_text(home() / "guide/scene.yaml", read_text(home() / "scene.yaml"));
  write_text(home() / "guide/ideal.yaml", read_text(home() / "ideal.yaml"));
  const std::vector<std::string> blocks = commands_of(TOFGRAPH_SOURCE_DIR "/docs/large_campaigns.md");
  ASSERT_EQ(blocks.size(), 3U);
  for (const std::string& block : blocks) {
    const Outcome outcome = shell("set -e; export PATH=\"$(dirname \"$TOFGRAPH\"):$PATH\"; " + block, home() / "guide");
    EXPECT_EQ(outcome.exit_code, 0) << block << outcome.err;
  }
  for (const std::string folder : {"guide/gap", "guide/job/result"})
    EXPECT_TRUE(fs::exists(home() / folder / "report.html")) << folder;
  EXPECT_EQ(result_of("guide/injected"), result_of("whole"));
}

TEST_F(Batch, SaysWhatIsWrong) {
  EXPECT_THAT(run("$TOFGRAPH batch --status c").err, HasSubstr("c is not a job"));
  EXPECT_EQ(run("$TOFGRAPH batch c/campaign.yaml --model none.yaml -o job").exit_code, 2);
  EXPECT_EQ(run("$TOFGRAPH batch c/campaign.yaml -o job").exit_code, 2);
  EXPECT_EQ(run("$TOFGRAPH batch c/campaign.yaml --model ideal.yaml -o c").exit_code, 2);
  EXPECT_THAT(run("$TOFGRAPH batch c/campaign.yaml --model ideal.yaml --shards 13 -o job").err,
              HasSubstr("13 tasks are more than the 12 conditions"));
}

}  // namespace
