// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/capture_facts.hpp"

#include "io/captures/statistics_file.hpp"

#include <limits>

namespace tofgraph::io {

CaptureFacts facts_of(const CaptureReader& capture) {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  CaptureFacts facts{capture.header(), capture.frames(), {}, 0};
  facts.first.integration_time = facts.first.modulation_frequency = unknown;
  facts.first.temperature = facts.first.time_since_power_on = unknown;
  if (facts.frames > 0) facts.first = capture.metadata(0);
  for (const CaptureChannel& channel : capture.channels()) {
    if (channel.name != "taps" && channel.name != "phases") continue;
    facts.exposures = channel.extent[0];
    break;
  }
  return facts;
}

CaptureFacts read_facts(const std::filesystem::path& file) {
  return is_statistics(file) ? read_statistics_header(file).facts : facts_of(CaptureReader(file));
}

}  // namespace tofgraph::io
