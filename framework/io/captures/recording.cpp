// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/recording.hpp"

#include <tofgraph/channels.hpp>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string_view>

namespace tofgraph::io {

Recording::Recording(const std::filesystem::path& file) : reader_(file) {
  for (std::size_t i = 0; i < reader_.channels().size(); ++i) {
    const CaptureChannel& c = reader_.channels()[i];
    channels_[c.name] = {i, c.type, c.elements()};
  }
  const auto has = [this](const char* name) { return channels_.contains(name); };
  const bool image = has("amplitude") || has("intensity");
  if (!has("taps") && !has("phases") && !has("distance") && !image)
    throw std::runtime_error("has no taps, phases, distance, amplitude or intensity");
  kind_ = has("taps")        ? Kind::taps
          : has("phases")    ? Kind::phases
          : !has("distance") ? Kind::images
          : has("amplitude") ? Kind::decoded
                             : Kind::distances;
}

std::vector<float> Recording::floats(const char* name, std::size_t frame) const {
  const auto as = [](const auto& values) { return std::vector<float>(values.begin(), values.end()); };
  switch (channels_.at(name).type) {
    case TOFGRAPH_TYPE_I16:
      return as(read<std::int16_t>(name, frame));
    case TOFGRAPH_TYPE_I32: {
      std::vector<float> result;
      for (const std::int32_t v : read<std::int32_t>(name, frame)) result.push_back(static_cast<float>(v));
      return result;
    }
    default: {
      std::vector<float> values = read<float>(name, frame);
      if (is_length_channel(name) && std::string_view(name) != "points")
        std::ranges::replace_if(
            values, [](float v) { return !is_valid_length(v); }, std::numeric_limits<float>::quiet_NaN());
      return values;
    }
  }
}

}  // namespace tofgraph::io
