// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Frames of a recording, with the recorded meaning of their channels.
#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/exposures.hpp>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <sstream>

#include "config/json_text.hpp"
#include "config/log.hpp"
#include "io/captures/capture.hpp"
#include "io/captures/plausibility.hpp"
#include "io/light_sources.hpp"
#include "io/refused_lengths.hpp"

namespace tofgraph {

/// Channels are read as recorded; flags of one byte become two. If there is a length channel there are flags too, and
/// the two are made consistent: an invalid pixel is NaN in every length channel and has the flag `invalid`, whichever
/// of the two was recorded. Recorded lengths of zero, below zero or beyond max_length become invalid pixels.
struct CaptureReader final : Source {
  Param<InputFile> file{
      this, "file", {.required = true, .text = "a capture (.h5), or one that is still being recorded (.h5.part)"}};
  Param<std::string> channels{this,
                              "channels",
                              {.text = "which to read, e.g. [range, amplitude]; default: all but a simulation's truth. "
                                       "Lengths come with their flags"}};
  Param<std::vector<double>> frames{this, "frames", {.min = 0, .text = "first and last, e.g. [0, 19]; default: all"}};
  Param<Choice> exposures{
      this,
      "exposures",
      {.default_value = "recording",
       .choices = "recording camera",
       .text = "which to use: the recording's if it has its own, or those of the camera's profile"}};
  Param<std::string> sources{
      this, "sources", {.text = "the light sources that were on, e.g. left; default: as recorded, or all"}};

  void prepare(Setup& setup) {
    try {
      reader_ = std::make_unique<io::CaptureReader>(std::string(*file));
    } catch (const std::exception& problem) {
      throw ConfigError("file", problem.what());
    }
    choose_frames();
    choose_channels();
    choose_camera(setup);
    choose_exposures(setup);
    choose_sources(setup);
    for (const Chosen& chosen : chosen_) setup.provide(described(chosen.channel));
    setup.set_frames(last_ - next_ + 1, reader_->known(next_, last_));
    describe_source();
    if (!reader_->finished())
      warn(fmt::format("{} is still being recorded or was cut off: {} complete", *file,
                       config::counted(reader_->frames(), "frame")));
    for (const std::string& name : reader_->ignored()) warn(fmt::format("{}: '{}' is not a channel", *file, name));
    for (const std::string& doubt : io::doubts_of(*reader_, next_, last_, setup.stream().camera))
      warn(fmt::format("{}: {}", *file, doubt));
  }

  bool process(Frame& frame) {
    if (next_ > last_) return false;
    const std::uint64_t number = frame.metadata().number;
    frame.metadata() = reader_->metadata(next_);
    frame.metadata().number = number;
    std::vector<tofgraph_view> views;
    for (const Chosen& chosen : chosen_) {
      const tofgraph_view& view = views.emplace_back(frame.write(described(chosen.channel)));
      if (chosen.index)
        reader_->read(*chosen.index, next_, view.data);
      else
        std::fill_n(static_cast<std::uint16_t*>(view.data), chosen.channel.elements(), std::uint16_t{0});
    }
    refuse_no_lengths(views);
    agree(views);
    ++next_;
    ++read_;
    return true;
  }

  void finish() const {
    for (const auto& [channel, found] : refused_) {
      if (found.lengths.count == 0) continue;
      warn(
          fmt::format("{}: {}", *file, found.lengths.sentence(channel, found.values, config::counted(read_, "frame"))));
    }
  }

 private:
  struct Chosen {
    io::CaptureChannel channel;
    std::optional<std::size_t> index;  ///< in the capture; nothing: flags that the capture lacks
  };

  /// Returns whether a channel is simulated ground truth, which would conflict with computed channels.
  static bool is_truth(const io::CaptureChannel& channel) { return channel.applied == "truth"; }

  /// Number of recorded values of a channel, and those that are numbers but not valid lengths.
  struct Refused {
    std::size_t values = 0;
    io::RefusedLengths lengths;
  };

  static tofgraph_channel described(const io::CaptureChannel& channel) {
    tofgraph_channel result{};
    result.name = channel.name.c_str();
    result.type = channel.type;
    result.rank = static_cast<std::uint32_t>(channel.extent.size());
    std::ranges::copy(channel.extent, result.extent);
    result.unit = channel.unit.c_str();
    result.of = channel.of.c_str();
    result.applied = channel.applied.c_str();
    result.from = channel.from.c_str();
    return result;
  }

