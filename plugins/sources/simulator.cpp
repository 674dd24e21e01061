// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The ideal camera in front of a perpendicular white board: four-phase samples, with the profile's noise or none.
#include <tofgraph/stage.hpp>

#include <array>
#include <cmath>
#include <complex>
#include <memory>
#include <string>
#include <vector>

#include "physics/four_phase.hpp"
#include "physics/random.hpp"

namespace tofgraph {

/// Light: `reference` (see physics::reference_light). Noise: each sample is the difference of two taps whose variance
/// is read_noise^2 + shot_noise * counts; normal, and the same for the same seed, frame and pixel. Pixels outside the
/// lens model are NaN. Without noise all frames share one buffer.
struct Simulator final : Source {
  Out<float> phases{this, "phases"};
  Param<double> distance{
      this,
      "distance",
      {.unit = "m", .fallback = "500 mm", .min = 1e-3, .max = 1e3, .text = "of the board from the sensor plane"}};
  Param<double> reflectivity{this, "reflectivity", {.fallback = "0.85", .min = 0, .max = 1, .text = "of the board"}};
  Param<double> integration_time{
      this,
      "integration_time",
      {.unit = "s", .fallback = "1 ms", .min = 1e-6, .max = 10, .text = "of each phase image"}};
  Param<Choice> noise{
      this,
      "noise",
      {.fallback = "profile", .choices = "profile none", .text = "profile: that of the camera's profile"}};
  Param<std::int64_t> frames{this, "frames", {.fallback = "1", .min = 0, .text = "how many; 0: endless"}};
  Param<double> frame_rate{
      this,
      "frame_rate",
      {.unit = "Hz", .min = 1e-3, .max = 1e6, .text = "for the time stamps; default: the camera's"}};
  Param<std::int64_t> seed{this, "seed", {.fallback = "1", .min = 0, .text = "of the noise"}};

  void prepare(Setup& setup) {
    const tofgraph_camera& camera = setup.camera();
    const physics::Geometry geometry = physics::geometry_of(camera);
    if (*distance <= geometry.focal_length) {
      throw ConfigError("distance", "the board stands behind the lens, which is " +
                                        std::to_string(geometry.focal_length) +
                                        " m from the sensor plane, e.g. distance: 500 mm");
    }
    noise_ = {camera.read_noise, camera.shot_noise};
    exposure_ = {camera.gain, camera.contrast, *integration_time, camera.modulation_frequency};
    need(camera, exposure_.modulation_frequency, "modulation_frequency: 20 MHz");
    need(camera, exposure_.gain, "gain: 7.0e6 counts m^2/s");
    need(camera, exposure_.contrast, "contrast: 0.5");
    if (*noise == "profile" && !noise_.known()) {
      throw ConfigError("noise", "the profile of the camera '" + std::string(camera.name) +
                                     "' has no read_noise and shot_noise: give them there, or write noise: none");
    }
    period_ = 1 / (frame_rate.given() ? *frame_rate : camera.frame_rate);
    if (!std::isfinite(period_))
      throw ConfigError("frame_rate", "the camera's profile has none, so it has to be given, e.g. frame_rate: 80 Hz");
    rows_ = camera.height;
    columns_ = camera.width;
    expose(camera, geometry);
    setup.set_frames(static_cast<std::uint64_t>(*frames),
                     TOFGRAPH_KNOWS_TIMESTAMP | TOFGRAPH_KNOWS_INTEGRATION_TIME | TOFGRAPH_KNOWS_MODULATION_FREQUENCY);
  }

  bool process(Frame& frame) {
    if (*frames != 0 && next_ == static_cast<std::uint64_t>(*frames)) return false;
    tofgraph_metadata& metadata = frame.metadata();
    metadata.device_number = next_;
    metadata.timestamp_ns = std::llround(static_cast<double>(next_) * period_ * 1e9);
    metadata.integration_time = exposure_.integration_time;
    metadata.modulation_frequency = exposure_.modulation_frequency;
    if (*noise == "none")
      share(frame);
    else
      add_noise(phases(frame, 4, rows_, columns_), next_);
    ++next_;
    return true;
  }

 private:
  using Samples = std::vector<float>;

  static void need(const tofgraph_camera& camera, double value, const std::string& example) {
    if (value > 0) return;
    throw std::runtime_error(std::string("the profile of the camera '") + camera.name + "' has no " +
                             example.substr(0, example.find(':')) + ", e.g. " + example);
  }

  /// The four phase images without noise, and each pixel's deviation of a sample.
  void expose(const tofgraph_camera& camera, const physics::Geometry& geometry) {
    const std::size_t pixels = rows_ * columns_;
    auto samples = std::make_shared<Samples>(4 * pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      const physics::Vector3 ray = physics::unit_ray(camera.rays + 3 * i);
      const double reflected = physics::reflected_path(geometry, ray, *distance);
      const physics::Light light = physics::reference_light(geometry, ray, reflected, *reflectivity, exposure_);
      const std::array<double, 4> c = physics::samples_of(light.phasor);
      for (std::size_t k = 0; k < 4; ++k) (*samples)[k * pixels + i] = static_cast<float>(c[k]);
      deviation_.push_back(std::sqrt(noise_.sample_variance(light.intensity)));
    }
    samples_ = std::move(samples);
  }

  void add_noise(const Array<float>& image, std::uint64_t number) const {
    const std::size_t pixels = deviation_.size();
    for (std::size_t i = 0; i < pixels; ++i) {
      const auto normal =
          physics::normal_numbers(static_cast<std::uint64_t>(*seed), number, static_cast<std::uint32_t>(i));
      for (std::size_t k = 0; k < 4; ++k) {
        const std::size_t at = k * pixels + i;
        image[at] = static_cast<float>((*samples_)[at] + deviation_[i] * normal[k]);
      }
    }
  }

  /// Hands the samples on without a copy; each frame keeps them alive.
  void share(const Frame& frame) const {
    const auto row = static_cast<std::int64_t>(columns_ * sizeof(float));
    const tofgraph_view view{.data = const_cast<float*>(samples_->data()),  // readers only read
                             .type = TOFGRAPH_F32,
                             .rank = 3,
                             .extent = {4, rows_, columns_, 0},
                             .stride = {row * static_cast<std::int64_t>(rows_), row, sizeof(float), 0},
                             .channel = phases.channel(),
                             .unit = phases.port().unit};
    using Owner = std::shared_ptr<const Samples>;
    auto owner = std::make_unique<Owner>(samples_);
    frame.share(view, owner.get(), [](void* memory) { delete static_cast<Owner*>(memory); });
    static_cast<void>(owner.release());  // now the frame's
  }

  physics::TapNoise noise_;
  physics::Exposure exposure_;
  std::size_t rows_ = 0, columns_ = 0;
  double period_ = 0;  // s
  std::shared_ptr<const Samples> samples_;
  std::vector<double> deviation_;  // counts, of a sample of each pixel
  std::uint64_t next_ = 0;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Simulator, "The ideal camera before a perpendicular board, as four-phase samples")
