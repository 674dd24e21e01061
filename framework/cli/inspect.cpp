// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/inspect.hpp"

#include "cli/convert.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <unistd.h>
#include <array>
#include <fstream>

namespace tofgraph::cli {
namespace {

constexpr std::uint64_t max_frames = 32;  ///< for a file of another program

/// Temporary folder that exists as long as the object.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "tofgraph-inspect-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr)
      throw config::ConfigurationError(
          fmt::format("error: no folder can be made in {}", std::filesystem::temp_directory_path().string()));
    path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// True for files that begin with the HDF5 signature; MATLAB files have a header before it.
bool is_hdf5(const std::filesystem::path& file) {
  std::array<char, 4> head{};
  std::ifstream(file, std::ios::binary).read(head.data(), head.size());
  return std::string_view(head.data(), head.size()) == "\x89HDF";
}

/// @throws config::ConfigurationError if the page would replace a file that is read
void check_page(const ReadingArguments& reading, const std::filesystem::path& page) {
  if (page.empty()) return;
  std::vector<std::filesystem::path> inputs(reading.files.begin(), reading.files.end());
  inputs.emplace_back(reading.layout);
  inputs.emplace_back(reading.run.camera);
  if (const std::string problem = io::input_problem(page, inputs); !problem.empty())
    throw config::ConfigurationError("--out: error: " + problem);
}

int inspect(ReadingArguments reading, InspectArguments arguments, const Common& common) {
  check_page(reading, arguments.out);
  arguments.name = reading.files.size() == 1
                       ? reading.files.front()
                       : fmt::format("{} and {} more", reading.files.front(), reading.files.size() - 1);
  arguments.camera = reading.run.camera;
  arguments.capture = reading.files.front();
  // Another program's HDF5 file needs what it does not state; a capture states all of it.
  const bool is_stated = !reading.as.empty() || !reading.layout.empty();
  if (reading.files.size() == 1 && !is_stated && is_hdf5(arguments.capture)) {
    if (const std::string option = reading.value_option(); !option.empty())
      throw config::ConfigurationError(
          fmt::format("{}: error: a capture states this itself: remove it\n  a file of another program needs --as "
                      "CHANNEL=DATASET, or a layout, as well",
                      option));
    return run_module("inspect", &arguments);
  }
  const ScratchFolder scratch;
  arguments.layout = reading.layout;
  arguments.foreign = reading.files.front();
  arguments.capture = scratch.path() / "recording.h5";
  arguments.camera.clear();
  reading.run.frames = max_frames;
  Common silent = common;
  silent.quiet = true;
  const int code = run_reading(reading, arguments.capture.string(), silent);
  return code == done ? run_module("inspect", &arguments) : code;
}

}  // namespace

void add_inspect(CLI::App& app, Common& common) {
  auto reading = std::make_shared<ReadingArguments>();
  auto arguments = std::make_shared<InspectArguments>();
  CLI::App* command = app.add_subcommand("inspect", "Find the defects of a recording");
  command->footer(
      "Looks for planes (walls, floors, boards) and reports under which assumption they become flat: range or depth, "
      "lens,\n"
      "mirrored or turned images; for wrong units, swapped raw images, bad pixels, stripes. Each finding has the "
      "line\nthat fixes it; questions that the scene cannot answer are listed. The exit code is 0 whatever is found.\n"
      "Examples: tofgraph inspect capture.h5\n"
      "          tofgraph inspect capture.h5 --camera ./my_camera.yaml -o inspection.html\n"
      "          tofgraph inspect depth.npy --camera ./my_camera.yaml --as depth --unit mm");
  command->add_option("FILE", reading->files, "A capture (.h5), or files of another program, as for convert")
      ->required();
  command->add_option("-o,--out", arguments->out, "A page (HTML) with maps of the deviations")->option_text("FILE");
  command->add_flag("--json", arguments->json, "As JSON");
  command->add_flag("--force", arguments->force, "Replace an existing page");
  reading->add_to(*command);
  command->callback([reading, arguments, &common] {
    common.command = [reading, arguments, &common] { return inspect(*reading, *arguments, common); };
  });
}

}  // namespace tofgraph::cli
