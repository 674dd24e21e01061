// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/batch.hpp"
#include "cli/commands.hpp"
#include "cli/diagnose.hpp"
#include "cli/progress.hpp"
#include "cli/shell_words.hpp"
#include "config/diagnostics.hpp"
#include "config/paths.hpp"
#include "io/campaign.hpp"
#include "io/output_file.hpp"
#include "io/sha256.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

extern char** environ;

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

// The engine ends tasks that exceed their request, so requests are several times the expected cost.
constexpr double time_margin = 4, memory_margin = 2;
constexpr double shard_seconds = 600;                    // target for one task of reduce
constexpr double min_task_seconds = 600;                 // requested by every task
constexpr double min_task_memory = 512.0 * (1U << 20U);  // bytes, requested by every task
// Cost of one condition in diagnose, searched or only predicted, about that of docs/large_campaigns.md.
constexpr double search_seconds = 0.3, search_bytes = 5.0 * (1U << 20U);
constexpr double predict_seconds = 0.04, predict_bytes = 0.05 * (1U << 20U);

/// Returns a child's exit code and its resource usage. @param log receives its output
std::pair<int, rusage> run_child(const std::vector<std::string>& words, const fs::path& log) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions{};
  posix_spawn_file_actions_init(&actions);
  if (!log.empty()) {
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0666);
    posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  }
  pid_t child = 0;
  const int problem = posix_spawnp(&child, arguments.front(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (problem != 0) throw std::runtime_error(fmt::format("{} cannot be started: {}", words.front(), strerror(problem)));
  int status = 0;
  rusage used{};
  while (wait4(child, &status, 0, &used) < 0 && errno == EINTR) continue;
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), used};
}

fs::path own_program() { return fs::read_symlink("/proc/self/exe"); }

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file.string() + " cannot be read");
  return {std::istreambuf_iterator<char>(in), {}};
}

/// "01:30:00"
std::string slurm_time(double seconds) {
  const auto minutes = static_cast<std::size_t>(std::ceil(std::max(seconds, min_task_seconds) / 60));
  return fmt::format("{:02}:{:02}:00", minutes / 60, minutes % 60);
}
std::string slurm_memory(double bytes) {
  return fmt::format("{:.0f}M", std::ceil(std::max(bytes, min_task_memory) / (1U << 20U)));
}

struct Plan {
  std::size_t conditions = 0, shards = 1;
  TaskCost cost;
  double bytes = 0;            ///< of all captures
  std::string profile_sha256;  ///< of the camera's profile
};

Plan plan_of(const BatchArguments& arguments, const fs::path& out) {
  config::Diagnostics diagnostics;
  const io::Campaign campaign = io::read_campaign(arguments.campaign, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  if (campaign.from_table)
    throw config::ConfigurationError(
        fmt::format("{}: error: is a table of means, which diagnose reads in seconds", arguments.campaign));
  Plan plan;
  plan.conditions = campaign.conditions.size();
  plan.profile_sha256 = io::sha256_of_file(campaign.camera->file);
  for (const io::Condition& c : campaign.conditions) plan.bytes += static_cast<double>(fs::file_size(c.capture));
  plan.cost = measured_cost(arguments, plan.conditions, out / "measure");
  const double all = plan.cost.seconds * plan.bytes / plan.cost.bytes;
  plan.shards = arguments.shards != 0
                    ? arguments.shards
                    : std::clamp<std::size_t>(static_cast<std::size_t>(all / shard_seconds) + 1, 1, plan.conditions);
  if (plan.shards > plan.conditions)
    throw config::ConfigurationError(fmt::format("--shards: error: {} tasks are more than the {}", plan.shards,
                                                 config::counted(plan.conditions, "condition")));
  return plan;
}

/// Assignments that identify the results of this job: outputs of other jobs must not count as done.
std::string identity_text(const BatchArguments& a, const Plan& plan) {
  return fmt::format("CAMPAIGN_SHA256={}\nMODEL_SHA256={}\nSHARDS={}\nCASES={}\nCASE_SHARDS={}\n",
                     io::sha256_of_file(a.campaign), io::sha256_of_file(a.model), plan.shards, a.confidence,
                     a.confidence);
}

constexpr std::string_view profile_assignment = "PROFILE_SHA256=";

/// Returns whether results of the job with these assignments belong to another job. Jobs of earlier versions do not
/// state the camera's profile.
bool is_other_job(const std::string& before, const BatchArguments& a, const Plan& plan) {
  const std::size_t profile = before.find(profile_assignment);
  return before.find(identity_text(a, plan)) == std::string::npos ||
         (profile != std::string::npos &&
          before.compare(profile + profile_assignment.size(), plan.profile_sha256.size(), plan.profile_sha256) != 0);
}

/// Assignments read by all scripts.
std::string plan_text(const BatchArguments& a, const Plan& plan, const fs::path& out) {
  const auto path = [](const fs::path& file) { return in_shell(fs::absolute(file).lexically_normal().string()); };
  const double a_shard = plan.cost.seconds * plan.bytes / plan.cost.bytes / static_cast<double>(plan.shards);
  const auto conditions = static_cast<double>(plan.conditions);
  // The measured memory is that of one condition, and each thread processes one.
  const double at_once = std::min<double>(a.threads, std::ceil(conditions / static_cast<double>(plan.shards)));
  std::string text =
      fmt::format("# {} of {:.3g} MB in all. Measured: {:.3g} s and {:.0f} MB of memory for a capture of {:.3g} MB.\n",
                  config::counted(plan.conditions, "condition"), plan.bytes / 1e6, plan.cost.seconds,
                  plan.cost.memory_bytes / 1e6, plan.cost.bytes / 1e6);
  text += fmt::format("TOFGRAPH={}\nCAMPAIGN={}\nMODEL={}\nSTATS={}\nRESULT={}\n", path(own_program()),
                      path(a.campaign), path(a.model), path(out / "stats"), path(out / "result"));
  std::string plugins;
  for (const fs::path& folder : a.plugin_path) plugins += path(folder) + ":";
  if (!plugins.empty()) text += fmt::format("export TOFGRAPH_PLUGIN_PATH={}\"$TOFGRAPH_PLUGIN_PATH\"\n", plugins);
  text +=
      identity_text(a, plan) + fmt::format("{}{}\nTHREADS={}\n", profile_assignment, plan.profile_sha256, a.threads);
  text += fmt::format(
      "# Limits: {:.0f} times the expected time and {:.0f} times the expected memory; environment.sh may "
      "set others.\n",
      time_margin, memory_margin);
  text += fmt::format("REDUCE_TIME={}\nREDUCE_MEMORY={}\n", slurm_time(time_margin * a_shard),
                      slurm_memory(memory_margin * at_once * plan.cost.memory_bytes));
  const double searched = std::min<double>(conditions, DiagnoseArguments::usual_max_conditions);
  const double predicted = conditions - searched;
  text += fmt::format("DIAGNOSE_TIME={}\nDIAGNOSE_MEMORY={}\n",
                      slurm_time(time_margin * (search_seconds * searched + predict_seconds * predicted)),
                      slurm_memory(memory_margin * (search_bytes * searched + predict_bytes * predicted)));
  return text;
}

}  // namespace

