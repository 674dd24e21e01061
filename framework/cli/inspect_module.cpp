// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/inspect.hpp"
#include "config/diagnostics.hpp"
#include "config/document.hpp"
#include "config/json_text.hpp"
#include "config/log.hpp"
#include "foreign/header_check.hpp"
#include "foreign/series.hpp"
#include "inspection/inspection.hpp"
#include "io/captures/capture.hpp"
#include "io/profile.hpp"
#include "io/unknown.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tofgraph::cli {
namespace {

/// Camera given by the user, else of the capture's profile, else of its name.
io::CameraPtr camera_of(const InspectArguments& arguments, const io::CaptureHeader& header) {
  const auto load = [](const std::string& name) {
    const auto file = io::find_profile(name, ".");
    return file.empty() ? nullptr : io::load_profile(file);
  };
  if (!arguments.camera.empty()) {
    auto camera = load(arguments.camera);
    if (!camera)
      throw config::ConfigurationError(fmt::format(
          "--camera: error: there is no profile '{}'\n  example: --camera ./my_camera.yaml, or one of tofgraph list "
          "cameras",
          arguments.camera));
    return camera;
  }
  config::Diagnostics diagnostics;
  io::CameraPtr camera = header.profile.empty()
                             ? load(header.camera)
                             : io::read_profile(config::parse_document("profile", header.profile), diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  if (!camera)
    throw config::ConfigurationError(
        fmt::format("{}: error: the capture has no profile of its camera '{}'\n  name it: --camera ./my_camera.yaml",
                    arguments.name, header.camera));
  return camera;
}

/// Doubt about the headers of a file that a layout describes.
std::optional<foreign::HeaderDoubt> header_doubt_of(const InspectArguments& arguments) {
  if (arguments.layout.empty()) return std::nullopt;
  const foreign::Layout layout = foreign::read_layout(arguments.layout);
  if (layout.headerless.empty()) return std::nullopt;
  try {
    const std::vector<std::filesystem::path> files = foreign::files_of(arguments.foreign.string());
    return foreign::header_doubt(files.front(), layout);
  } catch (const std::runtime_error& error) {
    throw config::ConfigurationError(fmt::format("{}: error: the file {}", arguments.name, error.what()));
  }
}

/// Images that begin at a wrong byte make every other finding meaningless.
void add_header_doubt(const foreign::HeaderDoubt& doubt, inspection::Inspection& result) {
  if (doubt.mend.empty()) return result.undecided.push_back(doubt.text + ": " + doubt.evidence);
  result.findings = {{"headers", doubt.text, doubt.evidence, doubt.mend, io::unknown, io::unknown}};
  result.undecided = {"everything else, until the layout of the file is corrected"};
}

int inspect(const InspectArguments& arguments) {
  if (!arguments.out.empty() && std::filesystem::exists(arguments.out) && !arguments.force)
    throw config::ConfigurationError(
        fmt::format("error: {} exists: choose another name, or use --force", arguments.out.string()));
  std::optional<io::CaptureReader> capture;
  try {
    capture.emplace(arguments.capture);
  } catch (const std::runtime_error& error) {
    throw config::ConfigurationError(fmt::format("error: {}", error.what()));
  }
  if (capture->frames() == 0)
    throw config::ConfigurationError(fmt::format("{}: error: there are no frames", arguments.name));
  const io::CameraPtr camera = camera_of(arguments, capture->header());
  const std::optional<foreign::HeaderDoubt> doubt = header_doubt_of(arguments);
  std::optional<inspection::Inspection> result;
  try {
    result.emplace(inspection::inspect(*capture, camera, arguments.name));
  } catch (const std::runtime_error& error) {
    throw config::ConfigurationError(fmt::format("{}: error: the recording {}{}", arguments.name, error.what(),
                                                 doubt ? fmt::format("\n  {}: {}", doubt->text, doubt->mend) : ""));
  }
  if (doubt) add_header_doubt(*doubt, *result);
  if (arguments.json)
    fmt::print("{}\n", config::json_text(inspection::json_of(*result), 2));
  else
    fmt::print("{}", inspection::text_of(*result));
  if (!arguments.out.empty()) inspection::write_page(*result, arguments.out);
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::inspect(*static_cast<const tofgraph::cli::InspectArguments*>(arguments));
}
