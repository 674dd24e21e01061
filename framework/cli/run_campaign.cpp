// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A pipeline over every condition of a campaign. The plugins stay loaded, and compiled tables stay in memory, between
// conditions.
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
#include <cctype>
#include <set>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* campaign_name = "campaign.yaml";
constexpr const char* camera_name = "camera.yaml";
constexpr const char* result_name = "result.h5";

[[noreturn]] void refuse(std::string_view option, const std::string& problem) {
  throw config::ConfigurationError(fmt::format("{}: error: {}", option, problem));
}

config::Value word_at(std::string text, const config::Position& at) {
  config::Value value;
  value.kind = config::Value::Kind::scalar;
  value.text = std::move(text);
  value.quoted = true;
  value.at = at;
  return value;
}

/// Replaces or adds a parameter.
void set_parameter(graph::NodeSpec& node, const std::string& key, config::Value value) {
  std::erase_if(node.parameters, [&](const config::Entry& entry) { return entry.key == key; });
  node.parameters.push_back({key, value.at, std::move(value)});
}

/// The name of a condition's folder: letters, digits and -_. of its id.
std::string folder_name(const std::string& id) {
  std::string name = id;
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_' && c != '.') c = '_';
  return name.empty() || name.front() == '.' ? "_" + name : name;
}

/// Where an output goes below a condition's folder: as written, without what leads out of the pipeline's folder.
fs::path below(const fs::path& folder, const fs::path& written) {
  fs::path kept;
  if (written.is_absolute()) return folder / written.filename();
  for (const fs::path& part : written.lexically_normal())
    if (part != "..") kept /= part;
  return folder / kept;
}

/// The last node whose frames can be recorded and measured, and the channels to record.
struct Recordable {
  std::string node;
  std::vector<std::string> channels;
};
std::optional<Recordable> recordable(const graph::Graph& graph) {
  std::optional<Recordable> last;
  for (const auto& node : graph.nodes()) {
    if (node->is_sink() || !node->output().camera) continue;
    const tofgraph_camera& camera = node->output().camera->view();
    Recordable here{node->name, {}};
    bool length = false;
    for (const graph::Channel& channel : node->output().channels) {
      const bool image = channel.rank == 2 && channel.extent[0] == camera.height && channel.extent[1] == camera.width;
      if (!image) continue;
      here.channels.push_back(channel.name);
      length = length || channel.name == "depth" || channel.name == "range" || channel.name == "distance";
    }
    if (length) last = std::move(here);
  }
  return last;
}

class CampaignRun {
 public:
  CampaignRun(const RunArguments& arguments, const Common& common)
      : arguments_(arguments), common_(common), out_(fs::absolute(arguments.out).lexically_normal()) {
    read_campaign();
    registry_.emplace(common.plugin_folders);
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
    config::Value document = arguments_.document();
    const bool has_camera = document.find("camera") != nullptr;
    pipeline_ = graph::parse_pipeline(document, diagnostics);
    for (const std::string& setting : arguments_.settings) graph::apply_setting(pipeline_, setting, diagnostics);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    if (!has_camera && campaign_.camera) pipeline_.camera = word_at(campaign_.camera->file.string(), pipeline_.at);
    const auto reader = std::ranges::find(pipeline_.nodes, "capture_reader", &graph::NodeSpec::stage);
    if (reader == pipeline_.nodes.end())
      refuse("--campaign", "the pipeline has no capture_reader, which reads the captures of the conditions");
    source_ = static_cast<std::size_t>(reader - pipeline_.nodes.begin());
  }

  void check_outputs() const {
    const std::array<fs::path, 2> inputs = {arguments_.campaign, arguments_.pipeline};
    for (const char* name : {campaign_name, camera_name}) {
      std::string problem = io::input_problem(out_ / name, inputs);
      if (problem.empty()) problem = io::output_problem(out_ / name, arguments_.force, "--force");
      if (!problem.empty()) refuse("--out", problem);
    }
  }

  /// The keys of a stage's parameters that name files to write.
  std::vector<std::string> output_keys(const std::string& stage) const {
    const graph::PluginFile* file = registry_->find(stage);
    if (file == nullptr || file->kind == "effect") return {};  // reported by the graph
    std::vector<std::string> keys;
    for (const tofgraph_parameter& p : registry_->load(*file).own_parameters)
      if (p.kind == TOFGRAPH_KIND_OUTPUT_FILE || p.kind == TOFGRAPH_KIND_FRAME_FILES) keys.emplace_back(p.name);
    return keys;
  }

  /// The pipeline on one condition: its capture and frames, its folder for what is written.
  graph::PipelineSpec pipeline_of(const io::Condition& condition) const {
    graph::PipelineSpec pipeline = pipeline_;
    graph::NodeSpec& source = pipeline.nodes[source_];
    set_parameter(source, "file", word_at(fs::absolute(condition.capture).string(), source.at));
    if (condition.frames) {
      config::Value frames;
      frames.kind = config::Value::Kind::list;
      frames.at = source.at;
      for (const std::uint64_t frame : *condition.frames)
        frames.items.push_back(word_at(fmt::format("{}", frame), source.at));
      set_parameter(source, "frames", std::move(frames));
    }
    const fs::path folder = out_ / folder_name(condition.id);
    for (graph::NodeSpec& node : pipeline.nodes) {
      for (const std::string& key : output_keys(node.stage)) {
        const auto entry = std::ranges::find(node.parameters, key, &config::Entry::key);
        if (entry != node.parameters.end()) entry->value.text = below(folder, entry->value.text).string();
      }
    }
    if (recorded_) add_recorder(pipeline, folder);
    return pipeline;
  }

