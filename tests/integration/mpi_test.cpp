// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Ranks of an MPI job give bit-identical results to a single process.
// Slow: *
// Rooms: reduction diagnosis cli
// The tests share the campaign created by SetUpTestSuite.
#include "tests/divided_campaign.hpp"

using namespace tofgraph::tests;
using testing::HasSubstr;
namespace fs = std::filesystem;

namespace {

class Mpi : public DividedCampaign {
 protected:
  void SetUp() override {
    if (!is_installed("mpirun") || !fs::exists(program()))
      GTEST_SKIP() << "tofgraph-mpi was not built, or there is no mpirun";
  }
  static fs::path program() { return fs::path(TOFGRAPH_PROGRAM).parent_path() / "tofgraph-mpi"; }
  static std::string start(int ranks) {
    return "export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1; mpirun --oversubscribe -n " +
           std::to_string(ranks) + " " + program().string();
  }
  static std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
  }
};

TEST_F(Mpi, RanksGiveTheSameReport) {
  for (const int ranks : {1, 2, 16}) {
    const std::string folder = "ranks" + std::to_string(ranks);
    // Processes that did not cooperate would each report it.
    EXPECT_EQ(
        count(done(start(ranks) + " reduce c/campaign.yaml -o " + folder + "_s").err, "12 reduced, 0 existed already"),
        1U);
    done(start(ranks) + " diagnose --model ideal.yaml --data " + folder + "_s -o " + folder +
         " --confidence 2 --quiet");
    EXPECT_EQ(result_of(folder), result_of("whole"));
  }
}

TEST_F(Mpi, RanksSearchAllCasesOfAShard) {
  for (const std::string shard : {"1/2", "2/2"})
    done(start(2) + " diagnose --model ideal.yaml --data c/campaign.yaml -o cases --confidence 4 --quiet --shard " +
         shard);
  EXPECT_EQ(listing(home() / "cases/cases").size(), 4U);
}

TEST_F(Mpi, SaysWhatIsWrong) {
  EXPECT_EQ(run(start(2) + " reduce none.yaml -o none").exit_code, 2);
  const Outcome other = run(start(2) + " simulate scene.yaml -o none");
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("MPI divides the work of reduce and diagnose alone"));
  EXPECT_FALSE(fs::exists(home() / "none"));
  EXPECT_THAT(run(start(2) + " diagnose --model ideal.yaml --data c/campaign.yaml -o none --time-limit '5 min'").err,
              HasSubstr("--time-limit: error:"));
  // A failing condition is named once, whichever rank has it and ends first: folders block the names of files.
  done("$TOFGRAPH reduce c/campaign.yaml -o bad --quiet");
  for (const std::string& name : listing(home() / "bad")) {
    if (!name.ends_with(".stats")) continue;
    fs::rename(home() / "bad" / name, home() / "kept.stats");
    fs::create_directory(home() / "bad" / name);
    const Outcome bad = run(start(2) + " reduce c/campaign.yaml -o bad");
    EXPECT_EQ(bad.exit_code, 1);
    EXPECT_EQ(count(bad.err, "error: condition '"), 1U) << bad.err;
    EXPECT_EQ(count(bad.err, "11 existed already"), 1U) << bad.err;
    fs::remove(home() / "bad" / name);
    fs::rename(home() / "kept.stats", home() / "bad" / name);
  }
}

TEST_F(Mpi, RanksThatAreKilledLeaveWholeFiles) {
  done("$TOFGRAPH reduce c/campaign.yaml -o one --quiet");
  // One of two is killed as soon as the first file exists; mpirun then terminates the other.
  int code = 0;
  for (int k = 0; k < 10 && code != 137; ++k) {
    fs::remove_all(home() / "killed");
    code = run(start(2) +
               " reduce c/campaign.yaml -o killed & p=$!; for i in $(seq 2000); do ls killed/*.stats >/dev/null 2>&1 "
               "&& break; sleep 0.005; done; kill -9 $(pgrep -P $p | tail -n 1); wait $p")
               .exit_code;
  }
  ASSERT_EQ(code, 137);
  for (const std::string& file : listing(home() / "killed")) {
    if (!file.ends_with(".stats")) continue;
    EXPECT_TRUE(read_text(home() / "killed" / file) == read_text(home() / "one" / file)) << file;
  }
  done(start(2) + " reduce c/campaign.yaml -o killed --quiet");
  EXPECT_EQ(read_text(home() / "killed/campaign.yaml"), read_text(home() / "one/campaign.yaml"));
}

}  // namespace
