// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/campaign.hpp"

#include "io/campaign.hpp"
#include "io/captures/capture.hpp"
#include "tests/hidden_effects/defects.hpp"
#include "tests/hidden_effects/designs.hpp"
#include "tests/hidden_effects/draws.hpp"
#include "tests/hidden_effects/like.hpp"
#include "tests/hidden_effects/truth.hpp"

#include <tofgraph/array.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <complex>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <thread>

namespace tofgraph::hidden {
namespace {

namespace fs = std::filesystem;

/// Settings unknown to the search: light power and noise of the individual camera.
Camera this_camera(const CampaignOptions& options) {
  if (options.like) return options.like->camera;
  Camera camera;
  camera.steps = options.steps;
  if (options.noise == NoiseKind::none) return camera;
  std::mt19937_64 random = generator(options.seed, camera_draw);
  const auto about = [&](double share) { return std::uniform_real_distribution<double>(1 - share, 1 + share)(random); };
  camera.gain *= about(0.1);
  camera.read_noise *= about(0.3);
  camera.shot_noise *= about(0.3);
  return camera;
}

std::vector<io::Condition> conditions_for(const CampaignOptions& options) {
  std::vector<io::Condition> conditions = conditions_of(options.design, options.experiments, options.every);
  append(conditions, options.more);
  return options.like ? between(std::move(conditions), options.seed) : conditions;
}

View view_of(const io::Condition& condition) {
  View view;
  view.distance = condition.board_distance;
  view.tilt_x = condition.board_tilt_x;
  view.tilt_y = condition.board_tilt_y;
  view.reflectivity = condition.reflectivity;
  view.integration_time = condition.integration_time;
  if (!condition.sources.empty()) view.on = {condition.sources[0] == "left", condition.sources[0] == "right"};
  view.ambient = condition.ambient != "dark";
  if (!std::isnan(condition.time_since_power_on)) view.time_since_power_on = condition.time_since_power_on;
  view.roll = condition.roll;
  view.velocity = condition.velocity;
  view.laser = condition.reference == "laser";
  view.capped = condition.is_capped();
  view.covered = condition.rail == "covered";
  return view;
}

/// A slow drift with the run order: three sines of different periods, with root mean square 1.
double wander(std::mt19937_64 random, double place) {
  std::uniform_real_distribution<double> uniform(0, 1);
  double sum = 0;
  for (const double cycles : {0.6, 1.3, 2.2}) sum += std::sin(2 * M_PI * (cycles * place + uniform(random)));
  return sum * std::sqrt(2.0 / 3);
}

/// Puts the conditions in order of measurement. Returns the true pose of each board and the drift of the camera at that
/// time.
std::vector<View> measured_views(const CampaignOptions& options, std::vector<io::Condition>& conditions) {
  std::mt19937_64 random = generator(options.seed, order_draw);
  if (options.order != Order::designed) std::shuffle(conditions.begin(), conditions.end(), random);
  warm_up_first(conditions, options.clutter.sessions);
  std::normal_distribution<double> normal;
  std::vector<View> views;
  double earlier = conditions.front().board_distance;
  for (std::size_t order = 0; order < conditions.size(); ++order) {
    io::Condition& condition = conditions[order];
    condition.order = order;
    View& view = views.emplace_back(view_of(condition));
    view.order = order;
    view.earlier_distance = earlier;
    earlier = condition.board_distance;
    if (options.noise == NoiseKind::none) continue;
    view.distance += 0.5e-3 * options.jitter * normal(random);
    view.reflectivity *= 1 + 0.01 * options.light_jitter * normal(random);
    if (options.noise != NoiseKind::drift) continue;
    const double place = static_cast<double>(order) / static_cast<double>(conditions.size());
    view.drift_distance = 0.5e-3 * wander(generator(options.seed, drift_draw), place);
    view.drift_amplitude = 1 + 5e-3 * wander(generator(options.seed + 1, drift_draw), place);
  }
  return views;
}

/// Writes a campaign.
class Writer {
 public:
  Writer(const CampaignOptions& options, fs::path folder)
      : options_(options),
        folder_(std::move(folder)),
        physics_{this_camera(options), options.light, options.effects, draw_maps({}, options.rig_seed()),
                 options.patterns},
        conditions_(conditions_for(options)),
        views_(measured_views(options, conditions_)),
        clutter_(add_clutter(options.clutter, options.seed, options.rig_seed(), conditions_, views_)),
        defects_(options.noise == NoiseKind::heavy ? draw_defects(physics_.camera, options.rig_seed())
                                                   : std::vector<Defect>(physics_.camera.pixels(), Defect::none)) {
    for (std::size_t i = 0; i < conditions_.size(); ++i) {
      conditions_[i].capture = folder_ / "captures" / (conditions_[i].id + ".h5");
      if (!clutter_.sessions.empty())
        conditions_[i].session =
            fmt::format("{}", session_of(views_[i].order, views_.size(), clutter_.sessions.size()));
    }
  }

