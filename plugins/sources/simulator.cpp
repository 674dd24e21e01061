// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The digital twin as a camera: frames of a scene, or of a perpendicular board.
#include <tofgraph/stage.hpp>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "io/light_sources.hpp"
#include "plugins/model_reader.hpp"
#include "simulation/board.hpp"
#include "simulation/simulation.hpp"

namespace tofgraph {

/// With `scene`, simulates the frames of its conditions one after the other; otherwise a board that fills the view.
/// Noise: see simulation::Frames; equal for equal seed, condition, frame and pixel. Pixels outside the lens model are
/// NaN. Phases without noise are computed once and shared by all frames of a condition.
struct Simulator final : Source {
  Out<float> phases{this, "phases", {.optional = true}};
  Out<std::uint16_t> taps{this, "taps", {.optional = true}};
  Out<float> distance_image{this, "distance", {.name = "distance", .optional = true}};
  Out<float> amplitude{this, "amplitude", {.optional = true}};
  Out<float> true_depth{this, "true_depth", {.optional = true}};
  Out<float> true_reflectivity{this, "reflectivity", {.optional = true}};
  Param<InputFile> scene{this, "scene", {.text = "a scene file; default: a board according to the parameters"}};
  Param<InputFile> model{this, "model", {.text = "a model file, light and effects; default: the scene's, or ideal"}};
  Param<double> distance{
      this,
      "distance",
      {.unit = "m", .default_value = "500 mm", .min = 1e-3, .max = 1e3, .text = "of the board from the sensor plane"}};
  Param<double> reflectivity{
      this, "reflectivity", {.default_value = "0.85", .min = 0, .max = 1, .text = "of the board"}};
  Param<double> integration_time{
      this,
      "integration_time",
      {.unit = "s", .default_value = "1 ms", .min = 1e-6, .max = 10, .text = "of each phase image"}};
  Param<Choice> noise{
      this,
      "noise",
      {.default_value = "profile", .choices = "profile none", .text = "profile: that of the camera's profile"}};
  Param<std::int64_t> frames{
      this,
      "frames",
      {.default_value = "1", .min = 0, .text = "how many per condition; 0: endless; default: the scene's"}};
  Param<double> frame_rate{
      this,
      "frame_rate",
      {.unit = "Hz", .min = 1e-3, .max = 1e6, .text = "for the time stamps; default: the camera's"}};
  Param<std::int64_t> seed{
      this, "seed", {.default_value = "1", .min = 0, .text = "of the noise; default: the scene's"}};
  Param<Choice> output{
      this,
      "output",
      {.choices = "phases taps distance", .text = "what the camera delivers; default: the scene's, or phases"}};
  Param<bool> truth{
      this, "truth", {.default_value = "false", .text = "adds true_depth and reflectivity, without any error"}};

  void prepare(Setup& setup) {
    if (scene.given())
      prepare_scene(setup);
    else
      prepare_board(setup);
    provide(setup);
    if (simulation_) choose_sources(setup);
    const bool power = simulation_ && std::isfinite(simulation_->conditions().front().time_since_power_on);
    setup.set_frames(count_ * (simulation_ ? simulation_->conditions().size() : 1),
                     TOFGRAPH_KNOWS_TIMESTAMP | TOFGRAPH_KNOWS_INTEGRATION_TIME | TOFGRAPH_KNOWS_MODULATION_FREQUENCY |
                         (power ? TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON : 0));
  }

  bool process(Frame& frame) {
    if (count_ != 0 && next_ == count_) {
      if (!simulation_ || ++condition_ == simulation_->conditions().size()) return false;
      load_condition();
      next_ = 0;
    }
    write_metadata(frame.metadata());
    write_images(frame);
    ++next_;
    ++total_;
    return true;
  }

 private:
  using Values = std::vector<float>;

