// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Corrects the effects of a model on the distance.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/model_correction.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <hwy/highway.h>
#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/to_integer.hpp>

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <mutex>
#include <optional>

#include "io/profile.hpp"
#include "io/sha256.hpp"
#include "plugins/calibrated_serial.hpp"
#include "plugins/model_reader.hpp"
#include "simulation/correction.hpp"
#include "simulation/correction_cache.hpp"

#ifndef TOFGRAPH_MODEL_CORRECTION_ONCE
#define TOFGRAPH_MODEL_CORRECTION_ONCE
namespace tofgraph {

/// Images of a frame and the tables for it; see simulation::CorrectionTables.
struct CorrectionLookup {
  float *distance, *sigma;  // changed; sigma may be null
  const float* amplitude;   // null if it has no influence
  std::uint16_t* flags;     // combined
  std::size_t count;
  const float *nodes, *pixels, *shifts;
  std::size_t lanes, distances, amplitudes;
  float first, range, per_step;  // m, m, 1/m
  float weakest, strongest;      // counts
};

}  // namespace tofgraph
#endif

#include "plugins/filters/correction_vector.hpp"

#if HWY_ONCE
namespace tofgraph {

HWY_EXPORT(LookUp);

/// Finds the distance that the camera without its effects would have measured at the measured amplitude and the frame's
/// settings. Inverts the forward model itself, so that every effect can be corrected, also those of other plugins.
/// Effects of the geometry are applied as a corrected camera. Tables are compiled with the first frame and again for
/// settings that they do not cover; they are kept in the program's cache for the next run.
struct ModelCorrection final : Filter {
  InOut<float> distance{this,
                        "distance",
                        {.text = "half of the travelled path",
                         .refuses = "model_correction effects offset denoised non_linearity rectified",
                         .adds = "effects"}};
  In<float> amplitude{this, "amplitude", {.optional = true, .text = "needed if the model's effects depend on it"}};
  InOut<float> sigma{this, "sigma", {.optional = true, .text = "standard deviation of the distance"}};
  InOut<std::uint16_t> flags{
      this,
      "flags",
      {.optional = true,
       .text = "inconsistent: the distance is ambiguous; extrapolated: the amplitude lies outside the computed range"}};
  Param<InputFile> model{
      this,
      "model",
      {.text = "a model file, written by diagnose, calibrate or by hand, or its content; default: the profile's",
       .in_place = true}};
  SerialCheck check_serial_{this};

  void prepare(Setup& setup) {
    check_sigma(setup, sigma.present(), "distance");
    flags.provide(setup);
    // Exposures of the frames, which may differ from the profile's.
    tofgraph_camera own = setup.camera();
    std::vector<tofgraph_exposure> exposures;
    for (const tofgraph_exposure& exposure : setup.exposures()) exposures.push_back(exposure);
    own.exposures = exposures.data();
    own.exposure_count = exposures.size();
    own.exposure_size = sizeof(tofgraph_exposure);
    camera_ = std::make_unique<io::Camera>(own);
    const tofgraph_camera& camera = camera_->view();
    const std::string file = !model->empty() ? std::string(*model) : camera.model != nullptr ? camera.model : "";
    if (file.empty())
      throw ConfigError("model",
                        std::string("is missing: it states the effects to undo, and the profile of the camera '") +
                            camera.name + "' names no model, e.g. model: model.yaml");
    const ModelReader::Made made = ModelReader(*this).read(setup, "model", file, camera);
    if (model->empty()) setup.uses_file(file);
    if (!simulation::is_for(made.model, *camera_))
      throw ConfigError("model",
                        "is for the camera '" + made.model.camera + "', the frames are from '" + camera.name + "'");
    check_serial_("model", made.model.serial, serial_of(setup));
    try {
      correction_.emplace(camera, made.model.physical, made.effects);
    } catch (const std::exception& error) {
      throw ConfigError("model", error.what());
    }
    cache_.emplace(cache_key(made, camera));
    check_needs(setup);
    lengths_.prepare(setup, {"distance", "sigma"});
    if (const io::Camera* corrected = correction_->corrected_camera()) setup.set_camera(corrected->view());
    bool some = false;
    for (const simulation::EffectTreatment& fate : correction_->treatments()) {
      note(std::string(fate.undone ? "undoes " : "leaves ") + fate.effect + ": " + fate.how);
      some = some || fate.undone;
    }
    if (!some) warn("nothing is undone: the model has no effect of the camera that changes the distance");
  }

  void process(Frame& frame) const {
    const Array<float> image = distance(frame);
    const Array<const float> light = amplitude(frame);
    if (image.size() != correction_->pixels())
      throw std::runtime_error("distance has " + std::to_string(image.size()) + " pixels, the camera has " +
                               std::to_string(correction_->pixels()));
    const simulation::FrameSettings settings = settings_of(frame);
    const auto tables = tables_for(settings);
    const auto nodes = tables->nodes_at(settings);
    thread_local std::vector<float> before;
    const Array<std::uint16_t> bits = flags(frame, image.rows(), image.columns());
    const Array<float> deviations = sigma(frame);
    mark_invalid(image, deviations, bits);
    lengths_.invalidate(frame, bits);
    const CorrectionLookup lookup{.distance = image.data(),
                                  .sigma = deviations.data(),
                                  .amplitude = tables->amplitudes > 1 ? light.data() : nullptr,
                                  .flags = bits.data(),
                                  .count = image.size(),
                                  .nodes = nodes->data(),
                                  .pixels = tables->pixels.data(),
                                  .shifts = tables->shifts.data(),
                                  .lanes = tables->lanes,
                                  .distances = tables->distances,
                                  .amplitudes = tables->amplitudes,
                                  .first = static_cast<float>(tables->first),
                                  .range = static_cast<float>(tables->range),
                                  .per_step = static_cast<float>(1 / tables->step),
                                  .weakest = static_cast<float>(tables->weakest),
                                  .strongest = static_cast<float>(tables->strongest)};
    if (correction_->has_images()) before.assign(image.begin(), image.end());
    HWY_DYNAMIC_DISPATCH(LookUp)(lookup);
    if (!correction_->has_images()) return;
    for (const std::uint32_t pixel : correction_->undo_images(settings, before, light.span(), image.span()))
      bits[pixel] |= flag::inconsistent;
  }

