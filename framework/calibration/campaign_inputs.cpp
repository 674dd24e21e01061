// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/campaign_inputs.hpp"

#include "calibration/camera_identity.hpp"
#include "config/quantity.hpp"
#include "io/captures/capture.hpp"
#include "io/sha256.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace tofgraph::calibration {
namespace {

/// The table, or the captures, each once.
std::vector<std::filesystem::path> data_files(const io::Campaign& campaign) {
  std::vector<std::filesystem::path> files;
  for (const io::Condition& c : campaign.conditions) {
    const std::filesystem::path file = campaign.from_table ? std::filesystem::path(c.at.source->name) : c.capture;
    if (std::ranges::find(files, file) == files.end()) files.push_back(file);
  }
  return files;
}

/// Stages applied to the distances of the first capture, as a list; empty: none or unknown.
std::string applied_to(const io::Campaign& campaign) {
  if (campaign.from_table || campaign.conditions.empty()) return {};
  try {
    const io::CaptureReader capture(campaign.conditions.front().capture);
    const auto distance = std::ranges::find(capture.channels(), "distance", &io::CaptureChannel::name);
    if (distance == capture.channels().end() || distance->applied.empty()) return {};
    std::string words = distance->applied;
    for (std::size_t at = 0; (at = words.find(' ', at)) != std::string::npos; at += 2) words.replace(at, 1, ", ");
    return fmt::format("[{}]", words);
  } catch (const std::runtime_error&) {
    return {};  // reported when the captures are read
  }
}

std::string span_of(const std::set<double>& values, const char* what, const char* unit) {
  const auto text = [unit](double value) { return config::format_quantity(value, unit); };
  if (values.size() == 1) return fmt::format("1 {} ({})", what, text(*values.begin()));
  return fmt::format("{} {}s from {} to {}", values.size(), what, text(*values.begin()), text(*values.rbegin()));
}

}  // namespace

io::Campaign read_conditions(const Request& request) {
  config::Diagnostics diagnostics;
  io::Campaign campaign = io::read_campaign(request.campaign, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return campaign;
}

Campaign read(const Request& request) {
  Campaign campaign{read_conditions(request), {}};
  const auto progress = [&](double share) {
    if (request.progress) request.progress(0.9 * share, "reading the campaign");
  };
  try {
    campaign.boards = read_boards(campaign.conditions, request.variant, {.progress = progress});
  } catch (const std::invalid_argument& problem) {
    throw config::ConfigurationError(fmt::format("{}: error: {}", request.campaign.string(), problem.what()));
  }
  return campaign;
}

io::CalibrationWriter writer_for(const Request& request, const Campaign& campaign, const std::string& kind) {
  return writer_for(request, campaign.conditions, campaign.boards.serial, kind);
}

io::CalibrationWriter writer_for(const Request& request, const io::Campaign& campaign, const std::string& serial,
                                 const std::string& kind) {
  io::CalibrationWriter writer(request.output, kind, campaign.camera->view().name, serial);
  const std::vector<std::filesystem::path> files = data_files(campaign);
  std::vector<std::string> hashes(files.size());
  tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) { hashes[i] = io::sha256_of_file(files[i]); });
  writer.input(request.campaign);
  for (std::size_t i = 0; i < files.size(); ++i) writer.input(files[i], hashes[i]);
  if (const std::string applied = applied_to(campaign); !applied.empty()) writer.setting("applied", applied);
  return writer;
}

std::string model_head(const Request& request, const io::Campaign& campaign, const std::string& serial) {
  namespace fs = std::filesystem;
  std::string camera = campaign.camera->folder ? campaign.camera->view().name : campaign.camera_name;
  if (!campaign.camera->folder && camera.find_first_of("/.") != std::string::npos &&
      !campaign.camera->file.empty()) {  // relative to the campaign
    const fs::path folder = fs::absolute(request.output).parent_path();
    camera = fs::absolute(campaign.camera->file).lexically_normal().lexically_proximate(folder).string();
  }
  return fmt::format("model: 1\ncamera: {}\n{}", config::yaml_word(camera),
                     serial.empty() ? "" : fmt::format("serial: {}\n", config::yaml_word(serial)));
}

void refuse_corrected(const Request& request, const Boards& boards, const std::string& stage) {
  if (std::ranges::find(boards.applied, stage) == boards.applied.end()) return;
  throw config::ConfigurationError(
      fmt::format("{}: error: the boards were corrected already: the captures' distances have {} applied\n  give the "
                  "captures from before that stage",
                  request.campaign.string(), stage));
}

void refuse_duplicates(const io::Campaign& campaign) {
  config::Diagnostics diagnostics;
  std::map<std::filesystem::path, std::vector<const io::Condition*>> seen;
  constexpr std::array<std::uint64_t, 2> all = {0, std::numeric_limits<std::uint64_t>::max()};
  for (const io::Condition& c : campaign.conditions) {
    if (c.capture.empty()) continue;
    auto& others = seen[c.capture.lexically_normal()];
    for (const io::Condition* other : others) {
      const auto mine = c.frames.value_or(all), its = other->frames.value_or(all);
      if (mine[0] > its[1] || its[0] > mine[1]) continue;
      diagnostics.error(place_of(c),
                        fmt::format("the frames of {} are those of the condition '{}', line {}, too",
                                    c.capture.filename().string(), other->id, other->at.line),
                        "leave one out: the same frames twice would seem twice as certain");
      break;
    }
    others.push_back(&c);
  }
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
}

std::string described(const Boards& boards) {
  std::set<double> distances, times;
  for (const Board& b : boards.boards) {
    distances.insert(b.distance);
    times.insert(b.condition.integration_time);
  }
  return fmt::format("{} condition{}: {} target{}, {}, {}", boards.boards.size(), boards.boards.size() == 1 ? "" : "s",
                     boards.targets.size(), boards.targets.size() == 1 ? "" : "s", span_of(distances, "distance", "m"),
                     span_of(times, "integration time", "s"));
}

std::string used_of(const Boards& boards) {
  std::size_t frames = 0;
  for (const Board& b : boards.boards) frames += b.frames;
  std::string text =
      fmt::format("\n  used: {} of {} conditions", boards.boards.size() + boards.repeats, boards.conditions);
  if (frames > 0) text += fmt::format(", {} frames", frames);
  if (boards.unusable.pixels > 0)
    text += fmt::format(", {} of {} pixels in all", boards.unusable.pixels - boards.unusable.total(),
                        boards.unusable.pixels);
  if (boards.unusable.total() > 0) text += fmt::format("\n  pixels left out: {}", boards.unusable.described());
  for (const std::string& note : boards.notes) text += "\n  " + note;
  return text;
}

std::string sentence_of(const std::vector<std::string>& lines) {
  std::string sentence = fmt::format("{}.", fmt::join(lines, "; "));
  sentence.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence.front())));
  return sentence;
}

std::string name_of(const Boards& boards, std::size_t target) {
  return boards.targets[target].empty() ? "the board" : boards.targets[target];
}

io::Calibrated column_of(const Boards& boards, const std::function<double(const Board&)>& value) {
  io::Calibrated column;
  for (const Board& b : boards.boards) column.value.push_back(value(b));
  return column;
}

bool known(const io::Calibrated& column) {
  return !column.value.empty() && std::ranges::all_of(column.value, [](double v) { return std::isfinite(v); });
}

}  // namespace tofgraph::calibration
