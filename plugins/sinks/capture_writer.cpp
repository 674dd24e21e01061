// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Records the incoming channels and their meaning in a capture that can be read again.
#include <tofgraph/physics/exposures.hpp>
#include <tofgraph/stage.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <sstream>

#include "io/captures/queued_capture.hpp"
#include "io/light_sources.hpp"
#include "plugins/calibrated_serial.hpp"

namespace tofgraph {

/// While the stage runs, the file is called PATH.part and can be read; data already written survive a crash. A separate
/// thread writes, so that a temporarily slow disk blocks nothing. The provenance is written at the end, when the hashes
/// of long inputs are ready, so that no frame waits for them. The rays are not recorded: they follow from the camera's
/// profile, whose text is.
struct CaptureWriter final : Sink {
  In<void> every{this, "*", {.text = "what is recorded"}};
  Param<OutputFile> path{this, "path", {.required = true, .text = "the capture, e.g. out/scene.h5"}};
  Param<std::string> channels{this, "channels", {.text = "which to record, e.g. [distance, amplitude]; default: all"}};
  Param<std::int64_t> compression{
      this, "compression", {.default_value = "0", .min = 0, .max = 9, .text = "0: none, 1: fast, 9: small"}};
  Param<std::string> comment{this, "comment", {.text = "kept in the capture"}};
  Param<std::string> sources{
      this,
      "sources",
      {.text = "the light sources that were on, kept in the capture; default: those of the camera "
               "that arrives"}};
  Param<std::int64_t> write_behind{this,
                                   "write_behind",
                                   {.default_value = "256",
                                    .min = 0,
                                    .max = 65536,
                                    .text = "MB of frames that may wait for a slow disk; then the source has to wait, "
                                            "or a live one to drop frames. 0: one frame"}};

  void prepare(Setup& setup) {
    options_ = {static_cast<int>(*compression), setup.overwrite()};
    const std::string problem = io::CaptureWriter::problem(std::string(*path), options_.overwrite);
    if (!problem.empty()) throw ConfigError("path", problem);
    static_cast<void>(provenance());  // starts the hashing in the background
    const tofgraph_camera* camera = setup.stream().camera;
    header_.camera = camera != nullptr ? camera->name : "unknown";
    header_.profile = camera != nullptr && camera->profile != nullptr ? camera->profile : "";
    header_.comment = *comment;
    std::istringstream listed(*sources);
    header_.sources.assign(std::istream_iterator<std::string>(listed), {});
    if (header_.sources.empty() && camera != nullptr) header_.sources = io::source_names(*camera);
    header_.serial = serial_of(setup);
    const physics::Exposures exposures = physics::exposures_of(setup.exposures());
    // If the capture states no exposures, its reader uses the profile's.
    const bool same = camera == nullptr || physics::same_exposures(exposures, physics::exposures_of(*camera));
    if (!same || !physics::are_default(exposures)) header_.exposures = exposures;
    std::istringstream words(*channels);
    const std::vector<std::string> wanted(std::istream_iterator<std::string>(words), {});
    for (const std::string& name : wanted) {
      if (setup.find(name) == nullptr || name == "rays")
        throw ConfigError("channels", fmt::format("'{}' cannot be recorded: what arrives has {}", name, names(setup)));
    }
    for (const tofgraph_channel& channel : setup.channels()) {
      const std::string_view name = channel.name;
      if (name != "rays" && (wanted.empty() || std::ranges::count(wanted, name) > 0)) choose(channel);
    }
    const bool measured = std::ranges::any_of(chosen_, is_measurement);
    if (!measured) {
      throw ConfigError(
          "channels",
          fmt::format(
              "a capture needs at least one of taps, phases, distance, range, depth, amplitude, intensity, points "
              "of an image; what "
              "would be recorded is {}",
              names(setup)));
    }
  }

  void process(Frame& frame) {
    if (!writer_) {
      writer_ = std::make_unique<io::QueuedCapture>(
          std::make_unique<io::CaptureWriter>(std::string(*path), header_, chosen_, options_),
          static_cast<std::size_t>(*write_behind) * 1'000'000);
    }
    std::vector<tofgraph_view> views;
    for (const io::CaptureChannel& channel : chosen_) views.push_back(frame.find(channel.name.c_str()));
    writer_->append(frame.metadata(), views);
  }

  void finish() {
    if (writer_)
      writer_->finish(provenance());
    else
      warn("no frames arrived: " + *path + " is not written");
  }

 private:
  /// Returns whether a channel is an image of the camera. Unorganised points have one row and are not.
  static bool is_measurement(const io::CaptureChannel& channel) {
    const std::string_view name = channel.name;
    return (name == "points" && channel.extent.size() == 3 && channel.extent[0] > 1) || name == "taps" ||
           name == "phases" || name == "distance" || name == "range" || name == "depth" || name == "amplitude" ||
           name == "intensity";
  }

  static std::string names(const Setup& setup) {
    std::vector<std::string> all;
    for (const tofgraph_channel& channel : setup.channels()) {
      if (std::string_view(channel.name) != "rays") all.emplace_back(channel.name);
    }
    return all.empty() ? "nothing" : fmt::format("{}", fmt::join(all, ", "));
  }

  void choose(const tofgraph_channel& channel) {
    const std::vector<std::uint64_t> extent(channel.extent, channel.extent + channel.rank);
    if (extent.size() < 2 || std::ranges::count(extent, 0U) > 0) {
      throw ConfigError("channels",
                        fmt::format("'{}' is {}: a capture holds images that keep their size, name the others "
                                    "with channels: [...]",
                                    channel.name, extent.size() < 2 ? "not an image" : "of changing size"));
    }
    check_size(channel);
    chosen_.push_back({channel.name, channel.type, extent, channel.unit, channel.of, channel.applied, channel.from});
  }

  /// Checks that the extents named H and W in the channel's standard shape agree with the capture's.
  void check_size(const tofgraph_channel& channel) {
    const ChannelInfo* info = known_channel(channel.name);
    if (info == nullptr) return;
    std::istringstream words(info->shape);
    std::string word;
    for (std::uint32_t i = 0; words >> word && i < channel.rank; ++i) {
      std::uint32_t* side = word == "H" ? &header_.height : word == "W" ? &header_.width : nullptr;
      if (side == nullptr) continue;
      const auto size = static_cast<std::uint32_t>(channel.extent[i]);
      if (*side != 0 && *side != size) {
        throw ConfigError("channels", fmt::format("'{}' has {} px, but the channels before it have {}: the images of a "
                                                  "capture all have one size",
                                                  channel.name, size, *side));
      }
      *side = size;
    }
  }

  io::CaptureHeader header_;
  io::CaptureOptions options_;
  std::vector<io::CaptureChannel> chosen_;
  std::unique_ptr<io::QueuedCapture> writer_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::CaptureWriter, "Records what arrives as a capture (HDF5)")
