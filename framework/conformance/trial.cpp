// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "conformance/trial.hpp"

#include "config/document.hpp"
#include "config/paths.hpp"
#include "conformance/values.hpp"
#include "graph/validation.hpp"
#include "io/profile.hpp"

#include <tofgraph/array.hpp>
#include <tofgraph/channels.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace tofgraph::conformance {
namespace {

using namespace graph;

/// Text after "e.g. " in a parameter's description.
std::string example_in(std::string_view text) {
  const auto start = text.find("e.g. ");
  if (start == std::string_view::npos) return {};
  const std::string_view rest = text.substr(start + 5);
  return std::string(rest.substr(0, rest.find_first_of(";,)")));
}

std::string required_value(const tofgraph_parameter& p, const Subject& subject) {
  std::string example = example_in(p.text);
  switch (p.kind) {
    case TOFGRAPH_KIND_OUTPUT_FILE:
    case TOFGRAPH_KIND_FRAME_FILES:
      return (subject.scratch / std::filesystem::path(example.empty() ? "made.out" : example).filename()).string();
    case TOFGRAPH_KIND_CHOICE:
      return split_words(p.choices).front();
    case TOFGRAPH_KIND_BOOL:
      return "true";
    default:
      if (!example.empty()) return example;
      throw NotApplicable(
          fmt::format("needs a value for '{}', and its text shows no example: --set {}=VALUE", p.name, p.name));
  }
}

std::uint64_t extent_of(std::string_view word, std::uint32_t rows, std::uint32_t columns) {
  if (word == "H") return rows;
  if (word == "W") return columns;
  if (word == "P") return 4;
  return word == "N" ? columns : std::stoull(std::string(word));
}

/// @throws Refusal, Violation with the first error, if any @param defect of the plugin
void check(const config::Diagnostics& diagnostics, bool defect = false) {
  for (const config::Diagnostic& d : diagnostics.all())
    if (!diagnostics.ok()) refuse(d.hint.empty() ? d.message : d.message + "\n" + d.hint, defect);
}

}  // namespace

void refuse(const std::string& text, bool defect) {
  if (defect) throw Violation(text);
  throw Refusal(text);
}

Settings settings_of(const Subject& subject, const Settings& given) {
  Settings settings = given;
  for (const std::string& setting : subject.settings) {
    const auto equals = setting.find('=');
    settings.emplace(setting.substr(0, equals), setting.substr(equals + 1));  // does not replace a value under test
  }
  for (const tofgraph_parameter& p : subject.plugin().own_parameters) {
    if ((p.flags & TOFGRAPH_PARAMETER_REQUIRED) != 0 && !settings.contains(p.name))
      settings[p.name] = required_value(p, subject);
  }
  return settings;
}

ParameterValues values_of(const Plugin& plugin, const Settings& settings) {
  config::Diagnostics diagnostics;
  std::string text;
  for (const auto& [name, value] : settings) text += fmt::format("{}: {}\n", name, value);
  const config::Value document = config::parse_document("check", text);
  std::vector<const config::Entry*> entries;
  for (const config::Entry& entry : document.entries) entries.push_back(&entry);
  ParameterValues values(plugin, entries, document.at, diagnostics);
  check(diagnostics);
  return values;
}

io::CameraPtr camera_of(std::uint32_t rows, std::uint32_t columns) {
  config::Diagnostics diagnostics;
  const std::string text = fmt::format(
      "profile: 1\nname: checked\nwidth: {}\nheight: {}\npixel_pitch: 40 um\nfocal_length: 12.8 mm\n"
      "principal_point: [{}, {}]\nmodulation_frequency: 20 MHz\nsources:\n"
      "  - {{name: left, position: [-50 mm, 0 mm, 0 mm], amplitude: 1}}\n"
      "  - {{name: right, position: [50 mm, 0 mm, 0 mm], amplitude: 1}}\n"
      "integration_time: [0.5 ms, 50 ms]\nframe_rate: 80 Hz\ngain: 7.0e6 counts m^2/s\ncontrast: 0.5\n"
      "read_noise: 3 counts\nshot_noise: 0.012 counts\nfull_well: 30000 counts\n",
      columns, rows, (columns - 1) / 2.0, (rows - 1) / 2.0);
  io::CameraPtr camera = io::read_profile(config::parse_document("checked.yaml", text), diagnostics);
  if (!diagnostics.ok()) throw std::logic_error(diagnostics.text());
  return camera;
}

