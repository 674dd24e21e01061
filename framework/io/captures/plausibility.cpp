// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/plausibility.hpp"

#include "io/plausibility.hpp"

#include <tofgraph/channels.hpp>
#include <tofgraph/physics/constants.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::io {
namespace {

double median_length(const CaptureReader& capture, std::size_t channel, std::size_t frame) {
  std::vector<float> values(capture.channels()[channel].elements());
  capture.read(channel, frame, values.data());
  std::erase_if(values, [](float v) { return !(v > 0 && std::isfinite(v)); });  // too long in a wrong unit, too
  if (values.empty()) return std::nan("");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// The range of the lowest frequency that is known, as several frequencies reach farther than each of them; m.
double range_of(const CaptureReader& capture, double recorded, const tofgraph_camera* camera) {
  double lowest = std::isnan(recorded) && camera != nullptr ? camera->modulation_frequency : recorded;
  if (!frequency_doubt(recorded, camera).empty())
    lowest = camera != nullptr ? camera->modulation_frequency : std::nan("");
  for (const tofgraph_exposure& exposure : capture.header().exposures) {
    if (exposure.frequency > 0) lowest = std::fmin(lowest, exposure.frequency);
  }
  return lowest > 0 ? physics::unambiguous_range(lowest) : std::nan("");
}

}  // namespace

std::vector<std::string> doubts_of(const CaptureReader& capture, std::size_t first, std::size_t last,
                                   const tofgraph_camera* camera) {
  std::vector<tofgraph_metadata> frames;
  for (std::size_t i = first; i <= last; ++i) frames.push_back(capture.metadata(i));
  std::vector<std::string> doubts = metadata_doubts(frames, camera);
  for (const tofgraph_exposure& exposure : capture.header().exposures) {
    const std::string doubt = exposure.frequency > 0 ? frequency_doubt(exposure.frequency, camera) : std::string();
    if (doubt.empty()) continue;
    doubts.push_back("of the exposures: " + doubt);
    break;
  }
  const double range = range_of(capture, frames.front().modulation_frequency, camera);
  for (std::size_t i = 0; i < capture.channels().size(); ++i) {
    const CaptureChannel& channel = capture.channels()[i];
    if (!is_length_channel(channel.name) || channel.name == "points" || channel.applied == "truth") continue;
    std::string doubt = length_doubt(channel.name, median_length(capture, i, first), range);
    if (!doubt.empty()) doubts.push_back(std::move(doubt));
  }
  return doubts;
}

}  // namespace tofgraph::io
