// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Counter of recorded numbers that are not valid lengths, for a single warning per reader.
#pragma once

#include <tofgraph/channels.hpp>

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>

namespace tofgraph::io {

/// Numbers of a channel that are not valid lengths. NaN is not counted: it marks an unmeasured pixel.
struct RefusedLengths {
  std::size_t count = 0, zero = 0, negative = 0;
  std::optional<double> example;  ///< the first finite one, as it is stored

  /// @param value number that is not a valid length, m @param stored the same without unit and offset, NaN: unknown
  void add(float value, double stored = std::numeric_limits<double>::quiet_NaN()) {
    if (std::isnan(value)) return;
    if (!example && std::isfinite(stored)) example = stored;
    ++count;
    zero += value == 0 ? 1 : 0;
    negative += value < 0 ? 1 : 0;
  }

  /// Returns e.g. "3 of 4096 values of depth in 1 frame are 0 m: taken as invalid pixels".
  /// @param values number in all frames @param frames in words, e.g. "2 frames"
  std::string sentence(const std::string& channel, std::size_t values, const std::string& frames) const {
    return fmt::format("{} of {} values of {} in {} are {}: taken as invalid pixels", count, values, channel, frames,
                       described());
  }

 private:
  std::string described() const {
    if (zero == count) return "0 m";
    if (negative == count) return "negative";
    if (zero + negative == 0) return fmt::format("infinite or greater than {:.0f} km", max_length / 1e3F);
    return fmt::format("0 m, negative or greater than {:.0f} km", max_length / 1e3F);
  }
};

}  // namespace tofgraph::io
