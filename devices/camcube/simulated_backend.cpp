// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <thread>
#include <utility>

#include "devices/camcube/backend.hpp"
#include "devices/camcube/frame_exchange.hpp"
#include "plugins/model_reader.hpp"
#include "simulation/simulation.hpp"

namespace tofgraph::camcube {
namespace {

constexpr double patience_periods = 8;  ///< delay of a frame in periods at which the pace is abandoned

/// Digital twin of the camera: plays the conditions of a scene one after the other, each for its frames, repeatedly.
/// The noise never repeats.
class Simulated final : public Backend {
 public:
  Simulated(const Stage& stage, const Settings& settings) : stage_(stage), settings_(settings), reader_(stage) {}

  void prepare(Setup& setup) override {
    if (settings_.scene.empty())
      throw SettingError("scene", "a simulated camera needs a scene, e.g. scene: pipelines/scenes/board.yaml");
    config::Diagnostics diagnostics;
    try {
      simulation_ = read_scene(settings_.integration_time, diagnostics);
    } catch (const config::ConfigurationError& error) {
      throw SettingError("scene", error.what());
    }
    if (!simulation_) throw SettingError("scene", diagnostics.text());
    reader_.pass_on(diagnostics);
    ModelReader::use_files(setup, simulation_->model(), simulation_->effects());
    if (std::isfinite(settings_.modulation_frequency))
      throw SettingError("modulation_frequency", "is that of the scene's camera: it cannot be set");
    const tofgraph_camera& own = simulation_->camera();
    const tofgraph_camera* given = setup.stream().camera;
    if (given == nullptr)
      setup.use_profile(own.name, own.profile);
    else if (given->width != own.width || given->height != own.height || std::string(given->name) != own.name)
      throw SettingError("scene", fmt::format("is for the camera '{}', the pipeline has '{}': remove one of the two",
                                              own.name, given->name));
  }

  Delivery open() override {
    if (std::isfinite(settings_.integration_time)) check_integration_time(settings_);
    period_ = 1 / (std::isfinite(settings_.frame_rate) ? settings_.frame_rate : settings_.nominal_frame_rate);
    if (!std::isfinite(period_))
      throw SettingError("frame_rate", "the camera's profile has none, so it has to be given, e.g. frame_rate: 80 Hz");
    if (settings_.condition >= static_cast<std::int64_t>(simulation_->conditions().size()))
      throw SettingError("condition", fmt::format("the scene has {} conditions, counted from 0: {} is not there",
                                                  simulation_->conditions().size(), settings_.condition));
    load(at(0));
    next_ = 0;
    Delivery delivery;
    delivery.channels = {"taps"};
    delivery.known = TOFGRAPH_KNOWS_TIMESTAMP | TOFGRAPH_KNOWS_INTEGRATION_TIME | TOFGRAPH_KNOWS_MODULATION_FREQUENCY;
    delivery.text = fmt::format("simulated camera before {}, {:.6g} frames/s", settings_.scene, 1 / period_);
    return delivery;
  }

  void close() noexcept override {}

  std::string why_not_adjustable() const override { return {}; }
  void set_integration_time(double time) override {
    config::Diagnostics diagnostics;
    auto changed = read_scene(time, diagnostics);
    if (!changed) throw Fault(diagnostics.text(), false);
    prepared_.reset();  // refers to the previous simulation
    simulation_ = std::move(changed);
    load(condition_);
  }

  Got read(Frame& frame, std::chrono::milliseconds patience) override {
    if (!start_) {
      start_ = Clock::now();
      start_ns_ = now_ns();
    }
    // A frame is available when its exposure has ended.
    const auto since_start = [&](std::uint64_t n) { return std::llround(static_cast<double>(n) * period_ * 1e9); };
    keep_up(since_start(next_ + 1));
    const auto due = *start_ + std::chrono::nanoseconds(since_start(next_ + 1));
    std::this_thread::sleep_until(std::min(due, Clock::now() + Clock::duration(patience)));
    if (Clock::now() < due) return Got::nothing;
    const std::uint64_t frames = std::max<std::uint64_t>(simulation_->frames(), 1), shown = next_ / frames;
    const std::uint64_t conditions = settings_.condition < 0 ? simulation_->conditions().size() : 1;
    if (at(shown % conditions) != condition_) load(at(shown % conditions));
    const std::uint64_t index = shown / conditions * frames + next_ % frames;
    const std::uint64_t number = frame.metadata().number;
    frame.metadata() = simulation_->metadata(prepared_->condition, index);
    frame.metadata().number = number;
    frame.metadata().device_number = next_;
    frame.metadata().timestamp_ns = start_ns_ + since_start(next_);
    write_taps(frame, index);
    ++next_;
    return Got::frame;
  }

 private:
  using Clock = std::chrono::steady_clock;

  std::unique_ptr<const simulation::Simulation> read_scene(double integration_time,
                                                           config::Diagnostics& diagnostics) const {
    simulation::SimulationChanges changes;
    changes.host = reader_.host();
    changes.output = {"taps"};
    if (std::isfinite(integration_time)) changes.integration_time = integration_time;
    return simulation::Simulation::read(settings_.scene, reader_.registry(), changes, diagnostics);
  }

  /// Index of the n-th condition to play.
  std::size_t at(std::uint64_t n) const {
    return static_cast<std::size_t>(settings_.condition < 0 ? n : static_cast<std::uint64_t>(settings_.condition));
  }

  void load(std::size_t condition) {
    condition_ = condition;
    prepared_ = simulation_->prepare(condition);
  }

  /// Slows the camera down if the computer cannot simulate in real time: time stamps follow the clock, no frame is lost
  /// and the delay does not accumulate. @param due ns since start
  void keep_up(std::int64_t due) {
    const auto late = Clock::now() - (*start_ + std::chrono::nanoseconds(due));
    if (std::chrono::duration<double>(late).count() < patience_periods * period_) return;
    *start_ += late;
    start_ns_ += std::chrono::duration_cast<std::chrono::nanoseconds>(late).count();
    if (!std::exchange(told_, true))
      stage_.warn(fmt::format("this computer does not simulate {:.6g} frames/s: the camera is slower", 1 / period_));
  }

  void write_taps(const Frame& frame, std::uint64_t index) const {
    tofgraph_channel channel{};
    channel.size = sizeof channel;
    channel.name = "taps";
    channel.type = TOFGRAPH_TYPE_U16;
    channel.rank = 4;
    channel.unit = "counts";
    const std::uint64_t extent[] = {prepared_->frames.exposures(), 2, settings_.layout.rows, settings_.layout.columns};
    std::ranges::copy(extent, channel.extent);
    prepared_->frames.taps(index, static_cast<std::uint16_t*>(frame.write(channel).data));
  }

  const Stage& stage_;
  const Settings& settings_;
  const ModelReader reader_;
  std::unique_ptr<const simulation::Simulation> simulation_;
  std::unique_ptr<const simulation::ConditionFrames> prepared_;
  std::size_t condition_ = 0;
  double period_ = 0;  // s
  std::uint64_t next_ = 0;
  std::optional<Clock::time_point> start_;
  std::int64_t start_ns_ = 0;
  bool told_ = false;
};

}  // namespace

BackendPtr make_simulated(const Stage& stage, const Settings& settings) {
  return std::make_unique<Simulated>(stage, settings);
}

}  // namespace tofgraph::camcube
