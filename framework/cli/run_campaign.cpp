// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Runs a pipeline on every condition of a campaign. Plugins stay loaded, and compiled tables stay in memory, between
// conditions.
#include "cli/campaign_pipeline.hpp"
#include "cli/progress.hpp"
#include "cli/run.hpp"
#include "cli/watch.hpp"

#include "graph/outputs.hpp"
#include "graph/validation.hpp"
#include "io/campaign.hpp"
#include "io/output_file.hpp"
#include "io/profile.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <mutex>
#include <set>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* campaign_name = "campaign.yaml";
constexpr const char* camera_name = "camera.yaml";

[[noreturn]] void refuse(std::string_view option, const std::string& problem) {
  throw config::ConfigurationError(fmt::format("{}: error: {}", option, problem));
}

class CampaignRun {
 public:
  CampaignRun(const RunArguments& arguments, const Common& common)
      : arguments_(arguments), common_(common), out_(fs::absolute(arguments.out).lexically_normal()) {
    read_campaign();
    read_pipeline();
    check_outputs();
  }

  int run() {
    handle_signals();
    Progress bar(common_.quiet);
    for (std::size_t i = 0; i < campaign_.conditions.size() && signals == 0; ++i) {
      const io::Condition& condition = campaign_.conditions[i];
      bar.show(static_cast<double>(i) / static_cast<double>(campaign_.conditions.size()),
               fmt::format("condition {} of {}, {}", i + 1, campaign_.conditions.size(), condition.id));
      run_condition(condition);
    }
    bar.finish();
    write_results();
    return signals != 0 ? interrupted : failures_.empty() ? done : failed;
  }

 private:
  void read_campaign() {
    config::Diagnostics diagnostics;
    campaign_ = io::read_campaign(arguments_.campaign, diagnostics);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    if (campaign_.from_table) refuse("--campaign", "has a table of statistics and no captures to run a pipeline on");
    std::set<std::string> names;
    for (const io::Condition& c : campaign_.conditions) {
      if (!names.insert(folder_name(c.id)).second)
        refuse("--campaign", fmt::format("the results of the condition '{}' would be in the folder '{}' of another one",
                                         c.id, folder_name(c.id)));
    }
  }

  void read_pipeline() {
    config::Diagnostics diagnostics;
    const config::Value document = arguments_.document();
    graph::PipelineSpec pipeline = graph::parse_pipeline(document, diagnostics);
    for (const std::string& setting : arguments_.settings) graph::apply_setting(pipeline, setting, diagnostics);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    if (!pipeline.camera) pipeline.camera = campaign_.camera_value;
    pipeline_.emplace(std::move(pipeline), out_, common_.plugin_folders);
  }

  void check_outputs() const {
    const std::array<fs::path, 2> inputs = {arguments_.campaign, arguments_.pipeline};
    for (const char* name : {campaign_name, camera_name}) {
      std::string problem = io::input_problem(out_ / name, inputs);
      if (problem.empty()) problem = io::output_problem(out_ / name, arguments_.force, "--force");
      if (!problem.empty()) refuse("--out", problem);
    }
  }

  /// Builds the graph; each warning or message is printed only once for all conditions.
  std::unique_ptr<graph::Graph> graph_of(const io::Condition& condition) {
    config::Diagnostics diagnostics;
    auto graph = unshown_graph(condition, diagnostics);
    show_new(diagnostics);
    return graph;
  }

  /// @throws config::ConfigurationError
  std::unique_ptr<graph::Graph> unshown_graph(const io::Condition& condition, config::Diagnostics& diagnostics) {
    graph::GraphOptions options;
    options.plugin_folders = common_.plugin_folders;
    options.overwrite = arguments_.force;
    options.other_serial = arguments_.other_serial;
    options.message = [this, id = condition.id](const std::string& node, const std::string& text, bool warning) {
      say_once(fmt::format("{}: {}{}", node, warning ? "warning: " : "", text), id);
    };
    auto graph = std::make_unique<graph::Graph>(pipeline_->of(condition), options, diagnostics);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    return graph;
  }

  void show_new(const config::Diagnostics& diagnostics) {
    config::Diagnostics shown;
    for (const config::Diagnostic& one : diagnostics.all())
      if (is_new(one.message)) shown.add(std::vector<config::Diagnostic>{one});
    if (!common_.quiet && !shown.all().empty()) print_message(shown.text());
  }

  void say_once(const std::string& text, const std::string& id) {
    if (!common_.quiet && is_new(text)) print_message(fmt::format("{}: {}", id, text));
  }
  /// Stages report from several threads.
  bool is_new(const std::string& text) {
    const std::lock_guard lock(mutex_);
    return seen_.insert(text).second;
  }

  /// Capture written by a condition's graph: by the pipeline's own capture_writer, or by one that is added.
  fs::path result_of(const graph::Graph& graph) const {
    fs::path file;
    for (const auto& node : graph.nodes()) {
      if (std::string_view(node->stage().name) != "capture_writer") continue;
      for (const io::OutputPattern& pattern : node->outputs())
        if (!pattern.text().empty()) file = pattern.text();
    }
    return file;
  }