Trial::Trial(const Subject& subject, const Conditions& conditions) : Trial(subject, subject.plugin(), conditions) {}

Trial::Trial(const Subject& subject, const Plugin& plugin, const Conditions& conditions)
    : seed_(subject.seed), rows_(conditions.rows), columns_(conditions.columns) {
  host_.version = TOFGRAPH_VERSION;
  host_.overwrite = true;
  host_.plugin_path = config::joined_path(plugin_path({subject.path.parent_path()}));
  config::Diagnostics diagnostics;
  node_ = std::make_unique<Node>(0, plugin.name, config::Position{}, plugin,
                                 values_of(plugin, settings_of(subject, conditions.settings)), host_);
  node_->set_overwrite(true);
  if (conditions.watched) node_->set_validating();
  if (!node_->create(diagnostics)) check(diagnostics, node_->has_defect());
  if (conditions.sizes_known) input_.camera = camera_of(rows_, columns_);
  input_.known = UINT64_MAX;
  if (!node_->is_source()) add_channels(conditions);
  node_->set_provenance([] { return std::string("{}"); });
  prepare();
}

Trial::~Trial() = default;

void Trial::prepare() {
  config::Diagnostics diagnostics;
  if (!node_->prepare({&input_}, {"input"}, diagnostics)) check(diagnostics, node_->has_defect());
}

/// Adds the first channel of every port, and a camera's usual channels unless the stage computes them.
void Trial::add_channels(const Conditions& conditions) {
  for (const tofgraph_port& port : node_->stage().own_ports) {
    if (port.direction != TOFGRAPH_DIRECTION_OUT) add_channel(port, conditions);
  }
  constexpr tofgraph_port flags = {"flags", "flags", "H W", "", TOFGRAPH_TYPE_U16, TOFGRAPH_DIRECTION_IN, 0, 0, "", "",
                                   "",      "",      "",    ""};
  constexpr tofgraph_port depth = {"depth", "depth", "H W", "m", TOFGRAPH_TYPE_F32, TOFGRAPH_DIRECTION_IN, 0, 0, "", "",
                                   "",      "",      "",    ""};
  const auto is_made = [this](std::string_view name) {
    return std::ranges::any_of(node_->stage().own_ports, [&](const tofgraph_port& port) {
      return port.direction == TOFGRAPH_DIRECTION_OUT && port.channel == name;
    });
  };
  if (input_.channels.empty()) add_channel(depth, conditions);
  if (!is_made("flags")) add_channel(flags, conditions);
  if (!input_.camera || input_.find("rays") != nullptr) return;
  constexpr tofgraph_port rays = {"rays", "rays", "H W 3", "", TOFGRAPH_TYPE_F32, TOFGRAPH_DIRECTION_IN, 0, 0, "", "",
                                  "",     "",     "",      ""};
  add_channel(rays, conditions);
}

void Trial::add_channel(const tofgraph_port& port, const Conditions& conditions) {
  std::vector<std::string> channels = alternatives(port);
  const std::string chosen = node_->values().text_of("channel");
  if (channels.size() > 1 && std::ranges::find(channels, chosen) != channels.end()) channels = {chosen};
  if (channels.size() > 1) std::erase(channels, "distance");  // a half path for a length only if assumed
  const std::string& name = channels.front();
  // Taps and phases are two forms of the same data; one is enough.
  if (name == "*" || input_.find(name) != nullptr || (name == "phases" && input_.find("taps") != nullptr)) return;
  const ChannelInfo* known = known_channel(name);
  Channel channel;
  channel.name = name;
  channel.type = port.type != TOFGRAPH_TYPE_ANY                         ? port.type
                 : known != nullptr && known->type != TOFGRAPH_TYPE_ANY ? known->type
                                                                        : TOFGRAPH_TYPE_F32 + 0U;
  const std::string shape = *port.shape != 0 ? port.shape : known != nullptr ? known->shape : "H W";
  for (const std::string& word : split_words(shape)) {
    const bool fixed = std::isdigit(static_cast<unsigned char>(word.front())) != 0 || word == "P";
    channel.extent.at(channel.rank++) =
        conditions.sizes_known || fixed ? extent_of(word, rows_, columns_) : std::uint64_t{0};
  }
  channel.unit = *port.unit != 0 ? port.unit : known != nullptr ? known->unit : "";
  if (channel.unit.find('|') != std::string::npos) channel.unit.resize(channel.unit.find('|'));
  if (name == "sigma") channel.of = input_.channels.empty() ? "depth" : input_.channels.front().name;
  const std::vector<std::string> needs = split_words(port.needs);
  if (!needs.empty()) channel.applied = {needs.front()};
  channel.made_by = SIZE_MAX;
  input_.channels.push_back(std::move(channel));
}

