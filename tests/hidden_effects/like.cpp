// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/like.hpp"

#include "config/diagnostics.hpp"
#include "config/document.hpp"
#include "tests/hidden_effects/designs.hpp"
#include "tests/hidden_effects/truth.hpp"

#include <fmt/format.h>

#include <array>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <stdexcept>

namespace tofgraph::hidden {
namespace {

/// Reads the output of write_truth().
class Truth {
 public:
  explicit Truth(const std::filesystem::path& file) : file_(file), document_(config::load_document(file)) {
    if (document_.find("truth") == nullptr)
      throw std::invalid_argument(fmt::format("{} is not the truth.yaml of a campaign", file.string()));
  }

  const config::Value& value(const config::Value& map, const std::string& key) const {
    if (const config::Entry* entry = map.find(key)) return entry->value;
    throw std::invalid_argument(
        fmt::format("{} has no '{}': it was written by an earlier state of this program", file_.string(), key));
  }
  const config::Value& operator[](const std::string& key) const { return value(document_, key); }
  const std::string& word(const std::string& key) const { return (*this)[key].text; }

  double number(const config::Value& map, const std::string& key) const {
    const std::string& text = value(map, key).text;
    return text == ".inf" ? std::numeric_limits<double>::infinity() : std::stod(text);
  }
  std::uint64_t whole(const std::string& key) const { return std::stoull(word(key)); }
  double number(const std::string& key) const { return number(document_, key); }

 private:
  const std::filesystem::path& file_;
  config::Value document_;
};

/// Selects a value by its name.
template <class Value, std::size_t count> Value named(const std::array<Value, count>& values, const std::string& name) {
  for (const Value value : values)
    if (name_of(value) == name) return value;
  throw std::invalid_argument(fmt::format("'{}' is not known", name));
}

void take_effects(const Truth& truth, CampaignOptions& options) {
  for (const config::Value& effect : truth["effects"].items) {
    std::map<std::string, double> values;
    for (const config::Entry& entry : effect.entries)
      if (entry.key != "effect") values[entry.key] = truth.number(effect, entry.key);
    options.effects.add(truth.value(effect, "effect").text, values);
  }
  for (const config::Value& pattern : truth["patterns"].items)
    options.patterns.push_back({truth.value(pattern, "pattern").text, truth.number(pattern, "size")});
}

CampaignOptions read(const Truth& truth, std::uint64_t seed) {
  if (truth.whole("seed") == seed)
    throw std::invalid_argument(fmt::format("--seed {} is that of the campaign itself; choose another one", seed));
  CampaignOptions options;
  options.seed = seed;
  options.design = truth.word("design");
  for (const config::Value& experiment : truth["experiments"].items) options.experiments.push_back(experiment.text);
  options.light = named(std::array{Light::reference, Light::physical}, truth.word("light"));
  options.noise =
      named(std::array{NoiseKind::none, NoiseKind::gaussian, NoiseKind::heavy, NoiseKind::drift}, truth.word("noise"));
  options.jitter = truth.number("jitter");
  options.light_jitter = truth.number("light_jitter");
  options.order = order_names().at(truth.word("order"));
  options.frames = truth.whole("frames");
  options.output = named(std::array{Output::taps, Output::phases, Output::distances}, truth.word("output"));
  const config::Value& clutter = truth["clutter"];
  options.clutter = {.warp = truth.number(clutter, "warp"),
                     .sessions = static_cast<std::size_t>(truth.number(clutter, "sessions")),
                     .residue = truth.number(clutter, "residue"),
                     .misplaced = truth.number(clutter, "misplaced")};
  take_effects(truth, options);
  Rig& rig = options.like.emplace();
  rig.seed = truth.whole("rig_seed");
  const config::Value& camera = truth["camera"];
  rig.camera.gain = truth.number(camera, "gain");
  rig.camera.read_noise = truth.number(camera, "read_noise");
  rig.camera.shot_noise = truth.number(camera, "shot_noise");
  rig.camera.steps.clear();
  for (const config::Value& step : truth["steps"].items) rig.camera.steps.push_back(std::stod(step.text));
  return options;
}

}  // namespace

CampaignOptions like(const std::filesystem::path& truth, std::uint64_t seed) {
  try {
    return read(Truth(truth), seed);
  } catch (const config::ConfigurationError& error) {
    throw std::invalid_argument(error.what());
  }
}

std::vector<io::Condition> between(std::vector<io::Condition> conditions, std::uint64_t seed) {
  std::set<double> levels;
  for (const io::Condition& condition : conditions) levels.insert(condition.board_distance);
  if (levels.size() < 2) return conditions;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0.3, 0.7);
  std::map<double, double> moved;
  for (auto level = levels.begin(); level != levels.end(); ++level) {
    const double other = std::next(level) == levels.end() ? *std::prev(level) : *std::next(level);
    moved[*level] = *level + share(random) * (other - *level);
  }
  for (io::Condition& condition : conditions) condition.board_distance = moved[condition.board_distance];
  name_conditions(conditions);
  return conditions;
}

}  // namespace tofgraph::hidden
