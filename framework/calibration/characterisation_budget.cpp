// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Error budget: contributions estimated from the data, and by the effects of a model.
#include "calibration/characterisation.hpp"

#include "config/diagnostics.hpp"
#include "simulation/board.hpp"
#include "simulation/files/model.hpp"
#include "simulation/forward_model.hpp"
#include "simulation/simulation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/parallel_for.h>
#include <tofgraph/physics/four_phase.hpp>
#include <tofgraph/physics/non_linearity.hpp>

#include <algorithm>
#include <cmath>
#include <map>

namespace tofgraph::calibration {
namespace {

/// Mean errors of the boards as a sum of contributions of each level of each setting, by alternation, and a residual.
class MeanErrors {
 public:
  explicit MeanErrors(const std::vector<Characterised>& conditions) {
    for (const Characterised& c : conditions) left_.push_back(-c.board.error());
    mean_ = moments_of(left_).mean;
    for (double& e : left_) e -= mean_;
  }
  /// @param level of each condition
  void add(const std::vector<double>& level) { levels_.push_back(level); }
  void solve() {
    parts_.assign(levels_.size(), std::vector<double>(left_.size(), 0));
    constexpr int rounds = 50;
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t k = 0; k < levels_.size(); ++k) {
        std::map<double, std::array<double, 2>> sums;
        for (std::size_t i = 0; i < left_.size(); ++i) {
          auto& s = sums[levels_[k][i]];
          s[0] += left_[i] + parts_[k][i];
          s[1] += 1;
        }
        for (std::size_t i = 0; i < left_.size(); ++i) {
          const auto& s = sums[levels_[k][i]];
          left_[i] += parts_[k][i] - s[0] / s[1];
          parts_[k][i] = s[0] / s[1];
        }
      }
    }
  }
  double mean() const { return mean_; }
  double part(std::size_t k) const { return root_mean_square(parts_[k]); }
  double left() const { return root_mean_square(left_); }

 private:
  std::vector<std::vector<double>> levels_, parts_;
  std::vector<double> left_;
  double mean_ = 0;
};

}  // namespace

void set_budget(Characterisation& data, double pattern_square) {
  MeanErrors errors(data.conditions);
  std::vector<double> distance, time, target, sources;
  double spread = 0, noise = 0, square = 0;
  bool noise_known = true;
  std::map<double, std::vector<double>> totals;
  const auto n = static_cast<double>(data.conditions.size());
  for (const Characterised& c : data.conditions) {
    distance.push_back(c.board.distance);
    time.push_back(c.board.condition.integration_time);
    target.push_back(static_cast<double>(data.campaign.boards.target_of(c.board)));
    sources.push_back(
        static_cast<double>(std::hash<std::string>{}(fmt::format("{}", fmt::join(c.board.condition.sources, " ")))));
    const double sd = std::isfinite(c.error_sd) ? c.error_sd : 0;  // unknown for a single pixel
    noise_known = noise_known && std::isfinite(c.noise);
    const double own = std::isfinite(c.noise) ? c.noise : 0;
    const double shape = std::max(sd * sd - own * own / static_cast<double>(c.board.frames), 0.0);
    spread += shape / n;
    noise += own * own / n;
    const double all = c.board.error() * c.board.error() + shape + own * own;
    square += all / n;
    totals[c.board.distance].push_back(std::sqrt(all));
  }
  for (const auto* level : {&distance, &time, &target, &sources}) errors.add(*level);
  errors.solve();
  data.total = std::sqrt(square);
  data.total_by_distance = interval_of(totals);
  data.budget = {{"noise", "noise of a frame, from frame to frame", noise_known ? std::sqrt(noise) : unknown},
                 {"mean error", "the same for all boards: a constant offset", std::abs(errors.mean())},
                 {"distance", "mean error by the board's distance: wiggling and the like", errors.part(0)},
                 {"integration time", "mean error by the integration time", errors.part(1)},
                 {"target", "mean error by the target's reflectivity", errors.part(2)},
                 {"sources", "mean error by the sources that are on", errors.part(3)},
                 {"both together", "mean errors that are not a sum of these", errors.left()},
                 {"fixed pattern", "pattern of the pixels, the same in all conditions", std::sqrt(pattern_square)},
                 {"other shape", "shape over the image, different in each condition: lens, stray light, tilt",
                  std::sqrt(std::max(spread - (std::isfinite(pattern_square) ? pattern_square : 0), 0.0))}};
  if (!noise_known)
    data.campaign.boards.notes.emplace_back(
        "single frames do not determine the noise: where it is unknown it is counted as shape over the image");
}

namespace {

/// Depths of the pixels by the optimized model from a simulated measurement.
class Simulated {
 public:
  Simulated(const tofgraph_camera& camera, bool physical, std::vector<simulation::EffectPtr> effects)
      : camera_(camera),
        model_(camera, physical, std::move(effects)),
        geometry_(physics::geometry_of(camera)),
        pixels_(simulation::superpixels(camera, std::min<std::size_t>(side, camera.height),
                                        std::min<std::size_t>(side, camera.width))) {}

