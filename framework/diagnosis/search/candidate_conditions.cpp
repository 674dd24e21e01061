// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// List of conditions that could be measured next, and their expected noise.
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/next_condition.hpp"
#include "simulation/simulation.hpp"

#include <tofgraph/physics/constants.hpp>

#include <cmath>
#include <functional>
#include <numbers>
#include <set>

namespace tofgraph::diagnosis {
namespace {

constexpr double tilt = 20 * std::numbers::pi / 180;  ///< rad
constexpr std::size_t max_distances = 6, max_times = 3, max_targets = 3;

/// Some of the levels, evenly spaced, including both ends.
template <class T> std::vector<T> thinned(const std::vector<T>& levels, std::size_t count) {
  if (levels.size() <= count) return levels;
  std::vector<T> some;
  for (std::size_t k = 0; k < count; ++k) some.push_back(levels[k * (levels.size() - 1) / (count - 1)]);
  return some;
}

std::vector<double> distances_of(const Design& design) {
  const std::set<double> levels = design.levels(&io::Condition::board_distance);
  std::vector<double> all(levels.begin(), levels.end());
  for (std::size_t k = 0; k + 1 < levels.size(); ++k) all.push_back((all[k] + all[k + 1]) / 2);
  std::ranges::sort(all);
  std::vector<double> chosen = thinned(all, max_distances);
  const double near = settings.near_board * all.front(), far = settings.far_board * all.back();
  if (near > 2 * design.camera().focal_length) chosen.insert(chosen.begin(), near);
  chosen.push_back(far);
  return chosen;
}

/// Distances at which no pixel's distance wraps around to zero: before the end of the
/// unambiguous range, or no farther than the campaign's own.
class Reach {
 public:
  explicit Reach(const Design& design)
      : camera_(design.camera()),
        pixels_(design.superpixels() > 1 ? simulation::whole_image(camera_) : design.pixels()),
        most_(physics::unambiguous_range(camera_.modulation_frequency) - settings.range_margin) {
    for (const io::Condition& c : design.conditions()) most_ = std::max(most_, farthest(c));
  }

  bool has(const io::Condition& condition) const { return farthest(condition) <= most_; }

 private:
  /// Longest path from the board to a pixel, m.
  double farthest(const io::Condition& condition) const {
    std::vector<simulation::Hit> hits(pixels_.size());
    simulation::board_tracer(camera_.focal_length, pose_of(condition))({}, pixels_.rays, hits);
    double longest = 0;
    for (const simulation::Hit& hit : hits) {
      if (std::isfinite(hit.return_path)) longest = std::max(longest, hit.return_path);  // skips pixels without a ray
    }
    return longest;
  }