  /// Chooses the node to record from the first graph if the pipeline records none.
  std::unique_ptr<graph::Graph> first_graph(const io::Condition& condition) {
    config::Diagnostics diagnostics;
    auto graph = unshown_graph(condition, diagnostics);
    looked_ = true;
    const bool records = !result_of(*graph).empty();
    // The recorder reads channels that nothing read before, so the warnings must be those of the graph with it.
    if (!records && pipeline_->add_recorder(*graph)) return graph_of(condition);
    show_new(diagnostics);
    if (!records)
      say_once("warning: no node gives images of distance, range or depth: no campaign of the results is written",
               condition.id);
    return graph;
  }

  void run_condition(const io::Condition& condition) {
    std::string problem;
    try {
      const auto graph = looked_ ? graph_of(condition) : first_graph(condition);
      problem = run_graph(*graph, condition);
    } catch (const config::ConfigurationError& error) {
      if (!looked_ || result_.conditions.empty()) throw;  // the pipeline itself is invalid
      problem = error.what();
    } catch (const std::exception& error) {
      problem = error.what();
    }
    if (problem.empty()) return;
    failures_.push_back(condition.id);
    print_message(fmt::format("error: condition '{}': {}", condition.id, problem));
  }

  /// @returns the error, or nothing
  std::string run_graph(graph::Graph& graph, const io::Condition& condition) {
    for (const auto& node : graph.nodes())
      if (arguments_.validate) node->set_validating();
    graph::RunOptions options;
    if (arguments_.frames != 0) options.frames = arguments_.frames;
    options.threads = arguments_.threads;
    graph::Runner runner(graph, options);
    graph::RunResult result;
    {
      const Watch watch(runner, true);
      result = runner.run();
    }
    frames_ += result.frames;
    dropped_ += result.dropped;
    for (const std::string& warning : result.warnings)
      if (!common_.quiet) print_message(fmt::format("{}: warning: {}", condition.id, warning));
    if (!result.error.empty()) return result.error;
    if (result.interrupted) return {};
    if (result.frames == 0) return "no frame went through the pipeline";
    add_result(graph, condition);
    return {};
  }

  void add_result(const graph::Graph& graph, const io::Condition& condition) {
    const fs::path capture = result_of(graph);
    std::error_code error;
    if (capture.empty() || !fs::is_regular_file(capture, error)) return;
    io::Condition& made = result_.conditions.emplace_back(condition);
    made.capture = capture;
    made.frames.reset();
    if (camera_text_.empty()) camera_text_ = recorded_camera(graph);
  }

  /// Profile of the camera whose frames are recorded, with the lens set by the pipeline.
  static std::string recorded_camera(const graph::Graph& graph) {
    for (const auto& node : graph.nodes()) {
      if (std::string_view(node->stage().name) != "capture_writer") continue;
      const io::CameraPtr& camera = graph.nodes()[graph.inputs(node->index).front()]->output().camera;
      if (camera) return io::profile_text(camera->view());
    }
    return {};
  }

  void write_results() {
    if (!result_.conditions.empty()) {
      result_.name = campaign_.name;
      result_.notes = campaign_.notes;
      result_.pattern = campaign_.pattern;
      result_.jitter = campaign_.jitter;
      result_.source = fs::absolute(arguments_.campaign).lexically_normal();
      result_.camera_name = camera_name;
      io::write_file(out_ / camera_name, camera_text_);
      io::write_campaign(result_, out_ / campaign_name);
    }
    if (common_.quiet) return;
    print_message(
        fmt::format("{} of {}, {} in {}{}", result_.conditions.size(),
                    config::counted(campaign_.conditions.size(), "condition"), config::counted(frames_, "frame"),
                    duration_text(std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count()),
                    dropped_ != 0 ? fmt::format(", {} dropped", config::counted(dropped_, "frame")) : ""));
    if (!failures_.empty()) print_message(fmt::format("failed: {}", fmt::join(failures_, ", ")));
    if (!result_.conditions.empty()) print_message(fmt::format("wrote {}", (out_ / campaign_name).string()));
  }

  const RunArguments& arguments_;
  const Common& common_;
  fs::path out_;
  io::Campaign campaign_, result_;
  std::optional<CampaignPipeline> pipeline_;
  bool looked_ = false;  ///< the first graph was built and the need for a recorder is known
  std::mutex mutex_;
  std::set<std::string> seen_;  ///< messages already printed
  std::vector<std::string> failures_;
  std::string camera_text_;
  std::uint64_t frames_ = 0, dropped_ = 0;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

int run_campaign(const RunArguments& arguments, const Common& common) {
  if (arguments.out.empty()) refuse("--campaign", "needs a folder for the results, e.g. -o results");
  if (!arguments.stats.empty()) refuse("--stats", "is for one run, not for a campaign: remove it");
  if (!arguments.time_limit.empty()) refuse("--time-limit", "is for one run, not for a campaign: remove it");
  if (arguments.validate) graph::set_validating();
  return CampaignRun(arguments, common).run();
}

}  // namespace tofgraph::cli