  void prepare_scene(Setup& setup) {
    for (const detail::ParamBase* parameter : std::initializer_list<const detail::ParamBase*>{
             &distance, &reflectivity, &integration_time, &noise, &frame_rate}) {
      const char* name = parameter->parameter().name;
      if (parameter->given()) throw ConfigError(name, "is the scene's: write it in " + *scene);
    }
    const ModelReader reader(*this);
    simulation::SimulationChanges changes{std::string(*model), {}, {}, reader.host()};
    if (seed.given()) changes.seed = static_cast<std::uint64_t>(*seed);
    if (frames.given()) changes.frames = *frames;
    config::Diagnostics diagnostics;
    try {
      simulation_ = simulation::Simulation::read(std::string(*scene), reader.registry(), changes, diagnostics);
    } catch (const config::ConfigurationError& error) {
      throw ConfigError("scene", error.what());
    }
    if (!simulation_) throw ConfigError("scene", diagnostics.text());
    reader.pass_on(diagnostics);
    ModelReader::use_files(setup, simulation_->model(), simulation_->effects());
    const tofgraph_camera& own = simulation_->camera();
    const tofgraph_camera* given = setup.stream().camera;
    if (given == nullptr)
      setup.use_profile(own.name, own.profile);
    else if (given->width != own.width || given->height != own.height || std::string(given->name) != own.name)
      throw ConfigError("scene", std::string("is for the camera '") + own.name + "', the pipeline has '" + given->name +
                                     "': remove one of the two");
    rows_ = own.height;
    columns_ = own.width;
    count_ = simulation_->frames();
    load_condition();
  }

  void prepare_board(Setup& setup) {
    camera_ = std::make_unique<io::Camera>(setup.camera());
    const tofgraph_camera& camera = camera_->view();
    const physics::Geometry geometry = physics::geometry_of(camera);
    if (*distance <= geometry.focal_length) {
      throw ConfigError("distance", "the board is behind the lens, which is " + std::to_string(geometry.focal_length) +
                                        " m from the sensor plane, e.g. distance: 500 mm");
    }
    std::vector<simulation::EffectPtr> effects = effects_of(setup, camera);
    forward_ = std::make_unique<simulation::ForwardModel>(camera, physical_, std::move(effects));
    const physics::TapNoise tap_noise{camera.read_noise, camera.shot_noise};
    if (*noise == "profile" && !tap_noise.known()) {
      throw ConfigError("noise", "the profile of the camera '" + std::string(camera.name) +
                                     "' has no read_noise and shot_noise: give them there, or write noise: none");
    }
    period_ = 1 / (frame_rate.given() ? *frame_rate : camera.frame_rate);
    if (!std::isfinite(period_))
      throw ConfigError("frame_rate", "the camera's profile has none, so it has to be given, e.g. frame_rate: 80 Hz");
    rows_ = camera.height;
    columns_ = camera.width;
    count_ = static_cast<std::uint64_t>(*frames);
    pixels_ = simulation::whole_image(camera);
    const auto tracer = simulation::board_tracer(camera.focal_length, {*distance, 0, 0, *reflectivity});
    auto acquisition = simulation::acquisition_of(camera, *integration_time);
    acquisition.condition.distance = *distance;
    acquisition.condition.tilt[0] = acquisition.condition.tilt[1] = acquisition.condition.roll = 0;
    board_ = std::make_unique<simulation::Frames>(
        *forward_, tracer, acquisition, pixels_, *noise == "none" ? physics::TapNoise{} : tap_noise,
        simulation::NoiseSeed{static_cast<std::uint64_t>(*seed), 0}, hands_out("taps"));
    now_ = board_.get();
    metadata_ = acquisition.condition;
  }

  std::vector<simulation::EffectPtr> effects_of(const Setup& setup, const tofgraph_camera& camera) {
    if (model->empty()) return {};
    ModelReader::Made made = ModelReader(*this).read(setup, "model", std::string(*model), camera);
    physical_ = made.model.physical;
    return std::move(made.effects);
  }

  /// The output camera has only the sources that are on; the simulation uses its own camera.
  void choose_sources(const Setup& setup) const {
    const auto& conditions = simulation_->conditions();
    const std::vector<std::string>& first = conditions.front().sources;
    for (const auto& condition : conditions) {
      if (io::same_sources(simulation_->camera(), first, condition.sources)) continue;
      return warn(
          *scene +
          ": conditions differ in the sources that are on: distance models use all sources of the camera, which "
          "is wrong for single ones; simulate it into captures (tofgraph simulate), which state their sources");
    }
    io::use_sources(setup, first);
  }

  void load_condition() {
    prepared_ = simulation_->prepare(condition_);
    now_ = &prepared_->frames;
    shared_ = nullptr;
  }