  void write() {
    fs::create_directories(folder_ / "captures");
    if (options_.frames > 0) write_captures();
    write_truth(folder_ / "truth.yaml", options_, physics_, conditions_, views_, clutter_);
    write_campaign_file();
  }

 private:
  void write_captures() {
    std::atomic<std::size_t> next = 0;
    std::exception_ptr failure;
    std::mutex failing;
    const auto work = [&] {
      try {
        for (std::size_t i = next++; i < conditions_.size(); i = next++) write_capture(i);
      } catch (...) {
        const std::lock_guard lock(failing);
        failure = std::current_exception();
        next = conditions_.size();
      }
    };
    {
      std::vector<std::jthread> threads;
      const std::size_t count = options_.threads ? options_.threads : std::max(1U, std::thread::hardware_concurrency());
      for (std::size_t i = 0; i < count; ++i) threads.emplace_back(work);
    }
    if (failure) std::rethrow_exception(failure);
  }

  void write_capture(std::size_t index) {
    const Camera& camera = physics_.camera;
    const std::uint64_t height = static_cast<std::uint64_t>(camera.height),
                        width = static_cast<std::uint64_t>(camera.width);
    std::mt19937_64 random = generator(options_.seed, condition_draw + index);
    Readout readout(physics_, options_.noise);
    const Taps expected = expected_taps(physics_, views_[index]);
    io::CaptureHeader header;
    header.camera = "camcube2";
    if (has_own_steps()) {
      for (const double step : camera.steps) header.exposures.push_back({step, 0});
    }
    header.width = static_cast<std::uint32_t>(width);
    header.height = static_cast<std::uint32_t>(height);
    io::CaptureWriter writer(conditions_[index].capture, header, channels(height, width));
    Frame frame(camera.pixels(), camera.steps.size());
    for (std::size_t f = 0; f < options_.frames; ++f) {
      for (std::size_t k = 0; k < camera.steps.size(); ++k)
        for (std::size_t i = 0; i < camera.pixels(); ++i) {
          const double a = damaged(defects_[i], readout(expected.a[k][i], random), random);
          const double b = damaged(defects_[i], readout(expected.b[k][i], random), random);
          frame.taps[2 * k * camera.pixels() + i] = counts(a);
          frame.taps[(2 * k + 1) * camera.pixels() + i] = counts(b);
          frame.phases[k * camera.pixels() + i] = static_cast<std::int32_t>(std::lround(a - b));
        }
      const std::vector<tofgraph_view> views = views_of(frame, height, width);
      writer.append(metadata(index, f), views);
    }
    writer.finish();
  }

  struct Frame {
    Frame(std::size_t pixels, std::size_t steps)
        : taps(2 * steps * pixels), phases(steps * pixels), distance(pixels), amplitude(pixels) {}
    std::vector<std::uint16_t> taps;
    std::vector<std::int32_t> phases;
    std::vector<float> distance, amplitude;  ///< m, counts
  };

  std::uint64_t steps() const { return physics_.camera.steps.size(); }
  bool has_own_steps() const { return physics_.camera.steps != Camera{}.steps; }

  std::vector<io::CaptureChannel> channels(std::uint64_t height, std::uint64_t width) const {
    switch (options_.output) {
      case Output::taps:
        return {{"taps", TOFGRAPH_TYPE_U16, {steps(), 2, height, width}, "counts", "", "", ""}};
      case Output::phases:
        return {{"phases", TOFGRAPH_TYPE_I32, {steps(), height, width}, "counts", "", "", ""}};
      case Output::distances:
        return {{"distance", TOFGRAPH_TYPE_F32, {height, width}, "m", "", "", ""},
                {"amplitude", TOFGRAPH_TYPE_F32, {height, width}, "counts", "", "", ""}};
    }
    return {};
  }

