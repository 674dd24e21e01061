// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "report/effect_gallery.hpp"

#include "config/document.hpp"
#include "config/quantity.hpp"
#include "graph/parameters.hpp"
#include "report/chart.hpp"
#include "report/correlation_figures.hpp"
#include "report/page.hpp"
#include "simulation/board.hpp"
#include "simulation/forward_model.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/four_phase.hpp>

#include <array>
#include <cmath>

namespace tofgraph::report {
namespace {

using namespace simulation;

/// Signal of a pixel from four samples and the taps.
struct Seen {
  double distance, log_amplitude, log_intensity, null1, null2;
};

std::vector<Seen> seen_by(const ForwardModel& model, const Tracer& tracer, const Acquisition& acquisition,
                          const Pixels& pixels) {
  Expectation expectation = model.expect(tracer, acquisition, pixels);
  if (model.has_readout()) model.read_out(acquisition, pixels, expectation.taps);
  const std::size_t n = pixels.size();
  const double scale = physics::metres_per_radian(acquisition.condition.modulation_frequency);
  std::vector<Seen> result;
  for (std::size_t i = 0; i < n; ++i) {
    std::array<double, 4> c{};
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const double a = expectation.taps[2 * k * n + i], b = expectation.taps[(2 * k + 1) * n + i];
      c[k] = a - b;
      sum += a + b;
    }
    const physics::Decoded decoded = physics::decode(c);
    result.push_back({scale * decoded.phase, std::log(decoded.amplitude), std::log(sum / 8), decoded.null1 / (sum / 4),
                      decoded.null2 / decoded.amplitude});
  }
  return result;
}

/// Wall at 1.5 m; in front of it, at 1 m, a board that covers the right half of the centre.
Tracer wall_and_board(double focal_length) {
  const Tracer wall = board_tracer(focal_length, {1.5, 0, 0, 0.85});
  const Tracer near_board = board_tracer(focal_length, {1.0, 0, 0, 0.85});
  return [wall, near_board](const BoardChange& change, std::span<const Vector3> rays, std::span<Hit> hits) {
    wall(change, rays, hits);
    std::vector<Hit> before(rays.size());
    near_board(change, rays, before);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const Vector3 p = before[i].point;
      if (!(std::isfinite(before[i].return_path) && p.x > 0.02 && p.x < 0.26 && std::abs(p.y) < 0.2)) continue;
      hits[i] = before[i];
      hits[i].object = 1;
    }
  };
}

