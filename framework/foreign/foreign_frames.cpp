// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "foreign/foreign_frames.hpp"

#include "config/log.hpp"
#include "config/quantity.hpp"
#include "foreign/header_check.hpp"
#include "foreign/headerless_file.hpp"
#include "foreign/readings.hpp"
#include "foreign/series.hpp"
#include "io/profile.hpp"
#include "io/unknown.hpp"

#include <tofgraph/channels.hpp>
#include <tofgraph/physics/exposures.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace tofgraph::foreign {
namespace {

constexpr std::uint64_t max_whole_bytes = std::uint64_t{2} << 30U;  ///< of an array held in memory

/// Type of a channel in the capture that stores the values of an array.
std::uint32_t type_of(std::string_view channel, const FileArray& array) {
  if (channel == "taps" || channel == "flags") return TOFGRAPH_TYPE_U16;
  if (channel != "phases" || array.kind == TOFGRAPH_ELEMENT_FLOAT) return TOFGRAPH_TYPE_F32;
  return array.kind == TOFGRAPH_ELEMENT_SIGNED && array.bytes <= 2 ? TOFGRAPH_TYPE_I16 : TOFGRAPH_TYPE_I32;
}

/// Type, size and axis order of an array; "frames" replaces the number of frames, which may differ between files.
std::string described(const FileArray& array, std::size_t frame_axis) {
  std::vector<std::string> extent;
  for (std::size_t i = 0; i < array.extent.size(); ++i)
    extent.push_back(i == frame_axis ? "frames" : std::to_string(array.extent[i]));
  if (array.reversed) std::ranges::reverse(extent);
  return fmt::format("{} {}{}", element_text(array), fmt::join(extent, " x "),
                     array.reversed ? " (Fortran order)" : "");
}

}  // namespace

ForeignFrames::ForeignFrames(const graph::PluginRegistry& registry, ForeignRequest request)
    : formats_(registry), request_(std::move(request)), camera_(request_.camera) {
  opened_ = opened(request_.files[0]);
  if (!camera_ && !opened_->profile().empty()) {
    config::Diagnostics diagnostics;
    camera_ = io::read_profile(config::parse_document(request_.files[0].string(), opened_->profile()), diagnostics);
    if (!camera_) throw config::ConfigurationError(diagnostics);
  }
  if (!camera_)
    throw ForeignError(
        fmt::format("{}: the file does not state its camera\n         --camera PROFILE names it, a profile "
                    "that exists (tofgraph list cameras) or a file of your own, e.g. --camera ./my_camera.yaml",
                    request_.files[0].string()));
  set_channels();
  count_frames();
  read_per_frame();
  values_.resize(channels_.size());
}

std::shared_ptr<const ForeignFile> ForeignFrames::opened(const std::filesystem::path& path) {
  if (request_.layout.headerless.empty()) return std::make_shared<const ForeignFile>(formats_, path);
  try {
    const auto file = std::make_shared<HeaderlessFile>(path, request_.layout);
    if (file->rest() > 0) {
      warnings_.push_back(fmt::format("{} does not end with a whole frame: its last {} bytes are not read",
                                      path.string(), file->rest()));
      // First file only: the others have the same headers.
      const auto doubt = channels_.empty() ? header_doubt(path, request_.layout) : std::nullopt;
      if (doubt && !doubt->mend.empty())
        warnings_.push_back(
            fmt::format("{}: {}: {}; in the layout: {}", path.string(), doubt->text, doubt->evidence, doubt->mend));
    }
    return std::make_shared<const ForeignFile>(path, file);
  } catch (const std::runtime_error& error) {
    throw ForeignError(fmt::format("{}: the file {}", path.string(), error.what()));
  }
}

