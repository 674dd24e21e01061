// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Ranks of an MPI job give the same bits as one process.
// Slow: *
// Rooms: diagnosis cli
// Its tests share the campaign that SetUpTestSuite makes.
#include "tests/divided_campaign.hpp"

using namespace tofgraph::tests;
using testing::HasSubstr;
namespace fs = std::filesystem;

namespace {

using Mpi = DividedCampaign;

TEST_F(Mpi, RanksGiveTheSameReport) {
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

}  // namespace
