// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tofgraph/stage.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <thread>

#include "config/log.hpp"
#include "devices/camcube/frame_exchange.hpp"
#include "devices/camcube/raw_output.hpp"
#include "io/captures/capture.hpp"

namespace tofgraph::camcube {
namespace {

using Clock = std::chrono::steady_clock;

// Limits of a recorded pause: this number of periods, and in any case at least this time, ns.
constexpr std::int64_t periods_in_a_pause = 10, min_longest_pause = 5'000'000'000;
constexpr std::int64_t longest_period = 86400 * 1'000'000'000LL;

/// A recording played back as a camera.
class Recording {
 public:
  Recording() = default;
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;
  virtual ~Recording() = default;
  virtual std::size_t frames() const = 0;
  virtual tofgraph_metadata metadata(std::size_t frame) const = 0;
  virtual void read(std::size_t index, const Frame& frame) = 0;
};

tofgraph_channel described(const io::CaptureChannel& recorded) {
  tofgraph_channel channel{};
  channel.size = sizeof channel;
  channel.name = recorded.name.c_str();
  channel.type = recorded.type;
  channel.rank = static_cast<std::uint32_t>(recorded.extent.size());
  std::ranges::copy(recorded.extent, channel.extent);
  channel.unit = recorded.unit.c_str();
  channel.applied = recorded.applied.c_str();
  channel.from = recorded.from.c_str();
  return channel;
}

class CaptureRecording final : public Recording {
 public:
  CaptureRecording(const io::CaptureReader& reader, std::size_t channel) : reader_(reader), channel_(channel) {}
  std::size_t frames() const override { return reader_.frames(); }
  tofgraph_metadata metadata(std::size_t frame) const override { return reader_.metadata(frame); }
  void read(std::size_t index, const Frame& frame) override {
    reader_.read(channel_, index, frame.write(described(reader_.channels()[channel_])).data);
  }

 private:
  const io::CaptureReader& reader_;
  std::size_t channel_;
};

class DumpRecording final : public Recording {
 public:
  explicit DumpRecording(const Settings& settings)
      : settings_(settings), in_(settings.file, std::ios::binary), buffer_(settings.layout.frame_bytes()) {
    const auto size = std::filesystem::file_size(settings.file);
    frames_ = size / buffer_.size();
    if (frames_ == 0 || size % buffer_.size() != 0)
      throw SettingError(
          "file", fmt::format("{} has {} bytes, which is not a whole number of frames of {} ({} x {} px) "
                              "and it is not a capture either",
                              settings.file, size, buffer_.size(), settings.layout.columns, settings.layout.rows));
  }
  std::size_t frames() const override { return frames_; }
  tofgraph_metadata metadata(std::size_t frame) const override {
    tofgraph_metadata metadata{};
    metadata.size = sizeof metadata;
    metadata.device_number = frame;
    metadata.integration_time = settings_.integration_time;
    metadata.modulation_frequency =
        std::isfinite(settings_.modulation_frequency) ? settings_.modulation_frequency : settings_.nominal_frequency;
    metadata.temperature = metadata.time_since_power_on = std::nan("");
    return metadata;
  }
  void read(std::size_t index, const Frame& frame) override {
    in_.seekg(static_cast<std::streamoff>(index * buffer_.size()));
    in_.read(reinterpret_cast<char*>(buffer_.data()), static_cast<std::streamsize>(buffer_.size()));
    if (!in_) throw Fault("cannot read " + settings_.file + " to its end: it became shorter while it was read", true);
    write_raw(settings_.layout, buffer_, frame);
  }

 private:
  const Settings& settings_;
  std::ifstream in_;
  std::vector<std::uint8_t> buffer_;
  std::size_t frames_ = 0;
};

class Replay final : public Backend {
 public:
  Replay(const Stage& stage, const Settings& settings) : stage_(stage), settings_(settings) {}

