// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/plausibility.hpp"

#include "io/plausibility.hpp"

#include <tofgraph/channels.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::io {
namespace {

std::vector<float> lengths_of(const CaptureReader& capture, std::size_t channel, std::size_t frame) {
  std::vector<float> values(capture.channels()[channel].elements());
  capture.read(channel, frame, values.data());
  return values;
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
  const double range = expected_range(capture.header().exposures, frames.front().modulation_frequency, camera);
  for (std::size_t i = 0; i < capture.channels().size(); ++i) {
    const CaptureChannel& channel = capture.channels()[i];
    if (!is_length_channel(channel.name) || channel.name == "points" || channel.applied == "truth") continue;
    std::string doubt = length_doubt(channel.name, lengths_of(capture, i, first), range);
    if (!doubt.empty()) doubts.push_back(std::move(doubt));
  }
  return doubts;
}

}  // namespace tofgraph::io