  bool hands_out(const char* name) const {
    if (output.given()) return *output == name;
    return simulation_ ? simulation_->has_output(name) : std::string_view(name) == "phases";
  }

  void provide(Setup& setup) {
    if (hands_out("phases")) phases.provide(setup);
    if (hands_out("taps")) taps.provide(setup);
    if (hands_out("distance")) {
      distance_image.provide(setup);
      amplitude.provide(setup);
    }
    if (!*truth) return;
    true_depth.provide(setup);
    true_reflectivity.provide(setup);
  }

  void write_metadata(tofgraph_metadata& metadata) const {
    if (simulation_) {
      const std::uint64_t number = metadata.number;
      metadata = simulation_->metadata(prepared_->condition, next_);
      metadata.number = number;
    } else {
      metadata.timestamp_ns = std::llround(static_cast<double>(next_) * period_ * 1e9);
      metadata.integration_time = metadata_.integration_time;
      metadata.modulation_frequency = metadata_.modulation_frequency;
    }
    metadata.device_number = total_;
  }

  void write_images(Frame& frame) {
    if (phases.present()) {
      if (now_->noisy())
        now_->phases(next_, phases(frame, now_->exposures(), rows_, columns_).data());
      else
        share_phases(frame);
    }
    if (taps.present()) now_->taps(next_, taps_of(frame));
    if (distance_image.present())
      now_->distance(next_, distance_image(frame, rows_, columns_).data(), amplitude(frame, rows_, columns_).data());
    if (!*truth) return;
    const std::vector<simulation::Hit>& hits = now_->hits();
    const Values depth = simulation::true_depth(hits);
    std::copy(depth.begin(), depth.end(), true_depth(frame, rows_, columns_).begin());
    float* white = true_reflectivity(frame, rows_, columns_).data();
    for (const simulation::Hit& hit : hits)
      *white++ = std::isfinite(hit.return_path) ? static_cast<float>(hit.reflectivity) : NAN;
  }

  /// Creates the four-dimensional channel, which Out does not support.
  std::uint16_t* taps_of(const Frame& frame) const {
    const tofgraph_channel channel{.type = TOFGRAPH_TYPE_U16,
                                   .rank = 4,
                                   .name = taps.channel(),
                                   .extent = {now_->exposures(), 2, rows_, columns_},
                                   .unit = taps.port().unit};
    return static_cast<std::uint16_t*>(frame.write(channel).data);
  }

  /// Shares the samples without a copy; each frame keeps them alive.
  void share_phases(const Frame& frame) {
    if (!shared_) {
      auto samples = std::make_shared<Values>(now_->exposures() * rows_ * columns_);
      now_->phases(0, samples->data());
      shared_ = std::move(samples);
    }
    const auto row = static_cast<std::int64_t>(columns_ * sizeof(float));
    const tofgraph_view view{.type = TOFGRAPH_TYPE_F32,
                             .rank = 3,
                             .data = const_cast<float*>(shared_->data()),  // shared buffers are read-only
                             .extent = {now_->exposures(), rows_, columns_, 0},
                             .stride = {row * static_cast<std::int64_t>(rows_), row, sizeof(float), 0},
                             .channel = phases.channel(),
                             .unit = phases.port().unit};
    using Owner = std::shared_ptr<const Values>;
    auto owner = std::make_unique<Owner>(shared_);
    frame.share(view, owner.get(), [](void* memory) { delete static_cast<Owner*>(memory); });
    static_cast<void>(owner.release());  // now owned by the frame
  }

  std::unique_ptr<const simulation::Simulation> simulation_;  // for a scene
  std::unique_ptr<const simulation::ConditionFrames> prepared_;
  simulation::Pixels pixels_;  // for the board
  std::unique_ptr<const io::Camera> camera_;
  std::unique_ptr<const simulation::ForwardModel> forward_;
  std::unique_ptr<const simulation::Frames> board_;
  tofgraph_condition metadata_{};
  bool physical_ = false;
  double period_ = 0;  // s

  const simulation::Frames* now_ = nullptr;
  std::shared_ptr<const Values> shared_;
  std::size_t rows_ = 0, columns_ = 0, condition_ = 0;
  std::uint64_t count_ = 0, next_ = 0, total_ = 0;  // of this condition, in total
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Simulator, "Simulated frames of a scene, or of a perpendicular board")