  void prepare(Setup& setup) override {
    if (settings_.file.empty()) throw SettingError("file", "a replay needs a recording, e.g. file: board.h5");
    std::error_code error;
    if (std::filesystem::exists(settings_.file, error) && !std::filesystem::is_regular_file(settings_.file, error))
      throw SettingError("file", settings_.file + " is not a file");
    char head[8] = {};
    if (!std::ifstream(settings_.file, std::ios::binary).read(head, sizeof head))
      throw SettingError("file", "cannot read " + settings_.file);
    if (std::string_view(head, sizeof head) != "\x89HDF\r\n\x1a\n") return;
    for (const auto& [name, value] : {std::pair{"integration_time", settings_.integration_time},
                                      std::pair{"modulation_frequency", settings_.modulation_frequency}}) {
      if (std::isfinite(value))
        throw SettingError(name, settings_.file + " is fixed by the recording: it cannot be set");
    }
    try {
      capture_ = std::make_unique<io::CaptureReader>(settings_.file);
    } catch (const std::exception& problem) {
      throw SettingError("file", problem.what());
    }
    choose_camera(setup);
  }

  Delivery open() override {
    Delivery delivery;
    if (capture_) {
      const std::size_t channel = raw_channel();
      delivery.recorded = {described(capture_->channels()[channel])};
      delivery.known = capture_->known(0, capture_->frames() - 1);
      delivery.serial = capture_->header().serial;
      recording_ = std::make_unique<CaptureRecording>(*capture_, channel);
    } else {
      delivery.channels = {"taps", "raw_headers"};
      recording_ = std::make_unique<DumpRecording>(settings_);
      const tofgraph_metadata first = recording_->metadata(0);
      if (std::isfinite(first.integration_time)) delivery.known |= TOFGRAPH_KNOWS_INTEGRATION_TIME;
      if (std::isfinite(first.modulation_frequency)) delivery.known |= TOFGRAPH_KNOWS_MODULATION_FREQUENCY;
    }
    has_times_ = (delivery.known & TOFGRAPH_KNOWS_TIMESTAMP) != 0;
    period_ = 1 / (std::isfinite(settings_.frame_rate) ? settings_.frame_rate : settings_.nominal_frame_rate);
    if (!has_times_) {
      if (!std::isfinite(period_))
        throw SettingError("frame_rate", settings_.file +
                                             " has no time stamps, and the camera's profile no frame rate: "
                                             "give it, e.g. frame_rate: 80 Hz");
      stage_.note(fmt::format("{} has no time stamps: it is played at {} frames/s", settings_.file, 1 / period_));
      delivery.known |= TOFGRAPH_KNOWS_TIMESTAMP;
    }
    delivery.frames = settings_.loop ? 0 : recording_->frames();
    delivery.live = settings_.at_recorded_pace;
    delivery.text = fmt::format("recording {} ({}{}{})", settings_.file, config::counted(recording_->frames(), "frame"),
                                settings_.at_recorded_pace ? ", at its own speed" : ", as fast as possible",
                                settings_.loop ? ", looped" : "");
    if (has_times_)
      learn_pace();
    else
      pauses_.assign(recording_->frames(), std::llround(period_ * 1e9));
    next_ = round_ = 0;
    due_.reset();
    return delivery;
  }

  void close() noexcept override { recording_.reset(); }

  Got read(Frame& frame, std::chrono::milliseconds patience) override {
    if (next_ == recording_->frames()) {
      if (!settings_.loop) return Got::end;
      next_ = 0;
      ++round_;
    }
    if (settings_.at_recorded_pace && !is_due(patience)) return Got::nothing;
    const std::uint64_t number = frame.metadata().number;
    frame.metadata() = recording_->metadata(next_);
    frame.metadata().number = number;
    frame.metadata().device_number += round_ * (recording_->metadata(recording_->frames() - 1).device_number + 1 -
                                                recording_->metadata(0).device_number);
    frame.metadata().timestamp_ns = has_times_ ? recorded_time() : now_ns();
    recording_->read(next_, frame);
    ++next_;
    if (due_) *due_ += std::chrono::nanoseconds(pauses_[next_ % pauses_.size()]);
    return Got::frame;
  }