  /// Announces serial number, time and temperatures of the recording, as far as known.
  void describe_source() const {
    nlohmann::json source = nlohmann::json::object();
    if (const std::string& serial = reader_->header().serial; !serial.empty()) source["serial"] = serial;
    if (const std::int64_t start = reader_->metadata(next_).timestamp_ns; start > 0)
      source["recorded_at"] = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(start / 1'000'000'000));
    double coldest = reader_->metadata(next_).temperature, warmest = coldest;
    for (std::size_t frame = next_; frame <= last_; ++frame) {
      coldest = std::fmin(coldest, reader_->metadata(frame).temperature);
      warmest = std::fmax(warmest, reader_->metadata(frame).temperature);
    }
    if (coldest > 0) source["temperature"] = {coldest, warmest};  // K
    if (!source.empty()) host->set_source(context, config::json_text(source).c_str());
  }

  void choose_frames() {
    next_ = 0;
    last_ = reader_->frames() - 1;
    if (!frames.given()) return;
    const auto whole = [](double value) { return value == std::floor(value); };
    if (frames->size() != 2 || !std::ranges::all_of(*frames, whole) || (*frames)[0] > (*frames)[1])
      throw ConfigError("frames", "expected the first and the last frame, e.g. frames: [0, 19]");
    if ((*frames)[1] > static_cast<double>(last_)) {
      throw ConfigError("frames",
                        fmt::format("the capture has the frames 0 to {}; there is no frame {}", last_, (*frames)[1]));
    }
    next_ = static_cast<std::size_t>((*frames)[0]);
    last_ = static_cast<std::size_t>((*frames)[1]);
  }

  void choose_channels() {
    const auto& all = reader_->channels();
    std::istringstream words(*channels);
    std::vector<std::string> wanted(std::istream_iterator<std::string>(words), {});
    for (const std::string& name : wanted) {
      if (std::ranges::find(all, name, &io::CaptureChannel::name) != all.end()) continue;
      std::vector<std::string> names;
      for (const auto& channel : all) names.push_back(channel.name);
      throw ConfigError("channels", fmt::format("the capture has no '{}', it has {}", name, fmt::join(names, ", ")));
    }
    if (wanted.empty()) {
      for (const auto& channel : all) {
        if (!is_truth(channel)) wanted.push_back(channel.name);
      }
    }
    if (std::ranges::any_of(wanted, is_length_channel)) wanted.emplace_back("flags");
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (std::ranges::count(wanted, all[i].name) > 0) chosen_.push_back({all[i], i});
    }
    const bool has_flags = std::ranges::count(all, "flags", &io::CaptureChannel::name) > 0;
    if (has_flags || std::ranges::count(wanted, "flags") == 0) return;
    const auto& header = reader_->header();
    chosen_.push_back({{"flags", TOFGRAPH_TYPE_U16, {header.height, header.width}, "", "", "", ""}, std::nullopt});
  }

  void choose_camera(const Setup& setup) const {
    const io::CaptureHeader& header = reader_->header();
    const tofgraph_camera* camera = setup.stream().camera;
    if (camera == nullptr) {
      if (setup.use_profile(header.camera, header.profile)) return check_profile(setup.camera());
      if (!header.profile.empty()) return;  // the host reports errors in the text
      warn(fmt::format("there is no profile for the capture's camera '{}': stages that need one will fail",
                       header.camera));
      return;
    }
    if (camera->width != header.width || camera->height != header.height) {
      throw ConfigError(
          "file", fmt::format("the capture is {} x {} px (camera '{}'), the pipeline's camera '{}' is {} x {} px",
                              header.width, header.height, header.camera, camera->name, camera->width, camera->height));
    }
    if (header.camera != camera->name)
      warn(fmt::format("the capture is of the camera '{}', the pipeline's '{}' is used", header.camera, camera->name));
  }

  /// Exposures stated by the capture take precedence over the profile's.
  void choose_exposures(const Setup& setup) const {
    const physics::Exposures& own = reader_->header().exposures;
    if (own.empty() || *exposures == "camera") return;
    setup.set_exposures(own);
    const tofgraph_camera* camera = setup.stream().camera;
    if (camera == nullptr || camera->exposure_count == 0) return;
    if (!physics::same_exposures(own, physics::exposures_of(*camera)))
      warn(
          fmt::format("the exposures of the capture ({}) are not those of the profile '{}': the capture's are used; "
                      "exposures: camera uses those of the profile",
                      own.size(), camera->name));
  }

