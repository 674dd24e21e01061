// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Metadata of frames: times and frequencies from numbers or arrays.
#include "config/log.hpp"
#include "foreign/foreign_frames.hpp"
#include "foreign/readings.hpp"
#include "io/unknown.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::foreign {

std::vector<double> ForeignFrames::values_of(const PerFrame& what, std::string_view unit) {
  if (!std::isnan(what.value)) return {what.value};  // an option replaces an array of the layout
  if (what.array.empty()) return {};
  const double scale = scale_of(what.unit, std::string(unit), request_.files[0].string());
  std::vector<double> values;
  for (std::size_t f = 0; f < request_.files.size(); ++f) {
    const ForeignFile& one = file(f);
    const std::size_t index = one.find(what.array);
    const FileArray& array = one.arrays()[index];
    if (array.elements() == 0 || array.elements() > frames_)
      throw ForeignError(fmt::format("{}: '{}' is {}, expected one value for each of {}", one.path().string(),
                                     what.array, shape_text(array), config::counted(frames_, "frame")));
    std::vector<std::uint8_t> bytes(array.elements() * array.bytes);
    one.read(index, 0, array.extent[0], bytes.data());
    for (const double value : numbers_of(array, bytes)) values.push_back(value * scale);
  }
  if (values.size() != 1 && values.size() != frames_)
    throw ForeignError(fmt::format("{}: '{}' has {}, there are {}", request_.files[0].string(), what.array,
                                   config::counted(values.size(), "value"), config::counted(frames_, "frame")));
  return values;
}

std::vector<std::int64_t> ForeignFrames::exact_times(const PerFrame& what) {
  if (what.array.empty()) return {};
  const double nanoseconds = 1e9 * scale_of(what.unit, "s", request_.files[0].string());
  if (nanoseconds < 1 || nanoseconds > 1e18 || nanoseconds != std::round(nanoseconds)) return {};
  std::vector<std::int64_t> times;
  for (std::size_t f = 0; f < request_.files.size(); ++f) {
    const ForeignFile& one = file(f);
    const std::size_t index = one.find(what.array);
    const FileArray& array = one.arrays()[index];
    if (array.kind == TOFGRAPH_ELEMENT_FLOAT || array.bytes != 8 || array.elements() > frames_) return {};
    std::vector<std::int64_t> values(array.elements());
    one.read(index, 0, array.extent[0], values.data());
    for (const std::int64_t value : values) {
      if (__builtin_mul_overflow(value, static_cast<std::int64_t>(nanoseconds), &times.emplace_back())) return {};
    }
  }
  return times.size() == frames_ ? times : std::vector<std::int64_t>{};
}

void ForeignFrames::read_per_frame() {
  integration_time_ = values_of(request_.layout.integration_time, "s");
  modulation_frequency_ = values_of(request_.layout.modulation_frequency, "Hz");
  time_since_power_on_ = values_of(request_.layout.time_since_power_on, "s");
  PerFrame timestamp = request_.layout.timestamp;
  if (timestamp.array.empty()) {  // use the time stamps that the format provides for the first channel
    const std::string own = sources_[0].like.name + ".stamp";
    const auto found = std::ranges::find(opened_->arrays(), own, &FileArray::name);
    if (found != opened_->arrays().end()) timestamp = {.array = own, .unit = found->unit};
  }
  timestamp_ns_ = exact_times(timestamp);
  if (timestamp_ns_.empty()) {
    for (const double seconds : values_of(timestamp, "s")) {
      if (!(std::abs(seconds) < 9.2e9))  // NaN, or beyond 64 bits of nanoseconds
        throw ForeignError(
            fmt::format("{}: '{}' has {:g} s for frame {}: time stamps must lie within 290 years of 1970",
                        request_.files[0].string(), timestamp.array, seconds, timestamp_ns_.size()));
      timestamp_ns_.push_back(static_cast<std::int64_t>(std::llround(seconds * 1e9)));
    }
  }
  if (modulation_frequency_.empty() && camera().modulation_frequency > 0)
    modulation_frequency_ = {camera().modulation_frequency};
}

std::uint64_t ForeignFrames::known() const {
  const bool times = timestamp_ns_.size() == frames_ || std::isfinite(request_.layout.frame_rate);
  return (times ? TOFGRAPH_KNOWS_TIMESTAMP + 0U : 0U) |
         (integration_time_.empty() ? 0U : TOFGRAPH_KNOWS_INTEGRATION_TIME + 0U) |
         (modulation_frequency_.empty() ? 0U : TOFGRAPH_KNOWS_MODULATION_FREQUENCY + 0U) |
         (time_since_power_on_.empty() ? 0U : TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON + 0U);
}

tofgraph_metadata ForeignFrames::metadata(std::uint64_t frame) const {
  const auto at = [frame](const std::vector<double>& values) {
    return values.empty() ? io::unknown : values[values.size() == 1 ? 0 : frame];
  };
  tofgraph_metadata metadata{};
  metadata.size = sizeof metadata;
  metadata.device_number = numbers_.empty() ? frame : numbers_[frame] - numbers_[0];
  metadata.integration_time = at(integration_time_);
  metadata.modulation_frequency = at(modulation_frequency_);
  metadata.temperature = io::unknown;
  metadata.time_since_power_on = at(time_since_power_on_);
  const double seconds = std::isfinite(request_.layout.frame_rate)
                             ? static_cast<double>(metadata.device_number) / request_.layout.frame_rate
                             : 0;
  metadata.timestamp_ns =
      timestamp_ns_.size() == frames_ ? timestamp_ns_[frame] : static_cast<std::int64_t>(std::llround(seconds * 1e9));
  return metadata;
}

}  // namespace tofgraph::foreign
