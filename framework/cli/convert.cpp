// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/convert.hpp"
#include "cli/command_line.hpp"
#include "cli/run.hpp"
#include "io/output_file.hpp"
#include "io/profile.hpp"
#include "io/vendor_camera.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::cli {

namespace {

/// Makes errors name an option instead of a line of the generated pipeline.
void refer_to(config::Value& value, const std::string& option) {
  const std::filesystem::path base = value.at.source ? value.at.source->base : std::filesystem::path();
  value.at = {std::make_shared<const config::SourceText>(config::SourceText{option, value.text, base})};
  for (config::Value& item : value.items) refer_to(item, option);
}

/// Pipeline file_reader ! capture_writer with the given options. @param out path of the capture
config::Value reading_pipeline(const ReadingArguments& a, const std::string& out) {
  std::string text = "pipeline: 1\n";
  if (!a.run.camera.empty()) text += fmt::format("camera: {}\n", config::yaml_word(a.run.camera));
  text += "nodes:\n  - stage: file_reader\n";
  const auto set = [&text](const char* key, const std::string& value) {
    if (!value.empty()) text += fmt::format("    {}: {}\n", key, config::yaml_word(value));
  };
  const auto set_plain = [&text](const char* key, const std::string& value) {  // a list, or a number with its unit
    if (!value.empty()) text += fmt::format("    {}: {}\n", key, value);
  };
  if (a.files.size() > 1) {
    std::string list;
    for (const std::string& file : a.files) list += (list.empty() ? "" : "\n") + file;
    text += fmt::format("    files: {}\n", config::yaml_word(list));
  } else if (a.files.front().find_first_of("*?") != std::string::npos) {
    set("files", a.files.front());
  } else {
    set("file", a.files.front());
  }
  set("layout", a.layout);
  set("as", a.as);
  set("unit", a.unit);
  set("axes", a.axes);
  set_plain("invalid", a.invalid.empty() ? "" : "[" + a.invalid + "]");
  set_plain("integration_time", a.integration_time);
  set_plain("modulation_frequency", a.modulation_frequency);
  set_plain("frame_rate", a.frame_rate);
  text += "  - stage: capture_writer\n    write_behind: 16\n";  // files, unlike cameras, wait for a slow disk
  set("path", out);
  config::Value document = config::parse_document("convert", text, std::filesystem::current_path());
  for (config::Entry& entry : document.entries) {
    if (entry.key == "camera") refer_to(entry.value, "--camera");
    if (entry.key != "nodes") continue;
    for (config::Entry& setting : entry.value.items.front().entries) {
      std::string option = "--" + setting.key;
      std::ranges::replace(option, '_', '-');
      refer_to(setting.value, setting.key.starts_with("file") ? a.files.front() : option);
    }
    for (config::Entry& setting : entry.value.items.back().entries)
      if (setting.key == "path") refer_to(setting.value, "--out");
  }
  return document;
}

}  // namespace

int run_reading(const ReadingArguments& arguments, const std::string& out, const Common& common) {
  if (arguments.modulation_frequency.find(',') != std::string::npos)
    throw config::ConfigurationError(fmt::format(
        "--modulation-frequency: error: '{}': one frequency is stated\n  lengths decoded from several frequencies: "
        "their greatest common divisor, e.g. '20 MHz' of 20 MHz and 100 MHz, or leave it out\n  raw images of several "
        "frequencies: exposures in the profile, e.g. [{{phase: 0 deg, frequency: 20 MHz}}, ..]",
        arguments.modulation_frequency));
  try {
    return run_once(reading_pipeline(arguments, out), arguments.run, common);
  } catch (const config::ConfigurationError& error) {
    if (error.mistakes().empty()) throw;
    config::Diagnostics shown;
    for (const config::Diagnostic& mistake : error.mistakes()) {
      std::string message = mistake.message;
      for (const std::string_view stage : {"file_reader", "capture_writer"}) {
        const std::string node = fmt::format("node '{0}' ({0}), parameter '", stage);
        if (message.starts_with(node)) message.erase(0, message.find("': ", node.size()) + 3);
      }
      const bool names_file = message.starts_with('/');
      const config::Position at = names_file && mistake.at.line == 0 ? config::Position{} : mistake.at;
      const bool is_error = mistake.severity == config::Severity::error;
      is_error ? shown.error(at, message, mistake.hint) : shown.warning(at, message, mistake.hint);
    }
    throw config::ConfigurationError(shown);
  }
}

void ReadingArguments::add_to(CLI::App& command) {
  command.add_option("--camera", run.camera, "A profile by name or path; default: that of the file or the layout")
      ->option_text("CAMERA");
  command.add_option("--layout", layout, "A layout file, which describes each array")->option_text("FILE");
  command
      .add_option("--as", as,
                  "The channel of the array: depth, range, distance, amplitude, intensity, phases, taps, points, "
                  "sigma; CHANNEL=ARRAY,.. for several arrays")
      ->option_text("CHANNEL");
  command.add_option("--unit", unit, "Unit of lengths: the length that a value of 1 stands for, e.g. mm or '0.25 mm'")
      ->option_text("UNIT");
  command.add_option("--axes", axes, "Axes of the array, slowest first, e.g. 'frame row column'")->option_text("AXES");
  command
      .add_option("--invalid", invalid,
                  "Values that mean no measurement; they apply to the lengths if there are any, e.g. 0,65535")
      ->option_text("VALUES");
  command.add_option("--integration-time", integration_time, "Integration time of every frame, e.g. '1 ms'")
      ->option_text("TIME");
  command
      .add_option("--modulation-frequency", modulation_frequency,
                  "Modulation frequency of every frame; default: the profile's")
      ->option_text("FREQUENCY");
  command.add_option("--frame-rate", frame_rate, "Frame rate from which the time stamps follow, e.g. '30 Hz'")
      ->option_text("RATE");
}