  void add_recorder(graph::PipelineSpec& pipeline, const fs::path& folder) const {
    const config::Position& at = pipeline.at;
    graph::NodeSpec node;
    node.name = "campaign_result";
    node.stage = "capture_writer";
    node.at = node.stage_at = at;
    node.inputs = {{"", recorded_->node, at}};
    config::Value channels = word_at(fmt::format("{}", fmt::join(recorded_->channels, " ")), at);
    set_parameter(node, "channels", std::move(channels));
    set_parameter(node, "path", word_at((folder / result_name).string(), at));
    pipeline.nodes.push_back(std::move(node));
  }

  /// Builds the graph; a warning or message is printed once for all conditions.
  std::unique_ptr<graph::Graph> graph_of(const io::Condition& condition) {
    graph::GraphOptions options;
    options.plugin_folders = common_.plugin_folders;
    options.overwrite = arguments_.force;
    options.other_serial = arguments_.other_serial;
    options.message = [this, id = condition.id](const std::string& node, const std::string& text, bool warning) {
      say_once(fmt::format("{}: {}{}", node, warning ? "warning: " : "", text), id);
    };
    config::Diagnostics diagnostics, shown;
    auto graph = std::make_unique<graph::Graph>(pipeline_of(condition), options, diagnostics);
    if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
    for (const config::Diagnostic& one : diagnostics.all())
      if (seen_.insert(one.message).second) shown.add(std::vector<config::Diagnostic>{one});
    if (!common_.quiet && !shown.all().empty()) say(shown.text());
    return graph;
  }

  void say_once(const std::string& text, const std::string& id) {
    if (common_.quiet || !seen_.insert(text).second) return;
    say(fmt::format("{}: {}", id, text));
  }

  /// The capture that a condition's graph writes; the pipeline's own capture_writer, or one that is added.
  fs::path result_of(const graph::Graph& graph) const {
    fs::path file;
    for (const auto& node : graph.nodes()) {
      if (std::string_view(node->stage().name) != "capture_writer") continue;
      for (const io::OutputPattern& pattern : node->outputs())
        if (!pattern.text().empty()) file = pattern.text();
    }
    return file;
  }

  /// The first graph shows which node's frames are recorded where the pipeline records none.
  std::unique_ptr<graph::Graph> first_graph(const io::Condition& condition) {
    auto graph = graph_of(condition);
    looked_ = true;
    if (!result_of(*graph).empty()) return graph;
    recorded_ = recordable(*graph);
    if (!recorded_) {
      say_once("warning: no node gives images of distance, range or depth: no campaign of the results is written",
               campaign_.name);
      return graph;
    }
    return graph_of(condition);
  }

  void run_condition(const io::Condition& condition) {
    std::string problem;
    try {
      const auto graph = looked_ ? graph_of(condition) : first_graph(condition);
      problem = run_graph(*graph, condition);
    } catch (const config::ConfigurationError& error) {
      if (!looked_ || result_.conditions.empty()) throw;  // the pipeline itself is wrong
      problem = error.what();
    } catch (const std::exception& error) {
      problem = error.what();
    }
    if (problem.empty()) return;
    failures_.push_back(condition.id);
    say(fmt::format("error: condition '{}': {}", condition.id, problem));
  }

  /// @returns what went wrong, or nothing
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
    wall_s_ += result.wall_s;
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

  /// Profile of the camera whose frames are recorded, with the lens that the pipeline gave it.
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
      result_.source = fs::absolute(arguments_.campaign).lexically_normal();
      result_.camera_name = camera_name;
      io::write_file(out_ / camera_name, camera_text_);
      io::write_campaign(result_, out_ / campaign_name);
    }
    if (common_.quiet) return;
    say(fmt::format("{} of {}, {} in {}", result_.conditions.size(),
                    config::counted(campaign_.conditions.size(), "condition"), config::counted(frames_, "frame"),
                    duration_text(wall_s_)));
    if (!failures_.empty()) say(fmt::format("failed: {}", fmt::join(failures_, ", ")));
    if (!result_.conditions.empty()) say(fmt::format("wrote {}", (out_ / campaign_name).string()));
  }

  const RunArguments& arguments_;
  const Common& common_;
  fs::path out_;
  io::Campaign campaign_, result_;
  std::optional<graph::PluginRegistry> registry_;
  graph::PipelineSpec pipeline_;
  std::size_t source_ = 0;  ///< node that reads the captures
  bool looked_ = false;     ///< the first graph was built: recorded_ is known
  std::optional<Recordable> recorded_;
  std::set<std::string> seen_;  ///< messages that were printed
  std::vector<std::string> failures_;
  std::string camera_text_;
  std::uint64_t frames_ = 0;
  double wall_s_ = 0;
};

}  // namespace

int run_campaign(const RunArguments& arguments, const Common& common) {
  if (arguments.out.empty()) refuse("--campaign", "needs a folder for the results, e.g. -o results");
  if (!arguments.stats.empty()) refuse("--stats", "is for one run, not for a campaign: leave it out");
  if (arguments.validate) graph::set_validating();
  return CampaignRun(arguments, common).run();
}

}  // namespace tofgraph::cli