TaskCost measured_cost(const BatchArguments& arguments, std::size_t conditions, const fs::path& scratch) {
  fs::create_directories(scratch);
  const auto begin = std::chrono::steady_clock::now();
  const auto [code, used] =
      run_child({own_program().string(), "reduce", arguments.campaign, "-o", scratch.string(), "--threads",
                 fmt::format("{}", arguments.threads), "--shard", fmt::format("1/{}", conditions)},
                scratch / "log");
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  const std::string log = text_of(scratch / "log");
  TaskCost cost{took.count(), 0, static_cast<double>(used.ru_maxrss) * 1024};
  config::Diagnostics diagnostics;
  const io::Campaign campaign = io::read_campaign(arguments.campaign, diagnostics);
  if (code == 0) cost.bytes = static_cast<double>(fs::file_size(campaign.conditions.front().capture));
  fs::remove_all(scratch);
  if (code == 2) throw config::ConfigurationError(log);
  if (code != 0) throw std::runtime_error("the first condition cannot be reduced:\n" + log);
  return cost;
}

int make_job(const BatchArguments& arguments) {
  const fs::path out = fs::absolute(arguments.out).lexically_normal();
  std::string problem = io::write_error(out / "plan.sh");
  if (problem.empty() && fs::exists(out) && !fs::is_empty(out) && !fs::exists(out / "plan.sh"))
    problem = fmt::format("the folder {} is not empty and holds no job", out.string());
  else if (problem.empty() && fs::exists(out / "plan.sh") && !arguments.force)
    problem = fmt::format(
        "{} is a job already\n         to continue it: tofgraph batch --submit -o {}; --force writes its scripts "
        "again",
        out.string(), in_shell(arguments.out));
  if (problem.empty() && out.string().find_first_of("'\"`$\\%{}\n") != std::string::npos)
    problem = fmt::format(
        "{} has a character of ' \" ` $ \\ % {{ }} or a line break, which the scripts of the engines interpret "
        "differently",
        out.string());
  if (!problem.empty()) throw config::ConfigurationError(fmt::format("--out: error: {}", problem));
  if (!fs::is_regular_file(arguments.model))
    throw config::ConfigurationError(fmt::format("--model: error: there is no file {}", arguments.model));
  const Plan plan = plan_of(arguments, out);
  if (fs::exists(out / "plan.sh") && is_other_job(text_of(out / "plan.sh"), arguments, plan))
    throw config::ConfigurationError(fmt::format(
        "--out: error: the job in {} is of another campaign, model, number of tasks or of cases, or the "
        "camera's profile has changed, as its plan.sh states\n         give another folder, or remove this one",
        out.string()));
  fs::create_directories(out / "log");
  const fs::path templates = config::template_folder() / "batch";
  for (const auto& [from, to] : {std::pair<std::string, std::string>{"task.sh", "task.sh"},
                                 {"missing.sh", "missing.sh"},
                                 {"status.sh", "status.sh"},
                                 {"Snakefile", "Snakefile"},
                                 {"environment.sh", "environment.sh"},
                                 {"submit_" + arguments.engine + ".sh", "submit.sh"}}) {
    if (to == "environment.sh" && fs::exists(out / to)) continue;  // the user's value
    io::write_file(out / to, text_of(templates / from));
  }
  io::write_file(out / "plan.sh", plan_text(arguments, plan, out));
  if (!arguments.quiet)
    print_message(fmt::format("wrote {}: {} in {}; to start: tofgraph batch --submit -o {}", out.string(),
                              config::counted(plan.conditions, "condition"), config::counted(plan.shards, "task"),
                              in_shell(arguments.out)));
  return 0;
}

int run_job_script(const BatchArguments& arguments, const std::string& script) {
  const fs::path file = fs::path(arguments.out) / script;
  if (!fs::exists(file))
    throw config::ConfigurationError(
        fmt::format("error: {} is not a job: there is no {}\n         example: tofgraph batch campaign.yaml --model "
                    "ideal.yaml --engine slurm -o {}",
                    arguments.out, script, in_shell(arguments.out)));
  return run_child({"sh", file.string()}, {}).first;
}

}  // namespace tofgraph::cli
