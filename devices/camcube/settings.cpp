// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "config/quantity.hpp"
#include "devices/camcube/backend.hpp"

namespace tofgraph::camcube {

namespace {

double min_time(const Settings& settings) {
  return std::isfinite(settings.integration_range[0]) ? settings.integration_range[0] : 1e-6;
}
double max_time(const Settings& settings) {
  return std::isfinite(settings.integration_range[1]) ? settings.integration_range[1] : 1;
}

}  // namespace

double nearest_integration_time(const Settings& settings, double time) {
  return std::round(std::clamp(time, min_time(settings), max_time(settings)) * 1e6) * 1e-6;
}

void check_integration_time(const Settings& settings) {
  const double wanted = settings.integration_time, nearest = nearest_integration_time(settings, wanted);
  if (std::abs(nearest - wanted) > 1e-9)
    throw SettingError(
        "integration_time",
        fmt::format("{} is not valid for the camera '{}', which has whole microseconds from {} to {}; the "
                    "nearest valid time is {}",
                    config::format_quantity(wanted, "s"), settings.camera,
                    config::format_quantity(min_time(settings), "s"), config::format_quantity(max_time(settings), "s"),
                    config::format_quantity(nearest, "s")));
}

}  // namespace tofgraph::camcube
