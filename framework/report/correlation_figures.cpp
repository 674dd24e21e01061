// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "report/correlation_figures.hpp"

#include "config/quantity.hpp"
#include "report/chart.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/correlation.hpp>
#include <tofgraph/physics/phasor.hpp>

#include <cmath>
#include <functional>

namespace tofgraph::report {
namespace {

/// Signal over time; x in ns.
Series signal(const std::string& name, double end, const std::function<double(double time)>& value) {
  Series series{.name = name, .style = Series::Style::line, .marks = {}};
  constexpr int points = 1200;
  for (int i = -points; i <= points; ++i) {
    const double t = end * i / points;
    series.marks.push_back({.x = 1e9 * t, .y = value(t), .title = {}});
  }
  return series;
}

std::string signals(const std::string& title, const std::string& y, std::vector<Series> series,
                    const std::string& x = "time, ns") {
  return chart({.title = title, .x_label = x, .y_label = y, .series = std::move(series), .with_zero = true}, 560, 240);
}

/// Loss of amplitude by interference, relative to the sum of the sources' amplitudes, for a perpendicular board.
std::string interference(const tofgraph_camera& camera, double depth) {
  const physics::Geometry geometry = physics::geometry_of(camera);
  std::vector<double> loss;
  const physics::Exposure exposure{1, 1, 1, camera.modulation_frequency};
  for (std::size_t i = 0; i < std::size_t{camera.width} * camera.height; ++i) {
    const physics::Vector3 ray = physics::unit_ray(camera.rays + 3 * i);
    const physics::Light light =
        physics::reference_light(geometry, ray, physics::reflected_path(geometry, ray, depth), 1, exposure);
    loss.push_back(1e6 * (1 - std::abs(light.phasor) / (2 * light.intensity)));
  }
  const std::string title =
      fmt::format("interference of the sources, board at {}", config::format_quantity(depth, "m"));
  return field_map(pixel_map(title, "ppm", camera.height, camera.width, loss, false), 420, 330);
}

}  // namespace

void add_correlation_figures(Page& page, const tofgraph_camera& camera) {
  const double period = 1 / camera.modulation_frequency, window = 10 * period, shift = 2 * period;
  const auto cosine = [period](double t) { return std::cos(physics::two_pi * t / period); };
  const auto on = [window](double t) { return std::abs(t) <= window / 2 ? 1.0 : 0.0; };
  const auto first = [&](double t) { return on(t) * cosine(t); };
  const auto second = [&](double t) { return on(t - shift) * cosine(t); };
  const auto both = [&](double t) { return on(t) * on(t - shift); };
  const auto correlation = [&](double t) {
    const auto [envelope, ripple] = physics::windowed_correlation(t, window, camera.modulation_frequency);
    return (envelope * cosine(t) + ripple) / 2;
  };
  const auto triangle = [&](double t) {
    return physics::windowed_correlation(t, window, camera.modulation_frequency).envelope / 2;
  };
  const auto ideal = [&](double t) { return cosine(t) / 2; };

  page.heading("Modulation and correlation");
  page.figures(std::vector<std::string>{
      signals("f1, on for ten periods (5.1)", "", {signal("f1", window, first), signal("on-time", window, on)}),
      signals("f2, shifted by two periods (5.2)", "",
              {signal("f2", window, second), signal("on-time", window, [&](double t) { return on(t - shift); })}),
      signals(
          "f1 + f2", "",
          {signal("f1 + f2", window, [&](double t) { return first(t) + second(t); }), signal("both on", window, both)}),
      signals("correlation of windows (5.56)", "of A B T",
              {signal("y", window, correlation), signal("envelope (5.57)", window, triangle)}, "lag, ns"),
      signals("correlation of unlimited signals (5.60)", "of A B T", {signal("y", window, ideal)}, "lag, ns")});
  page.paragraph(
      "Signals of amplitude 1 as in figures 5.2, 5.3, 5.5 and 5.6 of the reference. The effect finite_integration puts "
      "windows into the simulation; at the on-times of real cameras, 10 us and more, the envelope changes by less than "
      "1 % over the unambiguous range. The matched filter's signal-to-noise ratio (5.43) is proportional to T.");
  page.figures(std::vector<std::string>{interference(camera, 0.5)},
               "Loss of amplitude where the sources' paths differ: 1 less the normalised amplitude of figure 5.10.");
}

}  // namespace tofgraph::report