 private:
  void check_needs(const Setup& setup) const {
    const simulation::CorrectionNeeds& needs = correction_->needs();
    const auto require = [](bool there, const std::string& what) {
      if (!there) throw std::runtime_error("the model's effects depend on the " + what);
    };
    require(!needs.amplitude || amplitude.present(),
            "amplitude, which the input lacks: put the node after a decoder, or read a recording that has it");
    const std::string untold = ", which these frames do not state; a recording has it as ";
    require(!needs.integration_time || setup.knows(TOFGRAPH_KNOWS_INTEGRATION_TIME),
            "integration time" + untold + "integration_time_s");
    require(!needs.temperature || setup.knows(TOFGRAPH_KNOWS_TEMPERATURE), "temperature" + untold + "temperature_c");
    require(!needs.time_since_power_on || setup.knows(TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON),
            "time since power-on" + untold + "time_since_power_on_s, a scene as time_since_power_on");
  }

  simulation::FrameSettings settings_of(const Frame& frame) const {
    const tofgraph_metadata& metadata = frame.metadata();
    const auto check = [](bool needed, double value, const char* what) {
      if (needed && !(value >= 0 && std::isfinite(value)))
        throw std::runtime_error(std::string("the frame does not state its ") + what +
                                 ", on which the model's effects depend");
    };
    const simulation::CorrectionNeeds& needs = correction_->needs();
    check(needs.integration_time, metadata.integration_time > 0 ? metadata.integration_time : -1, "integration time");
    check(needs.temperature, metadata.temperature, "temperature");
    check(needs.time_since_power_on, metadata.time_since_power_on, "time since power-on");
    return {metadata.integration_time, metadata.modulation_frequency, metadata.temperature,
            metadata.time_since_power_on};
  }

  /// Path, size and time of a library, used to identify its code.
  static std::string library_text(const std::filesystem::path& file) {
    std::error_code error;
    return fmt::format("{} {} {}\n", file.string(), std::filesystem::file_size(file, error),
                       std::filesystem::last_write_time(file, error).time_since_epoch().count());
  }

  /// Hash of everything that the tables depend on except a frame's settings.
  static std::string cache_key(const ModelReader::Made& made, const tofgraph_camera& camera) {
    Dl_info own{};
    dladdr(reinterpret_cast<const void*>(&ModelCorrection::library_text), &own);
    std::string text = library_text(own.dli_fname != nullptr ? own.dli_fname : "");
    for (const simulation::ModelEffect& effect : made.model.effects) text += library_text(effect.descriptor->file.path);
    text += simulation::described(made.model).dump() + "\n";
    for (const std::string& file : simulation::files_of(made.model)) text += io::sha256_of_file(file) + "\n";
    for (const simulation::EffectPtr& effect : made.effects)
      for (const graph::UsedFile& file : effect->files()) text += io::sha256_of_file(file.path) + "\n";
    const std::size_t bytes = std::size_t{camera.width} * camera.height * 3 * sizeof(float);
    return io::sha256_of(text + io::profile_text(camera) +
                         std::string(reinterpret_cast<const char*>(camera.rays), bytes));
  }

  /// Tables for these settings. Recent ones are kept, because exposures may alternate between integration times.
  std::shared_ptr<const simulation::CorrectionTables> tables_for(const simulation::FrameSettings& settings) const {
    const std::lock_guard lock(mutex_);
    const auto known = std::ranges::find_if(tables_, [&](const auto& tables) { return tables->covers(settings); });
    if (known != tables_.end()) return *known;
    constexpr std::size_t kept = 16;
    if (tables_.size() == kept) tables_.erase(tables_.begin());
    auto tables = cache_->find(settings);
    if (!tables) cache_->keep(tables = correction_->compile(settings));
    tables_.push_back(std::move(tables));
    constexpr double noticeable = 1e-4;  // m
    if (tables_.back()->worst > noticeable && !warned_)
      warn("the model's effects differ from pixel to pixel in so many ways that the correction is up to " +
           std::to_string(physics::to_integer(tables_.back()->worst * 1e6, 0L)) + " um off");
    warned_ = warned_ || tables_.back()->worst > noticeable;
    return tables_.back();
  }

  OtherLengths lengths_;
  std::unique_ptr<const io::Camera> camera_;
  std::optional<simulation::Correction> correction_;
  std::optional<simulation::CorrectionCache> cache_;
  mutable std::mutex mutex_;
  mutable std::vector<std::shared_ptr<const simulation::CorrectionTables>> tables_;  // oldest first
  mutable bool warned_ = false;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::ModelCorrection, "Undoes the effects of a model on the distance")
#endif
