// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/capture_metadata.hpp"

#include "io/captures/capture_dataset.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tofgraph::io::h5 {

bool MetadataArray::knows(std::size_t first, std::size_t last) const {
  const auto unknown = [this](const layout::Element& element) {
    return kind->known == TOFGRAPH_KNOWS_TIMESTAMP ? element.integer == 0 : std::isnan(element.number);
  };
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = values.begin() + static_cast<std::ptrdiff_t>(last) + 1;
  return std::none_of(begin, end, unknown);
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
