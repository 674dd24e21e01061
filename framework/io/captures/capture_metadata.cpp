// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/capture_metadata.hpp"

#include "io/captures/capture_dataset.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tofgraph::io::h5 {

bool MetadataArray::knows(std::size_t first, std::size_t last) const {
  const bool is_time = kind->known == TOFGRAPH_KNOWS_TIMESTAMP;
  // A time stamp of 0 is unknown, but a clock may start at 0.
  const bool starts_at_0 = is_time && values.size() > 1 && values[0].integer == 0 && values[1].integer != 0;
  for (std::size_t i = first == 0 && starts_at_0 ? 1 : first; i <= last; ++i)
    if (is_time ? values[i].integer == 0 : std::isnan(values[i].number)) return false;
  return true;
}

const layout::Metadata* metadata_kind(const std::string& name) {
  const auto* found = std::ranges::find(layout::metadata, name, &layout::Metadata::name);
  return found != std::end(layout::metadata) ? found : nullptr;
}

MetadataArray read_cut_array(hid_t group, const layout::Metadata& kind, std::size_t frames, std::uint64_t end) {
  MetadataArray array{&kind, std::vector<layout::Element>(frames)};
  std::size_t left = 0;
  try {
    const Dataset dataset(group, kind.name, end);
    dataset.check_metadata(kind);
    left = std::min(dataset.stored_frames(false), frames);
    dataset.read_first(left, kind.memory_type(), array.values.data());
  } catch (const std::exception&) {
    H5Eclear2(H5E_DEFAULT);
    left = 0;
  }
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = left; i < frames; ++i) {
    tofgraph_metadata unknown{};
    unknown.device_number = i;
    unknown.integration_time = unknown.modulation_frequency = unknown.temperature = unknown.time_since_power_on = nan;
    array.values[i] = kind.stored(unknown);
  }
  return array;
}

}  // namespace tofgraph::io::h5
