// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/progress.hpp"
#include "cli/reduce.hpp"
#include "config/diagnostics.hpp"
#include "config/log.hpp"
#include "reduction/statistics_folder.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <filesystem>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

int merge(const ReduceArguments& arguments) {
  const std::vector<fs::path> folders(arguments.folders.begin(), arguments.folders.end());
  const std::size_t conditions = reduction::merge_statistics(folders, arguments.out);
  if (!arguments.quiet)
    print_message(fmt::format("wrote {}: statistics of {}", (fs::path(arguments.out) / "campaign.yaml").string(),
                              config::counted(conditions, "condition")));
  return 0;
}

int reduce(const ReduceArguments& arguments) {
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    arguments.threads != 0 ? arguments.threads : config::default_threads());
  reduction::ReduceOptions options{arguments.campaign, arguments.out, config::parse_shard(arguments.shard), {}};
  Progress bar(arguments.quiet);
  options.progress = [&](std::size_t done, std::size_t all) {
    bar.show(static_cast<double>(done) / static_cast<double>(all), fmt::format("condition {} of {}", done, all));
  };
  const reduction::ReduceResult result = reduction::reduce_campaign(options);
  bar.finish();
  if (config::ranks().rank() != 0) return 0;  // the first rank prints all failures and returns the code
  for (const std::string& file : result.damaged) print_message("warning: " + file + "; made again");
  constexpr std::size_t shown = 10;
  for (std::size_t i = 0; i < std::min(shown, result.failed.size()); ++i) print_message("error: " + result.failed[i]);
  if (result.failed.size() > shown) print_message(fmt::format("error: and {} more", result.failed.size() - shown));
  if (!arguments.quiet)
    print_message(fmt::format("{}{}: {} reduced, {} existed already, {} damaged and made again, {} failed",
                              arguments.out, options.shard.is_whole() ? "" : ", shard " + options.shard.text(),
                              result.made - std::min(result.made, result.damaged.size()), result.there,
                              result.damaged.size(), result.failed.size()));
  return result.failed.empty() ? 0 : 1;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  const auto& wanted = *static_cast<const tofgraph::cli::ReduceArguments*>(arguments);
  return wanted.folders.empty() ? tofgraph::cli::reduce(wanted) : tofgraph::cli::merge(wanted);
}
