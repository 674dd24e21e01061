// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Reads files of other programs: whatever a format plugin recognises, or a layout describes.
#include <tofgraph/physics/exposures.hpp>
#include <tofgraph/stage.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "config/log.hpp"
#include "config/paths.hpp"
#include "foreign/foreign_frames.hpp"
#include "foreign/series.hpp"
#include "io/plausibility.hpp"
#include "io/profile.hpp"

namespace tofgraph {

/// Reads one file, or a series. Information missing in the file is given by the parameters, or by a layout file for
/// more than one array; ambiguity is an error that lists the possible readings. Values become SI; "no measurement"
/// becomes NaN with the flag `invalid`.
struct FileReader final : Source {
  Param<InputFile> file{this, "file", {.text = "the file"}};
  Param<std::string> files{
      this,
      "files",
      {.text =
           "instead of file, a series: a pattern with * and ?, relative to the working folder, or one name per line"}};
  Param<InputFile> layout{this, "layout", {.text = "a layout file, which describes the arrays"}};
  Param<std::string> as{
      this,
      "as",
      {.text = "the channel of the array, e.g. depth; of one of several arrays CHANNEL=ARRAY; several with commas"}};
  Param<std::string> unit{
      this, "unit", {.text = "unit of lengths: the length that a value of 1 stands for, e.g. mm or 0.25 mm"}};
  Param<std::string> axes{this, "axes", {.text = "axes of the array, slowest first, e.g. frame row column"}};
  Param<std::vector<double>> invalid{
      this,
      "invalid",
      {.text = "values that mean no measurement; they apply to the lengths if there are any, e.g. [0, 65535]"}};
  Param<double> integration_time{
      this, "integration_time", {.unit = "s", .min = 0, .text = "integration time of every frame"}};
  Param<double> modulation_frequency{
      this,
      "modulation_frequency",
      {.unit = "Hz", .min = 1, .text = "modulation frequency of every frame; default: the profile's"}};
  Param<double> frame_rate{
      this, "frame_rate", {.unit = "Hz", .min = 1e-6, .text = "frame rate from which the time stamps follow"}};

  void prepare(Setup& setup) {
    registry_ = std::make_unique<graph::PluginRegistry>(config::split_path(host->plugin_path(context)));
    foreign::ForeignRequest request{.files = {}, .layout = stated(), .camera = {}};
    if (const tofgraph_camera* given = setup.stream().camera; given != nullptr)
      request.camera = std::make_shared<const io::Camera>(*given);
    try {
      if (file.given() == files.given()) throw ConfigError("file", "give a file, or files: 'depth_*.png' for a series");
      request.files = foreign::files_of(file.given() ? std::string(*file) : std::string(*files));
      if (!request.camera && !request.layout.camera.empty()) request.camera = stated_camera(request.layout.camera);
      for (const auto& path : request.files) setup.uses_file(path.string());
      frames_ = std::make_unique<foreign::ForeignFrames>(*registry_, std::move(request));
    } catch (const foreign::ForeignError& error) {
      throw ConfigError(file.given() ? "file" : "files", error.what());
    } catch (const config::ConfigurationError& error) {
      throw ConfigError(file.given() ? "file" : "files", error.what());
    }
    for (const std::string& warning : frames_->warnings()) warn(warning);
    if (setup.stream().camera == nullptr) setup.use_profile(frames_->camera().name, frames_->camera().profile);
    std::vector<tofgraph_metadata> known;
    for (std::uint64_t i = 0; i < std::min<std::uint64_t>(frames_->frames(), 100000); ++i)
      known.push_back(frames_->metadata(i));
    for (const std::string& doubt : io::metadata_doubts(known, &frames_->camera())) warn(doubt);
    for (const foreign::ForeignChannel& channel : frames_->channels()) setup.provide(described(channel));
    setup.set_frames(frames_->frames(), frames_->known());
  }

  bool process(Frame& frame) {
    if (next_ == frames_->frames()) return false;
    const tofgraph_metadata known = frames_->metadata(next_);
    tofgraph_metadata& metadata = frame.metadata();
    metadata.device_number = known.device_number;
    metadata.timestamp_ns = known.timestamp_ns;
    metadata.integration_time = known.integration_time;
    metadata.modulation_frequency = known.modulation_frequency;
    metadata.time_since_power_on = known.time_since_power_on;
    const std::vector<foreign::ForeignChannel>& channels = frames_->channels();
    std::uint16_t* flags = nullptr;
    for (const foreign::ForeignChannel& channel : channels) {
      if (channel.name != "flags") continue;
      const Array<std::uint16_t> bits(frame.write(described(channel)));
      std::fill(bits.begin(), bits.end(), std::uint16_t{0});
      flags = bits.data();
    }
    for (std::size_t i = channels.size(); i-- > 0;) {  // flags of the file first, because other channels add to them
      void* out = channels[i].name == "flags" ? flags : frame.write(described(channels[i])).data;
      frames_->read(next_, i, out, flags);
      if (next_ == 0 && is_image_of_lengths(channels[i].name)) check_lengths(channels[i].name, frame);
    }
    ++next_;
    return true;
  }

