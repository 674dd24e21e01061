// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/truth.hpp"

#include "io/profile.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <fstream>
#include <iterator>
#include <stdexcept>

namespace tofgraph::hidden {
namespace {

void write_whole(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  if (!out.flush()) throw std::runtime_error(fmt::format("{} cannot be written", file.string()));
}

std::string clutter_text(const Clutter& clutter, const std::vector<io::Condition>& conditions,
                         const DrawnClutter& drawn) {
  std::string text = fmt::format("clutter: {{warp: {}, residue: {}, misplaced: {}, sessions: {}}}\n", clutter.warp,
                                 clutter.residue, clutter.misplaced, clutter.sessions);
  if (clutter.misplaced != 0)
    text += fmt::format("misplaced: {{id: {}, by: {}}}\n", conditions[drawn.misplaced].id, clutter.misplaced);
  if (drawn.sessions.empty()) return text;
  text += "sessions:\n";
  for (const DrawnClutter::Session& session : drawn.sessions)
    text += fmt::format("  - {{offset: {}, light: {}}}\n", session.offset, session.light);
  return text;
}

}  // namespace

const char* name_of(NoiseKind noise) {
  switch (noise) {
    case NoiseKind::none:
      return "none";
    case NoiseKind::gaussian:
      return "gaussian";
    case NoiseKind::heavy:
      return "heavy";
    case NoiseKind::drift:
      return "drift";
  }
  return "";
}

const char* name_of(Light light) { return light == Light::reference ? "reference" : "physical"; }

const char* name_of(Output output) {
  return output == Output::taps ? "taps" : output == Output::phases ? "phases" : "distances";
}

const char* name_of(Order order) {
  return order == Order::shuffled ? "shuffled" : order == Order::designed ? "designed" : "unstated";
}

const std::map<std::string, Order>& order_names() {
  static const std::map<std::string, Order> names = {
      {"shuffled", Order::shuffled}, {"designed", Order::designed}, {"unstated", Order::unstated}};
  return names;
}

const std::map<std::string, Output>& output_names() {
  static const std::map<std::string, Output> names = [] {
    std::map<std::string, Output> all;
    for (const Output output : {Output::taps, Output::phases, Output::distances}) all[name_of(output)] = output;
    return all;
  }();
  return names;
}

void write_model(const std::filesystem::path& file, const CampaignOptions& options) {
  write_whole(file, fmt::format("model: 1\ncamera: camcube2\nlight: {}\neffects: []\n", name_of(options.light)));
}

void write_camera(const std::filesystem::path& file, const Camera& camera) {
  const std::filesystem::path nominal = io::find_profile("camcube2", {});
  std::ifstream in(nominal);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (text.empty()) throw std::runtime_error("the profile camcube2 is not there");
  text += "exposures:\n";
  for (const double step : camera.steps) text += fmt::format("  - {{phase: {} rad}}\n", step);
  write_whole(file, text);
}

void write_truth(const std::filesystem::path& file, const CampaignOptions& options, const Physics& physics,
                 const std::vector<io::Condition>& conditions, const std::vector<View>& views,
                 const DrawnClutter& clutter) {
  std::string text = fmt::format(
      "# What was hidden; numbers in SI.\ntruth: 1\ndesign: {}\nexperiments: [{}]\nseed: {}\nrig_seed: {}\nlight: "
      "{}\nnoise: {}\n"
      "jitter: {}\nlight_jitter: {}\norder: {}\nframes: {}\noutput: {}\nsteps: [{}]\n"
      "camera: {{gain: {}, read_noise: {}, shot_noise: {}}}\n",
      options.design, fmt::join(options.experiments, ", "), options.seed, options.rig_seed(), name_of(options.light),
      name_of(options.noise), options.jitter, options.light_jitter, name_of(options.order), options.frames,
      name_of(options.output), fmt::join(physics.camera.steps, ", "), physics.camera.gain, physics.camera.read_noise,
      physics.camera.shot_noise);
  text += options.effects.all().empty() ? "effects: []\n" : "effects:\n";
  for (const auto& [name, values] : options.effects.all()) {
    text += fmt::format("  - {{effect: {}", name);
    for (const auto& [key, value] : values)
      text += std::isinf(value) ? fmt::format(", {}: .inf", key) : fmt::format(", {}: {}", key, value);
    text += "}\n";
  }
  text += options.patterns.empty() ? "patterns: []\n" : "patterns:\n";
  for (const Pattern& pattern : options.patterns)
    text += fmt::format("  - {{pattern: {}, size: {}}}\n", pattern.name, pattern.size);
  text += clutter_text(options.clutter, conditions, clutter);
  text += "conditions:\n";
  for (std::size_t i = 0; i < views.size(); ++i)
    text += fmt::format(
        "  - {{id: {}, order: {}, distance: {}, reflectivity: {}, drift_distance: {}, drift_amplitude: {}{}}}\n",
        conditions[i].id, views[i].order, views[i].distance, views[i].reflectivity, views[i].drift_distance,
        views[i].drift_amplitude,
        clutter.sessions.empty()
            ? ""
            : fmt::format(", session: {}", session_of(views[i].order, views.size(), clutter.sessions.size())));
  write_whole(file, text);
}

}  // namespace tofgraph::hidden