  /// Restricts the camera to the sources that were on, for distance models.
  void choose_sources(const Setup& setup) const {
    const std::vector<std::string>& recorded = reader_->header().sources;
    std::istringstream words(*sources);
    const std::vector<std::string> given(std::istream_iterator<std::string>(words), {});
    const tofgraph_camera* camera = setup.stream().camera;
    if (camera == nullptr || (given.empty() && recorded.empty())) return;
    const std::vector<std::string> known = io::source_names(*camera);
    const auto unknown = [&](const std::vector<std::string>& names) {
      return std::ranges::find_if(names,
                                  [&](const std::string& n) { return std::ranges::find(known, n) == known.end(); });
    };
    if (const auto name = unknown(given); name != given.end())
      throw ConfigError("sources", fmt::format("the camera '{}' has no source '{}', it has {}", camera->name, *name,
                                               fmt::join(known, ", ")));
    if (const auto name = unknown(recorded); name != recorded.end())
      return warn(
          fmt::format("{}: recorded with the source '{}', which the camera '{}' does not have ({}): all sources "
                      "of the camera are used",
                      *file, *name, camera->name, fmt::join(known, ", ")));
    if (!given.empty() && !recorded.empty() && !io::same_sources(*camera, given, recorded))
      throw ConfigError("sources", fmt::format("are {}, but the capture was recorded with {}", fmt::join(given, ", "),
                                               fmt::join(recorded, ", ")));
    io::use_sources(setup, given.empty() ? recorded : given);
  }

  void check_profile(const tofgraph_camera& camera) const {
    const io::CaptureHeader& header = reader_->header();
    if (camera.width == header.width && camera.height == header.height) return;
    throw ConfigError("file", fmt::format("the capture is {} x {} px, the {} '{}' has {} x {} px: give a profile "
                                          "of the right size, e.g. --camera ./cropped.yaml, or camera: ./cropped.yaml "
                                          "at the top of the pipeline file",
                                          header.width, header.height,
                                          header.profile.empty() ? "profile of its camera" : "profile in it",
                                          camera.name, camera.width, camera.height));
  }

  /// Sets invalid lengths to NaN and counts them.
  void refuse_no_lengths(const std::vector<tofgraph_view>& views) {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < views.size(); ++i) {
      const io::CaptureChannel& channel = chosen_[i].channel;
      if (!is_length_channel(channel.name)) continue;
      const std::span<float> values(static_cast<float*>(views[i].data), channel.elements());
      Refused& all = refused_[channel.name];
      if (channel.name == "points") {
        const PointRule rule(channel.applied);
        for (std::size_t k = 0; k + 3 <= values.size(); k += 3) {
          const std::span<float> point = values.subspan(k, 3);
          if (rule.is_valid(point.data()) || std::ranges::any_of(point, [](float v) { return std::isnan(v); }))
            continue;
          const bool origin = point[0] == 0 && point[1] == 0 && point[2] == 0;
          all.lengths.add(origin ? 0 : std::numeric_limits<float>::infinity());
          std::ranges::fill(point, nan);
        }
      } else {
        for (float& value : values) {
          if (is_valid_length(value)) continue;
          all.lengths.add(value);
          value = nan;
        }
      }
      all.values += channel.name == "points" ? values.size() / 3 : values.size();
    }
  }

  /// Makes flags and lengths consistent: a pixel that has the flag invalid or is NaN in a length channel gets both.
  void agree(const std::vector<tofgraph_view>& views) const {
    std::uint16_t* flags = nullptr;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (chosen_[i].channel.name == "flags") flags = static_cast<std::uint16_t*>(views[i].data);
    }
    if (flags == nullptr) return;
    const std::size_t pixels = std::size_t{reader_->header().width} * reader_->header().height;
    const auto each_length = [&](bool with_sigma, auto&& call) {
      for (std::size_t i = 0; i < views.size(); ++i) {
        const std::string& name = chosen_[i].channel.name;
        if (!is_length_channel(name) && !(with_sigma && name == "sigma")) continue;
        const std::size_t values = chosen_[i].channel.elements() / pixels;
        auto* data = static_cast<float*>(views[i].data);
        for (std::size_t k = 0; k < pixels; ++k) call(flags[k], std::span(data + k * values, values));
      }
    };
    each_length(false, [](std::uint16_t& flag, std::span<float> values) {
      if ((flag & flag::filled) != 0) return;  // valid in the filled channel, unknown in the other lengths
      if (std::ranges::any_of(values, [](float v) { return std::isnan(v); })) flag |= flag::invalid;
    });
    each_length(true, [](std::uint16_t flag, std::span<float> values) {
      if ((flag & flag::invalid) != 0) std::ranges::fill(values, std::numeric_limits<float>::quiet_NaN());
    });
  }

  std::unique_ptr<io::CaptureReader> reader_;
  std::vector<Chosen> chosen_;
  std::map<std::string, Refused> refused_;  // by channel
  std::size_t next_ = 0, last_ = 0, read_ = 0;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::CaptureReader, "Frames of a recording (HDF5)")
