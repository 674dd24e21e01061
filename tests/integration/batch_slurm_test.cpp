// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A campaign as jobs of a real one-node Slurm, which the test starts in its own folder.
// Slow: *
// Rooms: reduction diagnosis cli
// The tests share the campaign created by SetUpTestSuite.
// Alone: Slurm's daemons have fixed ports, and tasks are killed by the clock
#include "tests/divided_campaign.hpp"

#include <unistd.h>

#include <iostream>
#include <map>
#include <random>

using namespace tofgraph::tests;
using testing::HasSubstr;
namespace fs = std::filesystem;

namespace {

/// munged, slurmctld and slurmd in a folder of their own, terminated by their process ids.
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
  /// Waits until no jobs remain. @returns false after two minutes
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

using BatchSlurm = DividedCampaign;

TEST_F(BatchSlurm, SlurmGivesTheSameReport) {
  if (geteuid() != 0 || !is_installed("slurmctld") || !is_installed("slurmd") || !is_installed("munged"))
    GTEST_SKIP() << "Slurm's daemons (slurm-wlm, munge) are not installed, or this user may not start them";
  const OneNodeSlurm slurm;
  if (!slurm.is_up()) GTEST_SKIP() << "Slurm does not start here: " << slurm.logs();
  const Outcome submitted = slurm.run(batch("slurm", "'by slurm'") + " --submit", home());
  EXPECT_EQ(submitted.exit_code, 0) << submitted.err;
  const Outcome twice = slurm.run("$TOFGRAPH batch --submit -o 'by slurm'", home());
  EXPECT_NE(twice.exit_code, 0);
  EXPECT_THAT(twice.err, HasSubstr("jobs of this folder still wait or run"));
  EXPECT_THAT(submitted.out, HasSubstr("diagnose: job"));
  ASSERT_TRUE(slurm.wait());
  EXPECT_EQ(result_of("by slurm/result"), result_of("whole")) << done("$TOFGRAPH batch --status 'by slurm'").out;
}

TEST_F(BatchSlurm, SlurmAfterKills) {
  if (geteuid() != 0 || !is_installed("slurmctld") || !is_installed("slurmd") || !is_installed("munged"))
    GTEST_SKIP() << "Slurm's daemons (slurm-wlm, munge) are not installed, or this user may not start them";
  const OneNodeSlurm slurm;
  if (!slurm.is_up()) GTEST_SKIP() << "Slurm does not start here: " << slurm.logs();
  std::mt19937 generator(5);
  std::uniform_int_distribution<int> pause(0, 250);  // ms
  EXPECT_EQ(slurm.run(batch("slurm", "killed", 3, 0), home()).exit_code, 0);
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
      // A task of this job only: its command line contains the job's folder.
      const Outcome kill =
          slurm.run("for i in $(seq 60); do p=$(pgrep -f '" + (home() / "killed").string() +
                        "/[s]tats --' | head -n 1); [ -n \"$p\" ] && break; sleep 0.05; done; sleep 0." +
                        std::to_string(1000 + pause(generator)).substr(1) + "; [ -n \"$p\" ] && kill -9 $p",
                    home());
      killed_tasks += kill.exit_code == 0 ? 1U : 0U;
      check();
    }
    if (round % 4 == 1) {
      slurm.kill_node();
      ++killed_nodes;
      slurm.start_node();
    }
    EXPECT_TRUE(slurm.wait());
    check();
  }
  for (int i = 0; i < 5 && !fs::exists(home() / "killed/result/report.html"); ++i) {
    EXPECT_EQ(slurm.run("$TOFGRAPH batch --submit -o killed", home()).exit_code, 0);
    EXPECT_TRUE(slurm.wait());
  }
  check();
  EXPECT_EQ(result_of("killed/result"), result_of("plain")) << done("$TOFGRAPH batch --status killed").out;
  EXPECT_EQ(statistics_in(home() / "killed/stats"), 12U);
  EXPECT_GE(killed_tasks, 5U);
  EXPECT_GE(killed_nodes, 1U);
  RecordProperty("killed_tasks", static_cast<int>(killed_tasks));
  RecordProperty("killed_nodes", static_cast<int>(killed_nodes));
  std::cout << killed_tasks << " tasks and " << killed_nodes << " daemons of the node killed\n";
}

}  // namespace
