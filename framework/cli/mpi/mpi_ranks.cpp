// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Ranks of an MPI job for tofgraph-mpi: the program under another name, which loads this library before a command.
#include "config/shard.hpp"

#include <mpi.h>

#include <limits>
#include <numeric>
#include <stdexcept>

namespace tofgraph::cli {
namespace {

class MpiRanks final : public config::Ranks {
 public:
  MpiRanks() {
    // All threads of a rank compute; only its main thread calls MPI.
    int level = MPI_THREAD_SINGLE;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &level);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
  }
  ~MpiRanks() override { MPI_Finalize(); }

  std::size_t rank() const override { return static_cast<std::size_t>(rank_); }
  std::size_t size() const override { return static_cast<std::size_t>(size_); }

  std::vector<std::string> gather(const std::string& mine) const override {
    if (mine.size() > static_cast<std::size_t>(std::numeric_limits<int>::max() / size_))
      throw std::runtime_error("the results of a rank are too large to be gathered");
    const int own = static_cast<int>(mine.size());
    std::vector<int> sizes(size()), starts(size());
    MPI_Allgather(&own, 1, MPI_INT, sizes.data(), 1, MPI_INT, MPI_COMM_WORLD);
    std::exclusive_scan(sizes.begin(), sizes.end(), starts.begin(), 0);
    std::string all(static_cast<std::size_t>(starts.back() + sizes.back()), '\0');
    MPI_Allgatherv(mine.data(), own, MPI_CHAR, all.data(), sizes.data(), starts.data(), MPI_CHAR, MPI_COMM_WORLD);
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < size(); ++i)
      texts.push_back(all.substr(static_cast<std::size_t>(starts[i]), static_cast<std::size_t>(sizes[i])));
    return texts;
  }

  void abort(int code) const override { MPI_Abort(MPI_COMM_WORLD, code); }

 private:
  int rank_ = 0, size_ = 1;
};

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) void tofgraph_set_ranks() {
  tofgraph::config::set_ranks(std::make_unique<tofgraph::cli::MpiRanks>());
}