tofgraph_frame Trial::frame(std::uint64_t number, Content content) {
  tofgraph_frame& frame = frames_[{number, content}];
  if (frame.pool == nullptr) {
    frame.pool = pool_.get();
    frame.metadata.size = sizeof frame.metadata;
    frame.metadata.number = frame.metadata.device_number = number;
    frame.metadata.timestamp_ns = 1'000'000'000 + static_cast<std::int64_t>(number) * 12'500'000;
    frame.metadata.integration_time = number % 2 == 0 ? 1e-3 : 4e-3;  // exposure bracketing uses several
    frame.metadata.modulation_frequency = 20e6;
    frame.metadata.temperature = 298;
    frame.metadata.time_since_power_on = 600;
    for (const Channel& channel : input_.channels) {
      tofgraph_frame::Channel& made = frame.slot(channel.name);
      made.unit = channel.unit;
      made.type = channel.type;
      made.rank = channel.rank;
      const std::vector<std::uint64_t> image = {rows_, columns_};
      std::size_t sizes = 0;  // unknown sizes are rows, then columns
      for (std::uint32_t i = 0; i < channel.rank; ++i)
        made.extent[i] = channel.extent.at(i) != 0 || sizes == 2 ? channel.extent.at(i) : image[sizes++];
      made.buffer = pool_->get(std::max<std::size_t>(channel_bytes(made.type, made.rank, made.extent), 1));
      fill(made, input_.camera, seed_ + number, content);
    }
  }
  return frame;  // NOLINT: shares the buffers
}

bool Trial::process(tofgraph_frame& frame) const {
  tofgraph_frame* frames[] = {&frame};
  try {
    return node_->process(frames, 1);
  } catch (const BrokenPromise&) {
    throw;
  } catch (const std::runtime_error& error) {
    refuse(error.what());
  }
}

void Trial::finish() const {
  try {
    node_->finish();
  } catch (const BrokenPromise&) {
    throw;
  } catch (const std::runtime_error& error) {
    refuse(error.what());
  }
}

std::size_t Trial::digest(const tofgraph_frame& frame) {
  std::size_t sum = 17;
  const auto add = [&sum](std::string_view bytes) {
    sum = sum * 1099511628211U + std::hash<std::string_view>()(bytes);
  };
  for (const tofgraph_frame::Channel& channel : frame.channels) {
    if (!channel.buffer) continue;
    add(channel.name);
    add({reinterpret_cast<const char*>(channel.extent), sizeof channel.extent});
    add({static_cast<const char*>(channel.buffer.data()), channel_bytes(channel.type, channel.rank, channel.extent)});
  }
  return sum;
}

std::vector<std::size_t> Trial::digests(std::uint64_t count, Content content) {
  std::vector<std::size_t> all;
  for (std::uint64_t i = 0; i < count; ++i) {
    tofgraph_frame one = frame(i, content);
    all.push_back(process(one) ? digest(one) : 0);
  }
  return all;
}

std::unique_ptr<Trial> ready(const Subject& subject, const Conditions& conditions) {
  try {
    return std::make_unique<Trial>(subject, conditions);
  } catch (const Refusal& refusal) {
    throw NotApplicable(refusal.what());
  }
}

}  // namespace tofgraph::conformance
