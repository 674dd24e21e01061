// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/info.hpp"
#include "config/diagnostics.hpp"
#include "config/document.hpp"
#include "config/json_text.hpp"
#include "config/log.hpp"
#include "config/quantity.hpp"
#include "io/captures/capture.hpp"
#include "io/captures/plausibility.hpp"
#include "io/captures/repair.hpp"
#include "io/profile.hpp"

#include <tofgraph/array.hpp>
#include <tofgraph/physics/exposures.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::cli {
namespace {

using nlohmann::json;

constexpr std::size_t max_gaps = 10;  // maximum number listed

/// Camera from the profile in the capture, else from the profile of the camera's name; null if neither can be
/// read.
io::CameraPtr camera_of(const io::CaptureHeader& header) {
  config::Diagnostics diagnostics;
  try {
    const auto file = io::find_profile(header.camera, {});
    if (!header.profile.empty())
      return io::read_profile(config::parse_document("profile", header.profile), diagnostics);
    return file.empty() ? nullptr : io::load_profile(file);
  } catch (const config::ConfigurationError&) {
    return nullptr;
  }
}

/// Exposures of the capture, else of the camera's profile, else the standard four.
physics::Exposures exposures_of(const io::CaptureHeader& header, const io::CameraPtr& camera, std::string& from) {
  from = "the capture";
  if (!header.exposures.empty()) return header.exposures;
  from = camera && camera->view().exposure_count != 0 ? "the profile" : "the default";
  return camera ? physics::exposures_of(camera->view()) : physics::exposures_of(tofgraph_camera{});
}

/// Minimum and maximum of a number in the metadata, if every frame has it.
void add_range(json& settings, const io::CaptureReader& reader, std::uint64_t bit, const char* name,
               double tofgraph_metadata::*value) {
  const std::size_t last = reader.frames() - 1;
  if ((reader.known(0, last) & bit) == 0) return;
  double least = reader.metadata(0).*value, greatest = least;
  for (std::size_t i = 1; i <= last; ++i) {
    least = std::min(least, reader.metadata(i).*value);
    greatest = std::max(greatest, reader.metadata(i).*value);
  }
  settings[name] = {least, greatest};
}

json described(const io::CaptureReader& reader) {
  const io::CaptureHeader& header = reader.header();
  const io::CameraPtr camera = camera_of(header);
  json result = {{"format", "tofgraph-info"},     {"version", 1},
                 {"camera", header.camera},       {"width", header.width},
                 {"height", header.height},       {"frames", reader.frames()},
                 {"finished", reader.finished()}, {"comment", header.comment},
                 {"serial", header.serial},       {"sources", fmt::format("{}", fmt::join(header.sources, ", "))}};
  for (const io::CaptureChannel& channel : reader.channels()) {
    result["channels"].push_back({{"name", channel.name},
                                  {"type", element_name(channel.type)},
                                  {"extent", channel.extent},
                                  {"unit", channel.unit},
                                  {"applied", channel.applied}});
    const bool raw = channel.name == "taps" || channel.name == "phases";
    if (!raw || result.contains("exposures")) continue;
    std::string from;
    const physics::Exposures exposures = exposures_of(header, camera, from);
    json list = json::array();
    for (const tofgraph_exposure& e : exposures)
      list.push_back({{"phase_rad", e.phase}, {"frequency_hz", e.frequency}});
    result["exposures"] = {
        {"from", from}, {"text", physics::exposures_text(exposures)}, {"images", channel.extent[0]}, {"list", list}};
  }
  result["ignored"] = reader.ignored();
  json settings = json::object();
  add_range(settings, reader, TOFGRAPH_KNOWS_INTEGRATION_TIME, "integration_time_s",
            &tofgraph_metadata::integration_time);
  add_range(settings, reader, TOFGRAPH_KNOWS_MODULATION_FREQUENCY, "modulation_frequency_hz",
            &tofgraph_metadata::modulation_frequency);
  add_range(settings, reader, TOFGRAPH_KNOWS_TEMPERATURE, "temperature_k", &tofgraph_metadata::temperature);
  add_range(settings, reader, TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON, "time_since_power_on_s",
            &tofgraph_metadata::time_since_power_on);
  result["settings"] = settings;
  json gaps = json::array();
  std::size_t lost = 0;
  for (std::size_t i = 1; i < reader.frames(); ++i) {
    const std::uint64_t before = reader.metadata(i - 1).device_number, now = reader.metadata(i).device_number;
    const std::size_t between = io::frames_between(before, now);
    if (now != before + 1) gaps.push_back({{"after_frame", i - 1}, {"lost", between}, {"back", now <= before}});
    lost += between;
  }
  result["gaps"] = gaps;
  result["lost"] = lost;
  result["numbered"] = reader.has_frame_numbers();
  result["counter"] = lost > 0 || reader.metadata(0).device_number != 0;  // of the camera, not of the program
  if ((reader.known(0, reader.frames() - 1) & TOFGRAPH_KNOWS_TIMESTAMP) != 0) {
    const auto first = reader.metadata(0).timestamp_ns, last = reader.metadata(reader.frames() - 1).timestamp_ns;
    if (last >= first) result["duration_s"] = static_cast<double>(last - first) * 1e-9;
  }
  result["warnings"] = io::doubts_of(reader, 0, reader.frames() - 1, camera ? &camera->view() : nullptr);
  return result;
}

void print_setting(const json& settings, const char* key, const char* name, const char* unit) {
  if (!settings.contains(key)) return;
  const double least = settings[key][0], greatest = settings[key][1];
  fmt::print("  {:22} {}{}\n", name, config::format_quantity(least, unit),
             least == greatest ? "" : " to " + config::format_quantity(greatest, unit));
}

void print_exposures(const json& exposures) {
  fmt::print("\na frame: {} (by {})\n", exposures["text"].get<std::string>(), exposures["from"].get<std::string>());
  if (exposures["images"].get<std::uint64_t>() != exposures["list"].size())
    fmt::print("         but it holds {} images: give a profile with their exposures\n",
               exposures["images"].get<std::uint64_t>());
}

void print_gaps(const json& info) {
  const json& gaps = info["gaps"];
  if (gaps.empty())
    return fmt::print("\n{}\n", !info["numbered"].get<bool>()
                                    ? "no frame numbers were recorded: lost frames are unknown"
                                : info["counter"].get<bool>()
                                    ? "no frame is missing"
                                    : "no gap in the frame numbers; they begin at 0, perhaps counted by the program "
                                      "that recorded: lost frames are then unknown");
  const auto lost = info["lost"].get<std::uint64_t>();
  fmt::print("\n{} missing, by frame_number, in {}\n", config::counted(lost, "frame"),
             config::counted(gaps.size(), "place"));
  for (std::size_t i = 0; i < gaps.size() && i < max_gaps; ++i)
    fmt::print("after frame {}: {}\n", gaps[i]["after_frame"].get<std::size_t>(),
               gaps[i]["back"].get<bool>() ? "the counter went back"
                                           : fmt::format("{} lost", gaps[i]["lost"].get<std::uint64_t>()));
  if (gaps.size() > max_gaps) fmt::print("and {} more places (--json lists all)\n", gaps.size() - max_gaps);
}

void print(const std::string& file, const json& info) {
  fmt::print("{}: camera {}, {} x {} px, {} frame{}{}\n", file, info["camera"].get<std::string>(),
             info["width"].get<int>(), info["height"].get<int>(), info["frames"].get<std::size_t>(),
             info["frames"] == 1 ? "" : "s", info["finished"].get<bool>() ? "" : ": still being recorded, or cut off");
  if (!info["finished"].get<bool>()) fmt::print("tofgraph repair {} makes a capture of its complete frames\n", file);
  for (const char* key : {"comment", "serial", "sources"})
    if (!info[key].get<std::string>().empty()) fmt::print("{}: {}\n", key, info[key].get<std::string>());
  fmt::print("\nchannels\n");
  for (const json& channel : info["channels"]) {
    const auto applied = channel["applied"].get<std::string>(), unit = channel["unit"].get<std::string>();
    fmt::print("  {:22} {} {}{}{}\n", channel["name"].get<std::string>(), channel["type"].get<std::string>(),
               fmt::join(channel["extent"].get<std::vector<std::uint64_t>>(), " x "), unit.empty() ? "" : ", " + unit,
               applied.empty() ? "" : "; applied so far: " + applied);
  }
  for (const json& name : info["ignored"]) fmt::print("  {:22} no channel\n", name.get<std::string>());
  if (info.contains("exposures")) print_exposures(info["exposures"]);
  if (!info["settings"].empty() || info.contains("duration_s")) fmt::print("\nsettings\n");
  print_setting(info["settings"], "integration_time_s", "integration time", "s");
  const bool own = info.contains("exposures") && info["exposures"]["list"][0]["frequency_hz"] > 0;
  if (!own) print_setting(info["settings"], "modulation_frequency_hz", "modulation frequency", "Hz");
  print_setting(info["settings"], "temperature_k", "temperature", "K");
  print_setting(info["settings"], "time_since_power_on_s", "time since power on", "s");
  if (info.contains("duration_s")) fmt::print("  {:22} {:.6g} s\n", "duration", info["duration_s"].get<double>());
  print_gaps(info);
  for (const json& warning : info["warnings"]) fmt::print("\nwarning: {}\n", warning.get<std::string>());
}

int info(const InfoArguments& arguments) {
  json result;
  try {
    result = described(io::CaptureReader(arguments.capture));
  } catch (const std::runtime_error& problem) {
    const std::string file = arguments.capture.string() + ": ", text = problem.what();
    throw config::ConfigurationError(file + "error: " + (text.starts_with(file) ? text.substr(file.size()) : text));
  }
  if (arguments.json)
    fmt::print("{}\n", config::json_text(result, 2));
  else
    print(arguments.capture.string(), result);
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::info(*static_cast<const tofgraph::cli::InfoArguments*>(arguments));
}