std::string ReadingArguments::value_option() const {
  const std::pair<const char*, const std::string*> options[] = {{"--as", &as},
                                                                {"--unit", &unit},
                                                                {"--axes", &axes},
                                                                {"--invalid", &invalid},
                                                                {"--integration-time", &integration_time},
                                                                {"--modulation-frequency", &modulation_frequency},
                                                                {"--frame-rate", &frame_rate}};
  for (const auto& [option, value] : options)
    if (!value->empty()) return option;
  return {};
}

namespace {

/// Options of the command.
struct ConvertArguments {
  ReadingArguments reading;
  std::string out, depth_mode;
  bool inspect = false;
};

/// Converts another program's camera file to a profile.
int convert_camera(const ConvertArguments& arguments, const Common& common) {
  const ReadingArguments& reading = arguments.reading;
  if (reading.files.size() != 1)
    throw config::ConfigurationError(
        "error: a profile is made of one camera file\n  example: tofgraph convert "
        "camera_info.yaml -o my_camera.yaml");
  const std::string ignored = !reading.layout.empty()       ? "--layout"
                              : !reading.run.camera.empty() ? "--camera"
                                                            : reading.value_option();
  if (!ignored.empty())
    throw config::ConfigurationError(
        fmt::format("{}: error: is for images; --out {} makes a profile of a camera file", ignored, arguments.out));
  const std::filesystem::path input = reading.files.front();
  if (const std::string problem = io::input_problem(std::filesystem::path(arguments.out), std::span(&input, 1));
      !problem.empty())
    throw config::ConfigurationError("--out: error: " + problem);
  if (std::filesystem::exists(arguments.out) && !arguments.reading.run.force)
    throw config::ConfigurationError(
        fmt::format("error: {} exists: choose another name, or use --force", arguments.out));
  const std::string profile = io::profile_of_vendor_file(arguments.reading.files.front(), arguments.depth_mode);
  config::Diagnostics diagnostics;
  const io::CameraPtr camera = io::read_profile(config::parse_document(arguments.out, profile), diagnostics);
  if (!camera) throw config::ConfigurationError(diagnostics);
  io::write_file(arguments.out, profile);
  if (common.quiet) return done;
  std::size_t without = 0;
  const tofgraph_camera& view = camera->view();
  for (std::size_t i = 0; i < std::size_t{view.width} * view.height; ++i)
    without += std::isnan(view.rays[3 * i]) ? 1 : 0;
  print_message(fmt::format("wrote {}: {} x {} px{}", arguments.out, view.width, view.height,
                            without == 0 ? ""
                                         : fmt::format("; {} have no ray: the lens model cannot be inverted there",
                                                       config::counted(without, "pixel"))));
  return done;
}

int convert(const ConvertArguments& arguments, const Common& common) {
  if (arguments.inspect) {
    const std::string ignored = !arguments.out.empty() ? "--out" : arguments.reading.value_option();
    if (!ignored.empty())
      throw config::ConfigurationError(
          fmt::format("{}: error: --inspect shows the values as they are stored and writes nothing: remove one of the "
                      "two",
                      ignored));
    const InspectFileArguments inspect{arguments.reading.files, arguments.reading.layout, common.plugin_folders};
    return run_module("convert", &inspect);
  }
  if (arguments.out.empty())
    throw config::ConfigurationError(
        "--out is missing: the capture to be written\n  example: tofgraph convert depth.npy -o depth.h5 --camera "
        "./my_camera.yaml --as depth --unit mm");
  if (arguments.out.ends_with(".yaml") || arguments.out.ends_with(".yml")) return convert_camera(arguments, common);
  if (!arguments.depth_mode.empty())
    throw config::ConfigurationError("--depth-mode: error: is for camera files, with --out PROFILE.yaml");
  return run_reading(arguments.reading, arguments.out, common);
}

}  // namespace

void add_convert(CLI::App& app, Common& common) {
  auto a = std::make_shared<ConvertArguments>();
  CLI::App* command = app.add_subcommand("convert", "Convert files of other programs to a capture");
  command->footer(
      "Examples: tofgraph convert --inspect recording.npz\n"
      "          tofgraph convert recording.npz -o recording.h5 --camera ./my_camera.yaml --as depth=z --unit mm\n"
      "          tofgraph convert depth_*.png -o depth.h5 --camera ./my_camera.yaml --as depth --unit mm --invalid 0\n"
      "          tofgraph convert camera_info.yaml -o my_camera.yaml    a camera file of ROS, OpenCV, librealsense, "
      "Azure\n"
      "                                                                 Kinect or mrcal as a profile\n"
      "Formats: tofgraph list formats");
  command->add_option("IN", a->reading.files, "One file, or the files of a series, one per frame")->required();
  command->add_option("-o,--out", a->out, "The capture (.h5), or a profile (.yaml) of a camera file")
      ->option_text("FILE");
  command->add_flag("--inspect", a->inspect, "Show the contents and a layout to start from; writes nothing");
  a->reading.add_to(*command);
  command
      ->add_option("--depth-mode", a->depth_mode,
                   "Depth mode, for the camera file of an Azure Kinect: nfov, nfov_binned, wfov or wfov_binned")
      ->option_text("MODE");
  command->add_flag("--force", a->reading.run.force, "Replace an existing capture");
  command->callback([a, &common] { common.command = [a, &common] { return convert(*a, common); }; });
}

}  // namespace tofgraph::cli