const ForeignFile& ForeignFrames::file(std::size_t index) {
  if (current_ == index) return *opened_;
  whole_.clear();
  current_ = index;
  opened_ = opened(request_.files[index]);
  const auto& other = opened_->arrays();
  for (const Source& source : sources_) {
    const FileArray& first = source.like;
    const std::string here = source.array < other.size() && other[source.array].name == first.name
                                 ? described(other[source.array], source.frame_axis)
                                 : "missing";
    if (here != described(first, source.frame_axis))
      throw ForeignError(fmt::format("{}: differs from the first file of the series: '{}' is {}, in {} {}",
                                     request_.files[index].string(), first.name, here, request_.files[0].string(),
                                     described(first, source.frame_axis)));
  }
  return *opened_;
}

void ForeignFrames::set_channels() {
  const std::string where = request_.files[0].string();
  std::vector<ChannelLayout> wanted = request_.layout.channels;
  if (wanted.empty()) {  // use arrays that are named like a channel
    const auto& arrays = opened_->arrays();
    const bool cloud = std::ranges::find(arrays, "points", &FileArray::name) != arrays.end();
    for (const FileArray& array : arrays) {
      if (cloud && array.name == "sigma") continue;  // sigma of a point, not of a length
      if (std::ranges::find(layout_channels, std::string_view(array.name)) != std::end(layout_channels))
        wanted.push_back({.channel = array.name, .array = array.name});
    }
  }
  if (wanted.empty()) {
    const auto& arrays = opened_->arrays();
    std::vector<std::string> lines;
    for (const FileArray& array : arrays)
      lines.push_back(fmt::format("{:<20} {} {}", array.name.empty() ? "(one array)" : array.name, element_text(array),
                                  shape_text(array)));
    throw ForeignError(fmt::format(
        "{}: the meaning of the values is not stated\n         arrays:{}\n         --as CHANNEL (or --as "
        "CHANNEL=ARRAY) states it, or a layout. CHANNEL is one of{}\n         and phases, taps, points, sigma, flags",
        where, readings_text(lines), readings_text(channel_readings())));
  }
  // `flags` comes last but is read first: invalid pixels of the other channels are then added to it.
  std::stable_partition(wanted.begin(), wanted.end(), [](const ChannelLayout& c) { return c.channel != "flags"; });
  bool lengths = false;
  for (const ChannelLayout& layout : wanted) {
    if (std::ranges::count(wanted, layout.channel, &ChannelLayout::channel) > 1)
      throw ForeignError(fmt::format("{}: two arrays are assigned to the channel '{}'", where, layout.channel));
    sources_.push_back(source_of(layout));
    const FileArray& array = opened_->arrays()[sources_.back().array];
    ForeignChannel channel{layout.channel, unit_of(layout.channel), {}, type_of(layout.channel, array), {}};
    const tofgraph_camera& c = camera();
    channel.extent = {c.height, c.width};
    const std::uint64_t exposures = physics::exposures_of(c).size();
    if (layout.channel == "taps") channel.extent = {exposures, 2, c.height, c.width};
    if (layout.channel == "phases") channel.extent = {exposures, c.height, c.width};
    if (layout.channel == "points") channel.extent.push_back(3);
    const bool rounded = array.kind == TOFGRAPH_ELEMENT_FLOAT && channel.type != TOFGRAPH_TYPE_F32;
    lengths =
        lengths || is_length_channel(layout.channel) || !layout.invalid.empty() || !layout.status.empty() || rounded;
    channels_.push_back(std::move(channel));
  }
  check_scattered();
  set_length_of_sigma();
  const bool flags = std::ranges::find(channels_, "flags", &ForeignChannel::name) != channels_.end();
  if (lengths && !flags) channels_.push_back({"flags", "", "", TOFGRAPH_TYPE_U16, {camera().height, camera().width}});
}

void ForeignFrames::set_length_of_sigma() {
  const auto sigma = std::ranges::find(channels_, "sigma", &ForeignChannel::name);
  if (sigma == channels_.end()) return;
  const std::string where = request_.files[0].string();
  for (const ForeignChannel& channel : channels_) {
    if (!is_length_channel(channel.name) || channel.name == "points") continue;
    if (!sigma->of.empty())
      throw ForeignError(fmt::format("{}: 'sigma' may belong to '{}' or to '{}': convert only one of these", where,
                                     sigma->of, channel.name));
    sigma->of = channel.name;
  }
  if (sigma->of.empty())
    throw ForeignError(fmt::format("{}: 'sigma' is the deviation of a length: add depth, range or distance", where));
}

