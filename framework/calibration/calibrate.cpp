// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/calibrate.hpp"

#include "config/diagnostics.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace tofgraph::calibration {

Result calibrate_offset(const Request& request);            // offset.cpp
Result calibrate_integration_time(const Request& request);  // integration_time.cpp
Result calibrate_noise(const Request& request);             // noise.cpp
Result calibrate_warm_up(const Request& request);           // warm_up.cpp
Result calibrate_fixed_pattern(const Request& request);     // fixed_pattern.cpp
Result calibrate_intrinsics(const Request& request);        // intrinsics.cpp
Result calibrate_response(const Request& request);          // response.cpp

namespace {

constexpr Kind all[] = {
    {"intrinsics", "the lens, from views of a chessboard or another pattern: for the stage intrinsics",
     calibrate_intrinsics, "free without"},
    {"offset", "the offset by integration time and reflectivity: for the stage offset_correction", calibrate_offset,
     "variant"},
    {"integration-time", "the best integration time for each target and distance", calibrate_integration_time,
     "range accuracy"},
    {.name = "noise",
     .text = "read and shot noise of the taps, bad pixels: for sigma of the decoders and the stage mask",
     .calibrate = calibrate_noise,
     .writes_maps = true},
    {.name = "warm-up",
     .text = "drift since power-on, and the time until it settles",
     .calibrate = calibrate_warm_up,
     .options = "accuracy roi corrected-at",
     .writes_model = true},
    {.name = "fixed-pattern",
     .text = "an offset of each pixel, and its growth with the distance",
     .calibrate = calibrate_fixed_pattern,
     .writes_model = true,
     .writes_maps = true},
    {.name = "response",
     .text = "contrast, gain and dark level, and their maps over the pixels",
     .calibrate = calibrate_response,
     .writes_maps = true},
};

}  // namespace

std::span<const Kind> kinds() { return all; }

const Kind& kind_of(const std::string& name) {
  std::vector<std::string> names;
  for (const Kind& kind : all) {
    if (name == kind.name) return kind;
    names.emplace_back(kind.name);
  }
  std::string text = fmt::format("calibrate: error: '{}' cannot be calibrated", name);
  if (const std::string near = config::nearest(name, names); !near.empty())
    text += fmt::format("\n  did you mean '{}'?", near);
  text += "\n  what can be calibrated:";
  for (const Kind& kind : all) text += fmt::format("\n    {:<18}{}", kind.name, kind.text);
  throw config::ConfigurationError(text);
}

Result calibrate(const Kind& kind, const Request& request) {
  Result result = kind.calibrate(request);
  if (!result.held_out || !(result.held_out->after >= (1 + result.held_out->tolerance) * result.held_out->before))
    return result;
  const HeldOutErrors& errors = *result.held_out;
  const auto number = [&](double value) {
    return fmt::format("{:.2f}{}{}", value / errors.scale, errors.unit.empty() ? "" : " ", errors.unit);
  };
  const std::string problem = fmt::format(
      "the calibration does not improve held-out conditions: {} held out and predicted from the others, {} remain of "
      "{}",
      errors.left_out, number(errors.after), number(errors.before));
  if (!request.force)
    throw std::runtime_error(
        fmt::format("calibrate {}: {}; nothing was written\n  likely causes: {}{}\n  --force writes it anyway",
                    kind.name, problem, errors.causes, errors.used));
  result.notes.insert(result.notes.begin(), fmt::format("{}; likely causes: {}", problem, errors.causes));
  return result;
}

std::filesystem::path report_of(const std::filesystem::path& calibration) {
  return std::filesystem::path(calibration).replace_extension(".html");
}
std::filesystem::path model_of(const std::filesystem::path& calibration) {
  return std::filesystem::path(calibration).replace_extension(".model.yaml");
}
std::filesystem::path maps_of(const std::filesystem::path& calibration) {
  return std::filesystem::path(calibration).replace_extension(".maps.h5");
}

std::vector<std::filesystem::path> outputs_of(const Kind& kind, const std::filesystem::path& calibration) {
  std::vector<std::filesystem::path> files = {report_of(calibration)};
  if (kind.writes_maps) files.push_back(maps_of(calibration));
  if (kind.writes_model) files.push_back(model_of(calibration));
  files.push_back(calibration);
  return files;
}

void write(const Result& result, const Kind& kind, const std::filesystem::path& calibration) {
  report::Page page = result.page;
  if (!result.notes.empty()) page.heading("Notes");
  for (const std::string& note : result.notes) page.paragraph(note);
  page.write(report_of(calibration));
  if (kind.writes_maps) {
    io::OutputFile file(maps_of(calibration));
    io::write_pixel_maps(file.temporary_path().string(), result.maps, result.map_rows, result.map_columns);
    file.commit();
  }
  if (kind.writes_model) io::write_file(model_of(calibration), result.model);
  io::write_file(calibration, result.file);
}

}  // namespace tofgraph::calibration