 private:
  void choose_camera(const Setup& setup) const {
    const io::CaptureHeader& header = capture_->header();
    const tofgraph_camera* camera = setup.stream().camera;
    if (camera == nullptr && !setup.use_profile(header.camera, header.profile))
      throw SettingError("file",
                         fmt::format("there is no profile for the capture's camera '{}': give one, e.g. --camera "
                                     "./camera.yaml",
                                     header.camera));
    const tofgraph_camera& chosen = setup.camera();
    if (chosen.width != header.width || chosen.height != header.height)
      throw SettingError("file", fmt::format("the capture is {} x {} px, the camera '{}' has {} x {} px", header.width,
                                             header.height, chosen.name, chosen.width, chosen.height));
    if (!header.exposures.empty()) setup.set_exposures(header.exposures);
  }

  std::size_t raw_channel() const {
    for (const char* wanted : {"taps", "phases"}) {
      for (std::size_t i = 0; i < capture_->channels().size(); ++i)
        if (capture_->channels()[i].name == wanted) return i;
    }
    throw SettingError(
        "file",
        fmt::format("{} has neither taps nor phases, which a camera delivers; capture_reader reads its distances",
                    settings_.file));
  }

  /// Derives the pace from time stamps, which are not reliable: they may decrease, or jump by years.
  void learn_pace() {
    pauses_.assign(recording_->frames(), 0);
    for (std::size_t i = 1; i < pauses_.size(); ++i) {
      const std::int64_t before = recording_->metadata(i - 1).timestamp_ns, now = recording_->metadata(i).timestamp_ns;
      if (__builtin_sub_overflow(now, before, &pauses_[i])) pauses_[i] = -1;
    }
    std::vector<std::int64_t> forward;
    std::ranges::copy_if(pauses_, std::back_inserter(forward), [](std::int64_t pause) { return pause > 0; });
    std::ranges::sort(forward);
    const std::int64_t nominal = std::isfinite(period_) ? std::llround(period_ * 1e9) : 0;
    const std::int64_t typical = forward.empty() ? nominal : std::min(forward[forward.size() / 2], longest_period);
    const std::int64_t longest = std::max(periods_in_a_pause * typical, min_longest_pause);
    const auto back = std::ranges::count_if(pauses_, [](std::int64_t pause) { return pause < 0; });
    const auto cut = std::ranges::count_if(pauses_, [&](std::int64_t pause) { return pause > longest; });
    for (std::int64_t& pause : pauses_) pause = std::clamp<std::int64_t>(pause, 0, longest);
    pauses_.front() = typical;  // a repetition begins one frame after the end of the previous one
    if (settings_.at_recorded_pace && back + cut > 0)
      stage_.warn(
          fmt::format("{}: {} of its time stamps {} before the one of the frame before, {} of its pauses {} cut "
                      "to {} s",
                      settings_.file, back, back == 1 ? "is" : "are", cut, cut == 1 ? "is" : "are",
                      static_cast<double>(longest) * 1e-9));
  }

  /// Recorded time of the next frame; each repetition begins one frame after the end of the previous one. Wraps around.
  std::int64_t recorded_time() const {
    const auto stamp = [this](std::size_t i) {
      return static_cast<std::uint64_t>(recording_->metadata(i).timestamp_ns);
    };
    const std::uint64_t round =
        stamp(recording_->frames() - 1) - stamp(0) + static_cast<std::uint64_t>(pauses_.front());
    return static_cast<std::int64_t>(stamp(next_) + round_ * round);
  }

  /// Waits until the next frame is due, but no longer than `patience`.
  bool is_due(std::chrono::milliseconds patience) {
    const auto now = Clock::now();
    if (!due_) due_ = now;
    std::this_thread::sleep_until(std::min(*due_, now + std::chrono::steady_clock::duration(patience)));
    return Clock::now() >= *due_;
  }

  const Stage& stage_;
  const Settings& settings_;
  std::unique_ptr<const io::CaptureReader> capture_;
  std::unique_ptr<Recording> recording_;
  bool has_times_ = false;
  double period_ = 0;  // s, if there are no time stamps
  std::size_t next_ = 0, round_ = 0;
  std::vector<std::int64_t> pauses_;  // ns, before each frame
  std::optional<Clock::time_point> due_;
};

}  // namespace

BackendPtr make_replay(const Stage& stage, const Settings& settings) {
  return std::make_unique<Replay>(stage, settings);
}

}  // namespace tofgraph::camcube