ForeignFrames::Source ForeignFrames::source_of(const ChannelLayout& layout) {
  const ForeignFile& first = *opened_;
  const std::string where = first.path().string();
  Source source{.layout = layout};
  if (layout.array.empty() && first.arrays().size() == 1)
    source.array = 0;
  else
    source.array = first.find(layout.array.empty() ? layout.channel : layout.array);
  const FileArray& array = first.arrays()[source.array];
  source.like = array;
  check_layout(first, array, layout);
  std::vector<Axis> axes = axes_of(first, source.array, layout, camera());
  if (array.reversed) std::ranges::reverse(axes);  // order in memory
  source.scattered = is_scattered(axes);
  if (source.scattered && !layout.reversed.empty())
    throw ForeignError(
        fmt::format("{}: '{}' belongs to unordered points, which have no axes to reverse", where, layout.channel));
  const std::vector<Axis> out = axes_of_channel(layout.channel, source.scattered);
  const auto extent_of = [&](Axis axis) {
    const auto at = std::ranges::find(axes, axis);
    return at == axes.end() ? std::uint64_t{1} : array.extent[static_cast<std::size_t>(at - axes.begin())];
  };
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (axes[i] == Axis::frame) {
      source.frame_axis = i;
      continue;
    }
    std::uint64_t step = 1;
    for (auto at = std::ranges::find(out, axes[i]) + 1; at != out.end(); ++at) step *= extent_of(*at);
    if (std::ranges::find(layout.reversed, axes[i]) != layout.reversed.end()) {
      source.first += (array.extent[i] - 1) * step;
      step = std::uint64_t{0} - step;
    }
    source.steps.push_back({array.extent[i], step});
    source.elements *= array.extent[i];
  }
  const std::string wanted = unit_of(layout.channel);
  const std::string unit = layout.unit.empty() ? array.unit : layout.unit;
  if (wanted == "m" && unit.empty()) refuse_without_unit(first, source.array, layout.channel);
  if (wanted == "m") source.scale = scale_of(unit, "m", where);
  return source;
}

void ForeignFrames::count_frames() {
  const bool in_file = std::ranges::any_of(sources_, [](const Source& s) { return s.frame_axis != npos; });
  for (std::size_t f = 0; f < request_.files.size(); ++f) {
    first_frame_.push_back(frames_);
    std::uint64_t count = 1;
    file(f);  // checks every file before the first frame is read
    for (std::size_t s = 0; s < sources_.size() && in_file; ++s) {
      const Source& source = sources_[s];
      const FileArray& array = file(f).arrays()[source.array];
      const std::uint64_t frames = source.frame_axis == npos ? 1 : array.extent[source.frame_axis];
      if (s > 0 && frames != count)
        throw ForeignError(fmt::format("{}: '{}' has {} frames, '{}' has {}", request_.files[f].string(),
                                       sources_[0].layout.channel, count, source.layout.channel, frames));
      count = frames;
    }
    frames_ += count;
  }
  if (frames_ == 0) throw ForeignError(fmt::format("{}: there are no frames", request_.files[0].string()));
  if (request_.files.size() < 2 || in_file) return;
  numbers_ = file_numbers(request_.files);
  if (numbers_.empty()) return;
  const std::uint64_t missing = numbers_.back() - numbers_.front() + 1 - numbers_.size();
  const std::uint64_t step = numbers_[1] - numbers_[0];
  bool regular = true;  // constant step; some recorders write every tenth frame
  for (std::size_t i = 1; i < numbers_.size(); ++i) regular = regular && numbers_[i] - numbers_[i - 1] == step;
  if (regular && step > 1 && numbers_.size() > 2) {
    numbers_.clear();
  } else if (missing > 0) {
    warnings_.push_back(fmt::format("the numbers of the files have gaps: {} between {} and {} missing",
                                    config::counted(missing, "number"), numbers_.front(), numbers_.back()));
  }
}