  const tofgraph_camera& camera_;
  simulation::Pixels pixels_;
  double most_;  ///< m
};

/// Some of the integration times of the campaign's boards, s. @returns ascending
std::vector<double> measured_times(const Design& design) {
  const std::set<double> levels = design.levels(&io::Condition::integration_time);
  return thinned(std::vector(levels.begin(), levels.end()), max_times);
}

/// Integration times including shorter and longer ones that the camera can be set to, s.
std::vector<double> times_of(const Design& design) {
  std::vector<double> chosen = measured_times(design);
  // Limits that the profile does not state are NaN, which fmax and fmin ignore.
  const double shorter = std::fmax(chosen.front() / 2, design.camera().integration_time[0]),
               longer = std::fmin(2 * chosen.back(), design.camera().integration_time[1]);
  if (shorter < chosen.front()) chosen.insert(chosen.begin(), shorter);
  if (longer > chosen.back()) chosen.push_back(longer);
  return chosen;
}

/// Latest time since power-on, s; NaN if no condition states it.
double latest_of(const Design& design) {
  double latest = io::unknown;
  for (const io::Condition& c : design.conditions()) latest = std::fmax(latest, c.time_since_power_on);
  return latest;
}

/// Adds the camera's longest integration time if the profile states it: with a capped lens no light fills the well.
std::vector<double> capped_times_of(const Design& design, std::vector<double> times) {
  const double longest = design.camera().integration_time[1];
  if (longest > times.back()) times.push_back(longest);
  return times;
}

using Surroundings = std::function<void(io::Condition&)>;

/// Conditions with one unusual setting each, as far as this camera and this campaign allow it: a camera that was on for
/// longer or was off, one of its sources alone, a lamp, a covered rail, a laser that measures the distance, a camera
/// that is turned.
std::vector<Surroundings> surroundings_of(const Design& design) {
  constexpr double quarter = std::numbers::pi / 2;
  const auto& conditions = design.conditions();
  const auto set = [](auto io::Condition::*member, auto value) {
    return [member, value](io::Condition& c) { c.*member = value; };
  };
  std::vector<Surroundings> all;
  const double latest = latest_of(design);
  if (latest > 0) all.emplace_back(set(&io::Condition::time_since_power_on, 2 * latest));
  if (latest > settings.cold_time) all.emplace_back(set(&io::Condition::time_since_power_on, settings.cold_time));
  const std::span lights(design.camera().lights, design.camera().light_count);
  for (const tofgraph_light& light : lights.size() > 1 ? lights : lights.first(0))
    all.emplace_back(set(&io::Condition::sources, std::vector<std::string>{light.name}));
  const auto lit = std::ranges::find_if(conditions, [](const io::Condition& c) { return c.ambient != "dark"; });
  all.emplace_back(set(&io::Condition::ambient, lit == conditions.end() ? "lamp" : lit->ambient));
  all.emplace_back(set(&io::Condition::rail, std::string("covered")));
  all.emplace_back(set(&io::Condition::reference, std::string("laser")));
  if (design.superpixels() > 1) all.emplace_back(set(&io::Condition::roll, quarter));
  return all;
}

/// True without any setting that surroundings_of() changes.
bool is_plain(const io::Condition& c) {
  return c.sources.empty() && c.ambient == "dark" && c.rail != "covered" && c.reference != "laser" && c.roll == 0;
}

/// A condition for each target, plain if the campaign has such a one, sorted from the darkest to the brightest target.
std::vector<io::Condition> targets_of(const Problem& problem, std::span<const double> light) {
  std::map<std::string, std::pair<double, std::size_t>> brightness;
  const auto& conditions = problem.design.conditions();
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    if (!problem.design.shows_board(i)) continue;
    const std::pair here(std::log(pose_of(conditions[i]).reflectivity) + log_reflectivity_of(problem, light, i), i);
    const auto [known, first] = brightness.try_emplace(conditions[i].target, here);
    if (!first && is_plain(conditions[i]) && !is_plain(conditions[known->second.second])) known->second = here;
  }
  std::vector<std::pair<double, std::size_t>> order;
  for (const auto& [name, place] : brightness) order.push_back(place);
  std::ranges::sort(order);
  std::vector<io::Condition> chosen;
  for (const auto& [ln, i] : thinned(order, max_targets)) chosen.push_back(conditions[i]);
  return chosen;
}

/// Settings of a measured condition, without those that apply to that measurement only.
io::Condition as_next(io::Condition c) {
  c.id = "next";
  c.places.clear();
  c.capture.clear();
  c.frames.reset();
  c.roi.reset();
  c.order.reset();
  c.recorded_at.clear();
  c.session.clear();
  c.measured = {};
  return c;
}

double sample_level(const Signal& signal, std::size_t observable) {
  return observable == intensity || observable == null1 ? signal.intensity : std::abs(signal.phasor);
}

}  // namespace

std::vector<io::Condition> candidate_conditions(const Problem& problem, std::span<const double> light) {
  using Tilts = std::vector<std::array<double, 2>>;
  const Design& design = problem.design;
  const Tilts tilts =
      design.superpixels() > 1 ? Tilts{{0, 0}, {tilt, 0}, {-tilt, 0}, {0, tilt}, {0, -tilt}} : Tilts{{0, 0}};
  const Reach reach(design);
  const std::vector<double> measured = measured_times(design);
  const double latest = latest_of(design);
  const std::vector<double> times = times_of(design), distances = distances_of(design);
  const std::vector<Surroundings> surroundings = surroundings_of(design);
  std::vector<io::Condition> all;
  // Without amplitudes a capped lens gives no information.
  const bool capped_tells = problem.light_seen() && design.superpixels() > 1;
  for (const double time : capped_tells ? capped_times_of(design, times) : std::vector<double>{}) {
    io::Condition capped;
    capped.id = "next";
    capped.lens = "capped";
    capped.integration_time = time;
    capped.time_since_power_on = latest;
    all.push_back(std::move(capped));
  }
  for (io::Condition c : targets_of(problem, light)) {
    c = as_next(c);
    c.time_since_power_on = latest;
    for (const auto& [x, y] : tilts) {
      for (const double z : distances) {
        c.board_distance = z;
        c.board_tilt_x = x;
        c.board_tilt_y = y;
        if (!reach.has(c)) continue;
        for (const double time : times) {
          c.integration_time = time;
          all.push_back(c);
          const bool other_time = time < measured.front() || time > measured.back();
          if (x != 0 || y != 0 || other_time) continue;  // one change at a time
          for (const Surroundings& change : surroundings) {
            all.push_back(c);
            change(all.back());
          }
        }
      }
    }
  }
  return all;
}