  void finish() const {
    for (std::size_t i = 0; i < frames_->channels().size(); ++i)
      for (const std::string& doubt : frames_->doubts(i)) warn(doubt);
  }

 private:
  static bool is_image_of_lengths(const std::string& name) { return is_length_channel(name) && name != "points"; }

  /// Warns if the lengths of the first frame appear to be in another unit.
  void check_lengths(const std::string& name, const Frame& frame) const {
    const Array<const float> lengths(frame.find(name.c_str()));
    const tofgraph_camera& camera = frames_->camera();
    const double range =
        io::expected_range(physics::exposures_of(camera), frame.metadata().modulation_frequency, &camera);
    const std::string doubt = io::length_doubt(name, {lengths.begin(), lengths.end()}, range);
    const double most = measuring_range(camera);
    const std::string beyond = io::range_doubt(name, {lengths.begin(), lengths.end()}, most, range);
    if (!doubt.empty() || !beyond.empty()) warn(doubt.empty() ? beyond : doubt);
  }

  /// Largest length of the data sheet, m; NaN: the profile does not state it.
  static double measuring_range(const tofgraph_camera& camera) {
    config::Diagnostics ignored;  // the profile has been read without errors before
    const std::string text = camera.profile != nullptr ? camera.profile : "";
    const io::CameraPtr profile =
        text.empty() ? nullptr : io::read_profile(config::parse_document("profile", text), ignored);
    return profile ? profile->data_sheet.measuring_range[1] : std::nan("");
  }

  /// Camera of the layout: a profile or a device folder. @throws config::ConfigurationError
  io::CameraPtr stated_camera(const std::string& name) const {
    config::Diagnostics diagnostics;
    io::CameraPtr camera = io::find_camera({.kind = config::Value::Kind::scalar, .text = name}, diagnostics);
    if (!camera) throw config::ConfigurationError(diagnostics);
    for (const config::Diagnostic& warning : diagnostics.all()) warn(warning.message);
    return camera;
  }

  static tofgraph_channel described(const foreign::ForeignChannel& channel) {
    tofgraph_channel made{};
    made.size = sizeof made;
    made.name = channel.name.c_str();
    made.type = channel.type;
    made.rank = static_cast<std::uint32_t>(channel.extent.size());
    std::ranges::copy(channel.extent, made.extent);
    made.unit = channel.unit.c_str();
    made.of = channel.of.c_str();
    made.applied = made.from = "";
    return made;
  }

  /// Layout from the file, completed by the parameters.
  foreign::Layout stated() const {
    foreign::Layout result;
    if (layout.given()) {
      try {
        result = foreign::read_layout(std::string(*layout));
      } catch (const config::ConfigurationError& error) {
        throw ConfigError("layout", error.what());
      }
    }
    if (as.given()) {
      result.channels.clear();
      const std::string list(*as);
      for (std::size_t at = 0; at <= list.size();) {
        const std::size_t end = std::min(list.find(',', at), list.size());
        add_channel(list.substr(at, end - at), result);
        at = end + 1;
      }
    }
    if (result.channels.empty() && (unit.given() || axes.given() || invalid.given()))
      throw ConfigError("as", "must name the channel of the array, e.g. as: depth");
    // Unit and "not measured" value apply to lengths, if there are any: an amplitude may well be 0.
    const auto is_length = [](const foreign::ChannelLayout& channel) {
      return is_length_channel(channel.channel) || channel.channel == "sigma";
    };
    const bool lengths = std::ranges::any_of(result.channels, is_length);
    for (foreign::ChannelLayout& channel : result.channels) {
      if (unit.given() && (is_length(channel) || result.channels.size() == 1)) channel.unit = std::string(*unit);
      if (invalid.given() && (is_length(channel) || !lengths)) {
        channel.invalid = *invalid;
        std::ranges::sort(channel.invalid);
      }
      if (!axes.given()) continue;
      const auto parsed = foreign::parse_axes(std::string(*axes));
      if (!parsed)
        throw ConfigError("axes", "has an unknown name, or one twice; names: frame exposure tap row column coordinate");
      channel.axes = *parsed;
    }
    if (integration_time.given()) result.integration_time.value = *integration_time;
    if (modulation_frequency.given()) result.modulation_frequency.value = *modulation_frequency;
    if (frame_rate.given()) result.frame_rate = *frame_rate;
    return result;
  }

  static void add_channel(std::string text, foreign::Layout& layout) {
    std::erase(text, ' ');
    const std::size_t equal = text.find('=');
    const std::string channel = text.substr(0, equal);
    if (std::ranges::find(foreign::layout_channels, std::string_view(channel)) == std::end(foreign::layout_channels))
      throw ConfigError("as",
                        "'" + channel +
                            "' is not a channel; channels: depth range distance points amplitude intensity phases "
                            "taps sigma flags");
    layout.channels.push_back({.channel = channel, .array = equal == std::string::npos ? "" : text.substr(equal + 1)});
  }

  std::unique_ptr<graph::PluginRegistry> registry_;  // the frames refer to it
  std::unique_ptr<foreign::ForeignFrames> frames_;
  std::uint64_t next_ = 0;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::FileReader, "Reads files of other programs: arrays, pictures, tables, headerless dumps")