const std::uint8_t* ForeignFrames::elements(const Source& source, std::size_t f, std::uint64_t frame) {
  const ForeignFile& one = file(f);
  const FileArray& array = one.arrays()[source.array];
  const std::uint64_t bytes = source.elements * array.bytes;
  if (source.frame_axis == 0 || source.frame_axis == npos) {
    buffer_.resize(bytes);
    const bool slices = source.frame_axis == 0;
    one.read(source.array, slices ? frame : 0, slices ? 1 : array.extent[0], buffer_.data());
    return buffer_.data();
  }
  std::vector<std::uint8_t>& whole = whole_[source.array];  // frames are not contiguous in this array
  if (whole.empty()) {
    const std::uint64_t all = array.elements() * array.bytes;
    if (all > max_whole_bytes)
      throw ForeignError(
          fmt::format("{}: '{}' has {} MB with the frames in its axis {}: store it with the "
                      "frames first",
                      one.path().string(), array.name, all >> 20U, source.frame_axis + 1));
    whole.resize(all);
    one.read(source.array, 0, array.extent[0], whole.data());
  }
  std::uint64_t inner = array.bytes, outer = 1;  // bytes per step of the frame axis; number of such runs
  for (std::size_t i = 0; i < array.extent.size(); ++i) {
    if (i > source.frame_axis) inner *= array.extent[i];
    if (i < source.frame_axis) outer *= array.extent[i];
  }
  buffer_.resize(bytes);
  for (std::uint64_t run = 0; run < outer; ++run)
    std::copy_n(&whole[(run * array.extent[source.frame_axis] + frame) * inner], inner, &buffer_[run * inner]);
  return buffer_.data();
}

void ForeignFrames::read(std::uint64_t frame, std::size_t channel, void* out, std::uint16_t* flags) {
  if (channel >= sources_.size()) return;  // `flags` without an array in the file
  if (sources_[channel].scattered) return read_scattered(frame, channel, out, flags);
  convert(frame, channel, out, flags);
  if (channels_[channel].name == "points")
    mark_invalid_points(static_cast<float*>(out), flags, std::uint64_t{camera().width} * camera().height,
                        values_[channel].refused);
}

void ForeignFrames::convert(std::uint64_t frame, std::size_t channel, void* out, std::uint16_t* flags) {
  const Source& source = sources_[channel];
  const auto after = std::ranges::upper_bound(first_frame_, frame);
  const auto f = static_cast<std::size_t>(after - first_frame_.begin()) - 1;
  const std::uint8_t* in = elements(source, f, frame - first_frame_[f]);
  const FileArray& array = opened_->arrays()[source.array];
  const ForeignChannel& made = channels_[channel];
  const std::string_view name = made.name;
  ChannelValues& seen = values_[channel];
  ++seen.frames;
  // Codes are looked for in the first frames, and later in frames that double in number.
  if (array.kind != TOFGRAPH_ELEMENT_FLOAT && (is_length_channel(name) || name == "phases") &&
      (frame < 8 || std::has_single_bit(frame))) {
    ++seen.examined;
    for (const auto& [value, count] : suspected_codes_of(array, buffer_, source.layout)) seen.codes[value] += count;
  }
  scatter(array, in, source.steps,
          {.type = made.type,
           .scale = source.scale,
           .zero = source.layout.zero,
           .mask = source.layout.mask,
           .signed_bits = source.layout.signed_bits,
           .first = source.first,
           .status = source.layout.status,
           .invalid = source.layout.invalid,
           .is_length = is_length_channel(name) && name != "points",
           .refused = &seen.refused,
           .dropped = &seen.dropped,
           .pixels = source.scattered ? cloud_.flags.size() : std::uint64_t{camera().width} * camera().height,
           .per_pixel = name == "points" ? std::uint64_t{3} : std::uint64_t{1}},
          out, flags);
}

}  // namespace tofgraph::foreign
