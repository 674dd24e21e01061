// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Combines several calibrations into one model, so that every effect and every constant is corrected exactly once.
#include "config/quantity.hpp"
#include "io/image_file.hpp"
#include "simulation/files/camera_assembly.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace tofgraph::simulation {
namespace {

namespace fs = std::filesystem;

constexpr const char* pattern_name = "fixed_pattern";
constexpr const char* warm_up_name = "warm_up";
constexpr const char* constant_name = "zero_offset";

/// Effect with its source file.
struct JoinedEffect {
  std::string name;
  config::Value value;  ///< map of its parameters, with absolute paths
  std::string kind;     ///< kind of the entry
};

std::string effect_name_in(const config::Value& effect) {
  const config::Entry* name = effect.is_map() ? effect.find("effect") : nullptr;
  return name != nullptr ? name->value.text : "";
}

std::vector<JoinedEffect> joined_effects_of(const fs::path& model, const std::string& kind) {
  std::vector<JoinedEffect> effects;
  std::error_code error;
  if (!fs::is_regular_file(model, error)) return effects;
  const config::Value document = config::with_absolute_paths(config::load_document(model));
  if (const config::Entry* list = document.find("effects"))
    for (const config::Value& effect : list->value.items) effects.push_back({effect_name_in(effect), effect, kind});
  return effects;
}

double effect_number(const config::Value& effect, std::string_view key, std::string_view unit) {
  const config::Entry* entry = effect.find(key);
  if (entry == nullptr) return 0;
  const config::Quantity quantity = config::parse_quantity(entry->value.text, unit);
  return quantity.ok() ? quantity.value : 0;
}

/// Mean of a map, m, without unknown pixels. @throws std::runtime_error
double mean_of_map(const config::Value& map) {
  const auto word = [&](const char* key) {
    const config::Entry* entry = map.is_map() ? map.find(key) : nullptr;
    return entry != nullptr ? entry->value.text : std::string();
  };
  const io::ImageFile image("map", map.is_map() ? word("file") : map.text, word("dataset"), word("unit"), "m");
  const auto* values = static_cast<const double*>(image.view().data);
  double sum = 0, count = 0;
  for (std::uint64_t i = 0; i < image.view().extent[0] * image.view().extent[1]; ++i) {
    if (!std::isfinite(values[i])) continue;
    sum += values[i];
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

/// Constant contribution of an effect to the half path of a warm camera, m.
double constant_of(const JoinedEffect& effect) {
  if (effect.name == constant_name) return effect_number(effect.value, "offset", "m");
  if (effect.name == warm_up_name)
    return effect_number(effect.value, "drift", "m") + effect_number(effect.value, "slow_drift", "m");
  if (effect.name != pattern_name) return 0;
  const config::Entry* map = effect.value.find("map");
  return map != nullptr ? effect_number(effect.value, "scale", "") * mean_of_map(map->value) : 0;
}

double sum_of_constants(const std::vector<JoinedEffect>& effects) {
  double sum = 0;
  for (const JoinedEffect& effect : effects) sum += constant_of(effect);
  return sum;
}

/// True for effects that do not show in the mean over boards in front of a warm camera: the pattern of the pixels, the
/// warm-up, the geometry and the light of neighbouring pixels.
bool unseen_by_boards(const std::string& name, const graph::PluginRegistry& registry) {
  constexpr std::array<std::string_view, 3> names = {pattern_name, "pixel_response", warm_up_name};
  if (std::ranges::find(names, name) != names.end()) return true;
  const graph::PluginFile* file = registry.find(name);
  if (file == nullptr || file->kind != "effect") return false;
  const tofgraph_effect& border = *registry.load(*file).effect;
  return border.level == TOFGRAPH_LEVEL_GEOMETRY || (border.flags & TOFGRAPH_EFFECT_IMAGE) != 0;
}

/// True if a model was corrected in the boards of the offset calibration: the two are then complementary.
bool offset_follows_model(const fs::path& offset) {
  const config::Value document = config::load_document(offset);
  const config::Entry* settings = document.find("settings");
  const config::Entry* applied = settings != nullptr ? settings->value.find("applied") : nullptr;
  if (applied == nullptr) return false;
  return std::ranges::any_of(applied->value.items,
                             [](const config::Value& word) { return word.text == "model_correction"; });
}

config::Value constant_effect(double metres) {
  const std::string text = fmt::format("{{effect: {}, offset: {:.6f} mm}}", constant_name, metres * 1e3);
  return config::parse_document("the constant", text);
}

class ModelJoiner {
 public:
  ModelJoiner(const io::CameraFolder& folder, const graph::PluginRegistry& registry)
      : folder_(folder), registry_(registry) {
    for (const io::FolderEntry& entry : folder.entries) {
      const fs::path file = folder.folder / entry.files.front().file;
      if (entry.kind == "model")
        model_ = joined_effects_of(file, entry.kind);
      else if (entry.kind != "profile")
        std::ranges::move(joined_effects_of(model_beside(file), entry.kind), std::back_inserter(own_));
    }
    const fs::path offset = folder.file_of("offset");
    raw_offset_ = !offset.empty() && !offset_follows_model(offset);
  }

  JoinedModel join() {
    for (const JoinedEffect& effect : model_) take_from_model(effect);
    std::ranges::copy(own_, std::back_inserter(used_));
    keep_the_constant();
    JoinedModel result{.effects = {}, .notes = std::move(notes_)};
    for (JoinedEffect& effect : used_) result.effects.push_back(std::move(effect.value));
    return result;
  }

 private:
  void take_from_model(const JoinedEffect& effect) {
    const auto own = std::ranges::find(own_, effect.name, &JoinedEffect::name);
    if (own != own_.end())
      notes_.push_back(
          fmt::format("{}: that of the {} calibration is used, not that of the model", effect.name, own->kind));
    else if (raw_offset_ && !unseen_by_boards(effect.name, registry_))
      notes_.push_back(
          fmt::format("{}: left out of the model, since the offset calibration, whose boards had no model "
                      "undone, contains it",
                      effect.name));
    else
      used_.push_back(effect);
  }

  /// Adds the difference between the sum of the constants and their jointly measured value.
  void keep_the_constant() {
    // Without a model, only the offset calibration determines the constant of a warm camera: its distances are kept.
    const bool stays = raw_offset_ || model_.empty();
    const double wanted = stays ? 0 : sum_of_constants(model_);
    const double difference = wanted - sum_of_constants(used_);
    if (std::abs(difference) < 1e-6) return;
    if (const auto heated = std::ranges::find(used_, warm_up_name, &JoinedEffect::name);
        heated != used_.end() && effect_number(heated->value, "exponent", "") != 0)
      notes_.emplace_back(
          "warm_up: its drift depends on the integration time, the constant that is taken out is that of its "
          "reference_time");
    if (raw_offset_ || !model_.empty())
      notes_.push_back(fmt::format(
          "constant: {:+.2f} mm are added, so that the constants of the joined effects are those of {}, once",
          difference * 1e3, raw_offset_ ? "the offset calibration" : "the model"));
    const auto there = std::ranges::find(used_, constant_name, &JoinedEffect::name);
    const double all = difference + (there != used_.end() ? constant_of(*there) : 0);
    if (there != used_.end()) used_.erase(there);
    used_.push_back({constant_name, constant_effect(all), "constant"});
  }

  const io::CameraFolder& folder_;
  const graph::PluginRegistry& registry_;
  std::vector<JoinedEffect> model_, own_, used_;
  std::vector<std::string> notes_;
  bool raw_offset_ = false;
};

}  // namespace

fs::path model_beside(const fs::path& calibration) { return fs::path(calibration).replace_extension(".model.yaml"); }

JoinedModel joined_model(const io::CameraFolder& folder, const graph::PluginRegistry& registry) {
  return ModelJoiner(folder, registry).join();
}

}  // namespace tofgraph::simulation