  std::vector<tofgraph_view> views_of(Frame& frame, std::uint64_t height, std::uint64_t width) const {
    switch (options_.output) {
      case Output::taps:
        return {view_of_data(frame.taps.data(), TOFGRAPH_TYPE_U16, 2, {steps(), 2, height, width})};
      case Output::phases:
        return {view_of_data(frame.phases.data(), TOFGRAPH_TYPE_I32, 4, {steps(), height, width})};
      case Output::distances:
        decode(frame);
        return {view_of_data(frame.distance.data(), TOFGRAPH_TYPE_F32, 4, {height, width}),
                view_of_data(frame.amplitude.data(), TOFGRAPH_TYPE_F32, 4, {height, width})};
    }
    return {};
  }

  /// Decoding as in the camera, from 0 on: for four steps atan2(c3 - c1, c0 - c2). The steps must be equally spaced.
  void decode(Frame& frame) const {
    const std::size_t pixels = frame.distance.size();
    for (std::size_t i = 0; i < pixels; ++i) {
      std::complex<double> phasor;
      for (std::size_t k = 0; k < steps(); ++k)
        phasor += std::polar(static_cast<double>(frame.phases[k * pixels + i]), -physics_.camera.steps[k]);
      phasor *= 2 / static_cast<double>(steps());
      const double phase = std::arg(phasor);
      frame.distance[i] =
          static_cast<float>(physics_.camera.metres_per_radian() * (phase < 0 ? phase + 2 * M_PI : phase));
      frame.amplitude[i] = static_cast<float>(std::abs(phasor));
    }
  }

  static tofgraph_view view_of_data(void* data, std::uint32_t type, std::int64_t size,
                                    std::vector<std::uint64_t> extent) {
    tofgraph_view view = empty_view();
    view.data = data;
    view.type = type;
    view.rank = static_cast<std::uint32_t>(extent.size());
    for (std::size_t d = extent.size(); d-- > 0;) {
      view.extent[d] = extent[d];
      view.stride[d] = size;
      size *= static_cast<std::int64_t>(extent[d]);
    }
    return view;
  }

  tofgraph_metadata metadata(std::size_t index, std::size_t frame) const {
    tofgraph_metadata metadata{};
    metadata.size = sizeof metadata;
    metadata.number = metadata.device_number = frame;
    // Two minutes between conditions, frames at the camera's rate.
    metadata.timestamp_ns = 1'300'000'000'000'000'000 +
                            static_cast<std::int64_t>(views_[index].order) * 120'000'000'000 +
                            static_cast<std::int64_t>(frame) * 12'500'000;
    metadata.integration_time = conditions_[index].integration_time;
    metadata.modulation_frequency = physics_.camera.modulation_frequency;
    metadata.temperature = std::numeric_limits<double>::quiet_NaN();
    metadata.time_since_power_on = conditions_[index].time_since_power_on;
    return metadata;
  }

  void write_campaign_file() const {
    io::Campaign campaign;
    campaign.name = fmt::format("design {}, seed {}", options_.design, options_.seed);
    campaign.camera_name = has_own_steps() ? "camera.yaml" : "camcube2";
    if (has_own_steps()) write_camera(folder_ / campaign.camera_name, physics_.camera);
    campaign.conditions = conditions_;
    for (io::Condition& condition : campaign.conditions) {
      condition.reflectivity = io::unknown;  // estimated by the search
      if (options_.order == Order::unstated) condition.order.reset();
    }
    write_model(folder_ / "model.yaml", options_);
    io::write_campaign(campaign, folder_ / "campaign.yaml");
  }

  const CampaignOptions& options_;
  fs::path folder_;
  Physics physics_;
  std::vector<io::Condition> conditions_;
  std::vector<View> views_;
  DrawnClutter clutter_;
  std::vector<Defect> defects_;
};

}  // namespace

void make_campaign(const CampaignOptions& options) {
  if (fs::exists(options.folder))
    throw std::runtime_error(fmt::format("{} exists already; choose another folder", options.folder.string()));
  fs::path part = options.folder;
  part += ".part";
  fs::remove_all(part);
  Writer(options, part).write();
  fs::rename(part, options.folder);
}

}  // namespace tofgraph::hidden