  /// Numbers of the pixels of a window in each block, for which one depth is computed.
  std::vector<double> weights(const std::vector<std::size_t>& window) const {
    std::vector<double> result(pixels_.size());
    for (const std::size_t i : window) {
      const std::size_t column = i % camera_.width, row = i / camera_.width;
      const std::size_t r = (2 * row + 1) * pixels_.rows / (2 * std::size_t{camera_.height});
      const std::size_t c = (2 * column + 1) * pixels_.columns / (2 * std::size_t{camera_.width});
      result[r * pixels_.columns + c] += 1;
    }
    return result;
  }

  std::vector<double> depths(const io::Condition& c, double reflectivity) const {
    const simulation::Acquisition acquisition = simulation::acquisition_of(camera_, c);
    const simulation::BoardPose pose{c.board_distance, c.board_tilt_x, c.board_tilt_y, reflectivity, c.roll, 0};
    const auto taps = model_.expect(simulation::board_tracer(camera_.focal_length, pose), acquisition, pixels_).taps;
    const std::size_t n = pixels_.size();
    std::vector<double> result;
    for (std::size_t i = 0; i < n; ++i) {
      std::array<double, 4> sample{};
      for (std::size_t k = 0; k < 4; ++k) sample[k] = taps[2 * k * n + i] - taps[(2 * k + 1) * n + i];
      const double d = physics::metres_per_radian(camera_.modulation_frequency) * physics::decode(sample).phase;
      result.push_back(physics::depth_of(geometry_, pixels_.rays[i],
                                         physics::optimized_bistatic_newton(geometry_, pixels_.rays[i], d)));
    }
    return result;
  }

 private:
  static constexpr std::size_t side = 24;
  const tofgraph_camera& camera_;
  simulation::ForwardModel model_;
  physics::Geometry geometry_;
  simulation::Pixels pixels_;
};

/// Condition with all effects: a depth for each block of pixels, and the number of measured pixels in the block.
struct AllEffects {
  double reflectivity = 0;
  std::vector<double> depths, weights;
};

/// Weighted mean square of the difference modulo the range.
double mean_square(const std::vector<double>& a, const std::vector<double>& b, const std::vector<double>& weights,
                   double range) {
  double square = 0, sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double difference = std::remainder(a[i] - b[i], range);
    if (!std::isfinite(difference)) continue;
    square += weights[i] * difference * difference;
    sum += weights[i];
  }
  return square / std::max(sum, 1.0);
}

}  // namespace

std::vector<BudgetLine> effect_budget(const Characterisation& data, const std::filesystem::path& file,
                                      const graph::PluginRegistry& registry) {
  const tofgraph_camera& camera = data.campaign.conditions.camera->view();
  config::Diagnostics diagnostics;
  const simulation::Model model = simulation::load_model(file, registry, diagnostics);
  if (diagnostics.ok() && !simulation::is_for(model, *data.campaign.conditions.camera))
    diagnostics.error(model.camera_at, fmt::format("the model is for the camera '{}', the campaign's is '{}'",
                                                   model.camera, camera.name));
  std::vector<simulation::EffectPtr> effects;
  if (diagnostics.ok()) effects = simulation::make_effects(model, camera, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  const Simulated all(camera, model.physical, effects);
  const double range = physics::unambiguous_range(camera.modulation_frequency);
  const BoardModels models(camera, io::OffsetVariant::geometric, data.campaign.conditions.conditions);
  const std::size_t conditions = data.conditions.size();
  std::vector<AllEffects> with_all(conditions);
  tbb::parallel_for(std::size_t{0}, conditions, [&](std::size_t i) {
    const Board& b = data.conditions[i].board;
    const double stated = b.condition.reflectivity, seen = b.reflectivity;
    const double reflectivity = stated > 0 ? stated : seen > 0 ? std::min(seen, 1.0) : 0.85;
    with_all[i] = {reflectivity, all.depths(b.condition, reflectivity),
                   all.weights(models.of(b.condition).window(b.condition))};
  });
  std::vector<BudgetLine> lines;
  for (std::size_t k = 0; k < effects.size(); ++k) {
    std::vector<simulation::EffectPtr> others = effects;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
    const Simulated without(camera, model.physical, others);
    std::vector<double> squares(conditions);
    tbb::parallel_for(std::size_t{0}, conditions, [&](std::size_t i) {
      const AllEffects& one = with_all[i];
      squares[i] = mean_square(one.depths, without.depths(data.conditions[i].board.condition, one.reflectivity),
                               one.weights, range);
    });
    double sum = 0;
    for (const double square : squares) sum += square / static_cast<double>(squares.size());
    lines.push_back({model.effects[k].descriptor->file.name, "", std::sqrt(sum)});
  }
  return lines;
}

}  // namespace tofgraph::calibration