/// Effect at its typical size: parameters with a typical value have it, the others their defaults.
struct Typical {
  EffectPtr effect;
  std::string parameters;
};
Typical typical(const graph::Plugin& descriptor, const tofgraph_camera& camera) {
  std::vector<config::Entry> entries;
  std::string text;
  for (std::uint64_t i = 0; i < descriptor.parameter_count; ++i) {
    const tofgraph_parameter& p = descriptor.parameters[i];
    if (std::isnan(p.typical)) continue;
    const std::string value = fmt::format("{:.6g}{}{}", p.typical, *p.unit != 0 ? " " : "", p.unit);
    text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", p.name, config::format_quantity(p.typical, p.unit));
    entries.push_back({p.name, {}, config::parse_value(value, {})});
  }
  std::vector<const config::Entry*> written;
  for (const config::Entry& entry : entries) written.push_back(&entry);
  config::Diagnostics diagnostics;
  const graph::ParameterValues values(descriptor, written, {}, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return {std::make_shared<const Effect>(descriptor, values.data(), camera), text};
}

class Gallery {
 public:
  Gallery(const tofgraph_camera& camera, bool physical)
      : camera_(camera),
        physical_(physical),
        image_(whole_image(camera)),
        coarse_(superpixels(camera, 12, 12)),
        scene_(wall_and_board(camera.focal_length)),
        acquisition_(acquisition_of(camera, 2e-3)),
        ideal_(camera, physical, {}),
        plain_(seen_by(ideal_, scene_, acquisition_, image_)) {
    // Includes all conditions on which effects may depend: ambient light, halfway through the warm-up.
    acquisition_.condition.ambient = "lamp";
    acquisition_.condition.time_since_power_on = 600;
    for (double z = 0.5; z <= 7.01; z += 0.1) {
      boards_.push_back({z, board_tracer(camera.focal_length, {z, 0, 0, 0.85}), {}});
      boards_.back().plain = seen_by(ideal_, boards_.back().tracer, acquisition_, coarse_);
    }
  }

  void add(Page& page, const graph::Plugin& descriptor) const {
    const tofgraph_effect& border = *descriptor.effect;
    page.heading(descriptor.name);
    page.paragraph(
        fmt::format("{}. Level: {}. Touches: {}.{}{}", descriptor.summary, graph::level_name(border), border.touches,
                    *border.confused_with != 0 ? fmt::format(" Confused with: {}.", border.confused_with) : "",
                    *border.experiment != 0 ? fmt::format(" Separated by: {}.", border.experiment) : ""));
    try {
      const Typical made = typical(descriptor, camera_);
      const ForwardModel model(camera_, physical_, {made.effect});
      page.figures(maps(model));
      page.figures(series(model), fmt::format("{} with {}", descriptor.name,
                                              made.parameters.empty() ? "its defaults" : made.parameters));
    } catch (const EffectError& error) {
      page.paragraph(fmt::format("No picture, because it needs its own data: {}", error.what()));
    }
  }

 private:
  /// Board of the curves, as seen by the ideal camera.
  struct BoardAt {
    double distance;
    Tracer tracer;
    std::vector<Seen> plain;
  };

  std::vector<std::string> maps(const ForwardModel& model) const {
    const std::vector<Seen> seen = seen_by(model, scene_, acquisition_, image_);
    const auto draw = [&](const std::string& title, const std::string& unit, auto value) {
      FieldMap map{.title = title, .unit = unit, .rows = image_.rows, .columns = image_.columns};
      double most = 0;
      for (std::size_t i = 0; i < seen.size(); ++i) {
        const double here = value(seen[i], plain_[i]);
        map.fields.push_back({.value = here});
        if (std::isfinite(here)) most = std::max(most, std::abs(here));
      }
      map.limit = most < 1e-6 ? std::optional(1.0) : std::nullopt;  // rounding errors are shown as 0
      return field_map(map, 220, 190);
    };
    const double range = physics::unambiguous_range(camera_.modulation_frequency);
    return {
        draw("distance", "mm",
             [range](const Seen& a, const Seen& b) { return 1e3 * std::remainder(a.distance - b.distance, range); }),
        draw("amplitude", "%",
             [](const Seen& a, const Seen& b) { return 100 * std::expm1(a.log_amplitude - b.log_amplitude); }),
        draw("intensity", "%",
             [](const Seen& a, const Seen& b) { return 100 * std::expm1(a.log_intensity - b.log_intensity); }),
        draw("null channel N1 / 2I", "%", [](const Seen& a, const Seen& b) { return 100 * (a.null1 - b.null1); }),
        draw("null channel N2 / a", "%", [](const Seen& a, const Seen& b) { return 100 * (a.null2 - b.null2); })};
  }

  /// Mean of the image over the distance of a board.
  std::vector<std::string> series(const ForwardModel& model) const {
    std::array<Series, 4> c;
    const double range = physics::unambiguous_range(camera_.modulation_frequency);
    for (const auto& [z, board, without] : boards_) {
      const std::vector<Seen> with = seen_by(model, board, acquisition_, coarse_);
      std::array<double, 4> mean{};
      for (std::size_t i = 0; i < with.size(); ++i) {
        mean[0] += 1e3 * std::remainder(with[i].distance - without[i].distance, range);
        mean[1] += 100 * std::expm1(with[i].log_amplitude - without[i].log_amplitude);
        mean[2] += 100 * (with[i].null1 - without[i].null1);
        mean[3] += 100 * (with[i].null2 - without[i].null2);
      }
      for (std::size_t k = 0; k < 4; ++k) {
        const double value = mean[k] / static_cast<double>(with.size());
        c[k].add(z, std::abs(value) < 1e-6 ? 0 : value);  // rounding
      }
    }
    c[1].name = "amplitude";
    c[2].name = "N1 / 2I";
    c[3].name = "N2 / a";
    const char* distance = "distance of the board / m";
    return {chart({"a board: mean error of the distance", distance, "mm", {c[0]}}, 560, 240),
            chart({"a board: the other channels", distance, "%", {c[1], c[2], c[3]}}, 560, 240)};
  }

  const tofgraph_camera& camera_;
  bool physical_;
  Pixels image_, coarse_;
  Tracer scene_;
  Acquisition acquisition_;
  ForwardModel ideal_;
  std::vector<Seen> plain_;
  std::vector<BoardAt> boards_;
};

}  // namespace

std::size_t write_effect_gallery(const graph::PluginRegistry& registry, const tofgraph_camera& camera,
                                 const std::filesystem::path& file, const GalleryOptions& options) {
  std::vector<graph::PluginFile> effects;
  for (const graph::PluginFile& plugin : registry.files()) {
    if (plugin.kind == "effect") effects.push_back(plugin);
  }
  static_cast<void>(registry.describe(effects));  // all at once in one child process
  const Gallery gallery(camera, options.physical);
  Page page(fmt::format("Effects of a time-of-flight camera: {}", camera.name));
  page.paragraph(
      "Each effect alone at its typical size, as the difference from the ideal camera. The maps show a wall at 1.5 m "
      "with a board at 1 m in front of the right half of its centre, 2 ms; the curves show the mean over a board that "
      "fills the view. The room is lit and the camera has been on for ten minutes.");
  page.contents();
  for (std::size_t i = 0; i < effects.size(); ++i) {
    gallery.add(page, registry.load(effects[i]));
    if (options.progress) options.progress(static_cast<double>(i + 1) / static_cast<double>(effects.size()));
  }
  if (camera.focal_length > 0) add_correlation_figures(page, camera);
  page.write(file);
  return effects.size();
}

}  // namespace tofgraph::report
