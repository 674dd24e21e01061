// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/view.hpp"

#include "cli/command_line.hpp"
#include "cli/run.hpp"
#include "graph/camera_spec.hpp"
#include "graph/pipeline.hpp"
#include "graph/plugin.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <filesystem>

namespace tofgraph::cli {
namespace {

struct ViewArguments : RunArguments {
  ViewOptions view{.hold = true};
};

bool is_camera(const std::string& what) {
  return what == "camcube" || (graph::is_camera_spec(what) && what.find_first_of(" !/") > what.find(':'));
}

/// Quotes a file name with blanks, ! or quotes for the one-line form.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? "''" : std::string(1, c);
  return result + "'";
}

std::string text_at(const config::Value& node, const char* key) {
  const config::Entry* entry = node.find(key);
  return entry != nullptr ? entry->value.text : "";
}

/// Builds a pipeline to find out its outputs; null if it cannot run. @param problem receives the reason
std::unique_ptr<graph::Graph> tried(const std::string& text, const ViewArguments& arguments, const Common& common,
                                    std::string* problem = nullptr) {
  try {
    Common quiet = common;
    quiet.quiet = true;
    return build(graph::pipeline_from_line(text, arguments.camera), {}, quiet, false);
  } catch (const config::ConfigurationError& error) {
    if (problem != nullptr) *problem = error.what();
    return nullptr;
  }
}

/// Stages that turn a source's output into a cloud, in the one-line form. Initial parameter values denoise and mask
/// nothing visible until the user moves a slider.
std::string default_stages(const graph::Stream& delivered) {
  const auto has = [&](const char* name) { return delivered.find(name) != nullptr; };
  const bool raw = has("taps") || has("phases"), length = has("range") || has("depth");
  if (!raw && !has("distance") && !length) return "";
  std::string stages = raw ? " ! four_phase_decoder name=decode" : "";
  if (raw || (has("distance") && !length)) stages += " ! optimized_bistatic name=correct";
  if (raw || has("amplitude")) stages += " ! mask name=mask min_amplitude='0 counts'";
  return stages + " ! non_local_means name=denoise strength='0.1 mm' ! point_cloud name=cloud";
}

/// Channels to read, so that no stage recomputes a recorded channel. Empty: all.
std::string channels_read(const graph::Stream& delivered) {
  const auto has = [&](const char* name) { return delivered.find(name) != nullptr; };
  std::vector<std::string> chosen;
  for (const char* name : {"taps", "phases", "range", "depth", "distance"}) {
    if (chosen.empty() && has(name)) chosen.emplace_back(name);
  }
  if (chosen.empty()) return "";
  const bool raw = chosen.front() == "taps" || chosen.front() == "phases";
  for (const char* name : {"amplitude", "intensity", "sigma", "flags"}) {
    if (!raw && has(name)) chosen.emplace_back(name);
  }
  return fmt::format(" channels=[{}]", fmt::join(chosen, ", "));
}

/// Default pipeline for a recording or a camera. @throws config::ConfigurationError if it cannot be read
std::string default_pipeline(const std::string& what, bool camera, const ViewArguments& arguments,
                             const Common& common) {
  std::string source = camera ? what : "capture_reader name=read file=" + quoted(what);
  std::string problem;
  auto read = tried(source + " ! null", arguments, common, &problem);
  if (!read) throw config::ConfigurationError(problem);
  const graph::Stream delivered = read->nodes().front()->output();
  read.reset();
  if (!camera) source += channels_read(delivered);
  std::string whole = source + default_stages(delivered);
  if (tried(whole + " ! null", arguments, common, &problem)) return whole;
  print_message("warning: shown as it was recorded, since no cloud can be made of it:\n" + problem);
  return source;
}

int run_view(ViewArguments& arguments, const Common& common) {
  const std::string& what = arguments.pipeline;
  const bool camera = is_camera(what);
  std::error_code error;
  const bool line = what.find('!') != std::string::npos && !std::filesystem::is_regular_file(what, error);
  const bool pipeline = !camera && (what.ends_with(".yaml") || what.ends_with(".yml") || line);
  arguments.view.recorded = !camera && !pipeline;
  const config::Value document =
      pipeline ? arguments.document()
               : graph::pipeline_from_line(default_pipeline(what, camera, arguments, common), arguments.camera);
  return run_once(with_view(document, arguments.view, common), arguments, common);
}

}  // namespace

config::Value with_view(config::Value document, const ViewOptions& options, const Common& common) {
  const auto nodes = std::ranges::find(document.entries, "nodes", &config::Entry::key);
  if (nodes == document.entries.end() || !nodes->value.is_list()) return document;  // reported as for any pipeline
  const graph::PluginRegistry registry(common.plugin_folders);
  std::vector<std::string> shown;
  for (const config::Value& node : nodes->value.items) {
    const std::string stage = text_at(node, "stage"), name = text_at(node, "name");
    if (stage == "live_view") return document;
    const graph::PluginFile* file = registry.find(stage);
    if (file != nullptr && file->kind != "sink") shown.push_back(config::yaml_word(name.empty() ? stage : name));
  }
  if (shown.empty()) return document;
  const std::string text =
      fmt::format("{{name: live_view, stage: live_view, inputs: [{}], port: {}, hold: {}{}}}", fmt::join(shown, ", "),
                  options.port, options.hold, options.recorded ? ", wait: true, pace: 30 Hz" : "");
  nodes->value.items.push_back(config::parse_document("--view", text));
  return document;
}

void add_view(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<ViewArguments>();
  CLI::App* command = app.add_subcommand("view", "Show a recording, a camera or a pipeline live in the web browser");
  command->footer(
      "Examples: tofgraph view board.h5\n"
      "          tofgraph view simulated:pipelines/scenes/boxes.yaml\n"
      "          tofgraph view camcube --camera camcube2\n"
      "It prints the address of the page and ends with Ctrl-C. tofgraph run --view shows any run.");
  command
      ->add_option("WHAT", arguments->pipeline,
                   fmt::format("A capture (.h5), a camera ({}), or a pipeline", graph::camera_specs))
      ->required();
  command->add_option("--camera", arguments->camera, "Camera profile by name or path")->option_text("CAMERA");
  command->add_option("--set", arguments->settings, "Replaces a parameter of a node; may be repeated")
      ->option_text("NODE.PARAMETER=VALUE")
      ->take_all()
      ->expected(1);
  command->add_option("--port", arguments->view.port, "TCP port of the page; 0: any free one; default: 8765")
      ->option_text("N")
      ->check(whole_number(0, 65535));
  command->add_option("--frames", arguments->frames, "Stop after this number of frames")
      ->option_text("N")
      ->check(whole_number(1, 1000000000));
  command->callback(
      [arguments, &common] { common.command = [arguments, &common] { return run_view(*arguments, common); }; });
}

}  // namespace tofgraph::cli
