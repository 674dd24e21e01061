// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/capture_facts.hpp"

#include "io/captures/statistics_file.hpp"

namespace tofgraph::io {

CaptureFacts facts_of(const CaptureReader& capture, const Condition& condition) {
  CaptureFacts facts{capture.header(), capture.frames(), {}, 0};
  facts.first.integration_time = facts.first.modulation_frequency = unknown;
  facts.first.temperature = facts.first.time_since_power_on = unknown;
  if (const std::uint64_t first = condition.frames ? (*condition.frames)[0] : 0; first < facts.frames)
    facts.first = capture.metadata(first);
  for (const CaptureChannel& channel : capture.channels()) {
    if (channel.name != "taps" && channel.name != "phases") continue;
    facts.exposures = channel.extent[0];
    break;
  }
  return facts;
}

CaptureFacts read_facts(const Condition& condition) {
  const std::filesystem::path& file = condition.capture;
  return is_statistics(file) ? read_statistics_header(file).facts : facts_of(CaptureReader(file), condition);
}

}  // namespace tofgraph::io