NoiseLaw::NoiseLaw(const Problem& problem, std::span<const double> light) {
  const std::size_t n = problem.design.superpixels();
  for (std::size_t o = 0; o < observables; ++o) {
    // Errors of the variances are relative: rows (1, I) / v against 1.
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < problem.data.size(); ++i) {
      if (!problem.design.shows_board(i)) continue;
      const double factor = std::exp(log_reflectivity_of(problem, light, i));
      for (std::size_t s = 0; s < n; ++s) {
        const double variance = problem.data[i].variance[o * n + s];
        if (!std::isfinite(variance)) continue;
        const Signal& ideal = problem.design.ideal(i)[s];
        const double level = factor * sample_level(ideal, o);
        const Eigen::Vector2d row = Eigen::Vector2d(1, factor * ideal.intensity) / (variance * level * level);
        normal += row * row.transpose();
        right += row;
      }
    }
    Law& law = laws_[o];
    law.known = normal(0, 0) > 0;
    if (!law.known) continue;
    // Scaled, because counts^2 and counts differ by orders of magnitude; neither part is below zero.
    const Eigen::Vector2d scale = normal.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::Matrix2d scaled = scale.asDiagonal() * normal * scale.asDiagonal();
    const Eigen::Vector2d both =
        scale.asDiagonal() * scaled.completeOrthogonalDecomposition().solve(scale.asDiagonal() * right);
    law.constant = both(1) < 0 ? right(0) / normal(0, 0) : both(0) < 0 ? 0 : both(0);
    law.slope = both(0) < 0 ? right(1) / normal(1, 1) : std::max(both(1), 0.0);
  }
}

Observations NoiseLaw::blank(const Design& design, std::size_t condition, double light) const {
  constexpr double none = std::numeric_limits<double>::infinity();
  const std::size_t n = design.superpixels();
  const double factor = std::exp(light), well = design.camera().full_well;
  const double pixels_a_superpixel =
      static_cast<double>(design.camera().width) * static_cast<double>(design.camera().height) / static_cast<double>(n);
  Observations result{std::vector<double>(design.rows(), 0), std::vector<double>(design.rows(), none)};
  for (std::size_t s = 0; s < n; ++s) {
    const Signal& ideal = design.ideal(condition)[s];
    const bool lit = design.shows_board(condition);
    const double mean = lit ? factor * ideal.intensity : 0, strength = lit ? factor * std::abs(ideal.phasor) : 0;
    if (well > 0 && mean + strength / 2 > settings.max_full_well_fraction * well) continue;
    for (std::size_t o = 0; o < observables; ++o) {
      const double level = factor * sample_level(ideal, o);
      const double variance = (laws_[o].constant + laws_[o].slope * mean) / (level * level);
      if (laws_[o].known && variance > 0) result.variance[o * n + s] = variance;
    }
    if (!(result.variance[amplitude * n + s] * settings.min_amplitude * settings.min_amplitude < 1) &&
        laws_[amplitude].known) {
      for (std::size_t o = 0; o < observables; ++o) result.variance[o * n + s] = none;
    }
    if (!lit) {  // taps may be clipped at zero: one superpixel with the noise of a pixel, as in measurements
      for (std::size_t o = 0; o < observables; ++o) result.variance[o * n + s] *= pixels_a_superpixel;
      if (std::isfinite(result.variance[amplitude * n + s])) break;
    }
  }
  return result;
}

}  // namespace tofgraph::diagnosis
