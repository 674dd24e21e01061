// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/pixel_spread.hpp"

#include <ceres/tiny_solver.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Dense>
#include <tofgraph/physics/constants.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>

namespace tofgraph::diagnosis {
namespace {

constexpr double gain_step = 2e-3;  ///< m, for the derivative of the measured distance

struct Law {
  std::string_view name, unit, sentence;
  double scale;  ///< from the unit of the value to that in the sentence
  double start;  ///< value at which a fit begins, in the law's unit
};

constexpr Law laws_of_spread[spread_laws] = {
    {"pattern", "m", "a fixed pattern of {:.2g} mm", 1e3, 2e-3},
    {"growing", "m/m", "a pattern that grows by {:.2g} mm per m of distance", 1e3, 1e-3},
    {"inside", "counts/s", "crosstalk that differs from pixel to pixel by {:.3g} counts/s", 1, 100},
    {"dark", "counts", "samples that differ from pixel to pixel by {:.2g} counts", 1, 0.5},
    {"temporal_noise", "", "noise of the frames {:.2g} times that of the profile", 1, 2},
};

const Law& law_of(SpreadLaw law) { return laws_of_spread[static_cast<std::size_t>(law)]; }

/// A problem without data, used only for the distances and amplitudes that a model expects.
struct Expected {
  std::vector<Observations> data;
  Design design;
  Problem problem;
  Expected(const io::CameraPtr& camera, bool physical, std::vector<io::Condition> conditions)
      : data(conditions.size(), {std::vector<double>(observables, 0), variances()}),
        design(camera, physical, std::move(conditions), single),
        problem(make_problem(design, data)) {}

  /// Observables of infinite variance are not expected.
  static std::vector<double> variances() {
    std::vector<double> result(observables, std::numeric_limits<double>::infinity());
    result[distance] = result[amplitude] = 1;
    return result;
  }

  /// Rows of all conditions. @param fitted problem whose reflectivities are used for targets of the same name
  Rows rows(const Problem& fitted, const State& state) const {
    const std::vector<double> unknown(problem.targets.size(), 0);
    return expected(problem,
                    State{state.terms, log_reflectivity_from(fitted, state, problem, unknown), state.random_sd});
  }
};

/// Rows of the conditions that state a standard deviation over pixels, with the amplitudes and gains of a fitted model.
/// @param state of the problem
std::vector<SpreadRow> spread_rows(const io::Campaign& campaign, bool physical, const Problem& problem,
                                   const State& state) {
  std::vector<io::Condition> used;
  for (const io::Condition& c : campaign.conditions) {
    if (c.measured.depth_sd > 0 && std::isfinite(c.integration_time) && c.has_board()) used.push_back(c);
  }
  if (used.empty()) return {};
  std::vector<io::Condition> farther = used;
  for (io::Condition& c : farther) c.board_distance += gain_step;
  const Expected here(campaign.camera, physical, used), there(campaign.camera, physical, farther);
  const auto rows = here.rows(problem, state), moved = there.rows(problem, state);
  std::vector<SpreadRow> result;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const io::Condition& c = used[i];
    result.push_back(
        {.target = c.target,
         .distance = c.board_distance,
         .integration_time = c.integration_time,
         .amplitude = std::abs(here.design.ideal(i).front().phasor) * std::exp(rows[i][amplitude]),
         .gain = 1 + (moved[i][distance] - rows[i][distance]) / (gain_step * here.design.shift(i)[distance]),
         .frames = c.measured.frames,
         .sd = c.measured.depth_sd,
         .reach = c.measured.reach});
  }
  return result;
}

using Laws = std::vector<SpreadLaw>;

constexpr double row_sd = 0.15;      ///< ln of a printed standard deviation; weight relative to the light's prior
constexpr double light_sd = 1;       ///< prior, ln of a target's light: a factor e
constexpr double near_share = 0.25;  ///< relative deviation within which a row counts as explained

/// Standard deviation of normal values after those farther from the mean than a reach are left out.
double within_reach(double sd, double reach) {
  if (std::isnan(reach)) return sd;
  const double a = reach / sd;
  if (a < 0.05) return reach / std::sqrt(3);  // uniform distribution
  const double inside = std::erf(a / std::numbers::sqrt2);
  const double density = std::exp(-a * a / 2) / std::sqrt(2 * std::numbers::pi);
  return sd * std::sqrt(1 - 2 * a * density / inside);
}

/// Standard deviation due to a law alone at its start value, m.
double size_of(SpreadLaw law, const SpreadRow& row, double amplitude, const SpreadNoise& noise) {
  const double unit = law_of(law).start, scale = noise.metres_per_radian / amplitude;
  switch (law) {
    case SpreadLaw::pattern:
      return unit;
    case SpreadLaw::growing:
      return unit * row.distance;
    case SpreadLaw::inside:
      return unit * row.integration_time * scale;
    case SpreadLaw::dark:
      return unit * scale;
    default:
      return unit * scale *
             std::sqrt((noise.read_noise * noise.read_noise + noise.shot_noise * amplitude / (2 * noise.contrast)) /
                       row.frames);
  }
}

/// Fit of selected laws to rows: least squares of the logarithms, by Levenberg and Marquardt.
class SpreadFit {
 public:
  SpreadFit(std::span<const SpreadRow> rows, Laws laws, const SpreadNoise& noise)
      : rows_(rows), laws_(std::move(laws)), noise_(noise) {
    for (const SpreadRow& row : rows) {
      if (!contains(targets_, row.target)) targets_.push_back(row.target);
    }
    const bool by_light = std::ranges::any_of(laws_, [](SpreadLaw law) { return law >= SpreadLaw::inside; });
    const auto lights = by_light ? targets_.size() - 1 : 0;
    values_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(laws_.size() + lights));
    values_.head(static_cast<Eigen::Index>(laws_.size())).setOnes();
    ceres::TinySolver<SpreadFit> solver;
    solver.options.initial_trust_region_radius = 1e2;
    solver.options.max_num_iterations = 1000;  // including rejected steps
    // Absolute change of the sum of squares, which is about the number of residuals at the best fit.
    solver.options.function_tolerance = 1e-9 * NumResiduals();
    solver.Solve(*this, &values_);
  }

  // Interface that the solver requires of a function.
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = Eigen::Dynamic };
  int NumResiduals() const { return static_cast<int>(std::ssize(rows_) + values_.size() - std::ssize(laws_)); }
  int NumParameters() const { return static_cast<int>(values_.size()); }
  bool operator()(const double* values, double* residual, double* jacobian) const {
    constexpr double step = 1e-6;
    const Eigen::VectorXd here = Eigen::Map<const Eigen::VectorXd>(values, values_.size()), r = residuals(here);
    Eigen::Map<Eigen::VectorXd>(residual, r.size()) = r;
    for (Eigen::Index j = 0; jacobian != nullptr && j < here.size(); ++j) {
      Eigen::VectorXd moved = here;
      moved[j] += step;
      Eigen::Map<Eigen::MatrixXd>(jacobian, r.size(), here.size()).col(j) = (residuals(moved) - r) / step;
    }
    return true;
  }

  double predicted(const SpreadRow& row) const { return predicted(row, values_); }
  double error(const SpreadRow& row) const { return std::log(row.sd / predicted(row)); }
  double squares() const {
    double sum = 0;
    for (const SpreadRow& row : rows_) sum += error(row) * error(row);
    return sum;
  }
  double bic() const {
    const auto n = static_cast<double>(rows_.size());
    return n * std::log(squares() / n) + static_cast<double>(values_.size()) * std::log(n);
  }
  std::vector<SpreadTerm> terms() const {
    std::vector<SpreadTerm> result;
    for (std::size_t k = 0; k < laws_.size(); ++k)
      result.push_back({laws_[k], std::abs(values_[static_cast<Eigen::Index>(k)]) * law_of(laws_[k]).start});
    return result;
  }
  std::map<std::string, double> light() const {
    std::map<std::string, double> result;
    for (const std::string& target : targets_) result[target] = std::exp(light_of(target, values_));
    return result;
  }

 private:
  double light_of(const std::string& target, const Eigen::VectorXd& values) const {
    const auto place = std::ranges::find(targets_, target) - targets_.begin();
    const auto at = static_cast<Eigen::Index>(laws_.size()) + place - 1;
    return place == 0 || at >= values.size() ? 0 : values[at];
  }

  double predicted(const SpreadRow& row, const Eigen::VectorXd& values) const {
    const double amplitude = row.amplitude * std::exp(light_of(row.target, values));
    double variance = 1e-12;  // a micrometre squared, so that the logarithm exists
    for (std::size_t k = 0; k < laws_.size(); ++k) {
      const double part = values[static_cast<Eigen::Index>(k)] * size_of(laws_[k], row, amplitude, noise_);
      variance += part * part;
    }
    return within_reach(row.gain * std::sqrt(variance), row.reach);
  }

  Eigen::VectorXd residuals(const Eigen::VectorXd& values) const {
    const auto n = static_cast<Eigen::Index>(rows_.size()), laws = static_cast<Eigen::Index>(laws_.size());
    Eigen::VectorXd r(n + values.size() - laws);
    for (Eigen::Index i = 0; i < n; ++i) {
      const SpreadRow& row = rows_[static_cast<std::size_t>(i)];
      r[i] = std::log(predicted(row, values) / row.sd) / row_sd;
    }
    r.tail(values.size() - laws) = values.tail(values.size() - laws) / light_sd;
    return r;
  }

  std::span<const SpreadRow> rows_;
  Laws laws_;
  SpreadNoise noise_;
  std::vector<std::string> targets_;  ///< in the order of the rows
  Eigen::VectorXd values_;  ///< in units of the laws' start values, then ln of the light of each further target
};

/// Laws that the rows can reveal.
Laws candidate_laws(std::span<const SpreadRow> rows, const SpreadNoise& noise) {
  Laws laws = {SpreadLaw::pattern, SpreadLaw::growing, SpreadLaw::inside, SpreadLaw::dark};
  const bool counted = std::ranges::all_of(rows, [](const SpreadRow& row) { return row.frames >= 1; });
  if (counted && noise.read_noise >= 0 && noise.shot_noise >= 0 && noise.contrast > 0)
    laws.push_back(SpreadLaw::temporal_noise);
  return laws;
}

/// Adds or removes one law after the other while the criterion falls.
Laws chosen_laws(std::span<const SpreadRow> rows, const SpreadNoise& noise) {
  Laws chosen;
  double best = std::numeric_limits<double>::infinity();
  for (;;) {
    Laws next;
    for (const SpreadLaw law : candidate_laws(rows, noise)) {
      Laws tried = chosen;
      if (std::erase(tried, law) == 0) tried.push_back(law);
      if (tried.empty()) continue;
      const double bic = SpreadFit(rows, tried, noise).bic();
      if (bic < best) best = bic, next = tried;
    }
    if (next.empty()) return chosen;
    chosen = next;
  }
}

double root_mean_square(const std::vector<double>& errors) {
  return std::sqrt(std::inner_product(errors.begin(), errors.end(), errors.begin(), 0.0) /
                   static_cast<double>(errors.size()));
}

double share_near(const std::vector<double>& errors) {
  const auto near = std::ranges::count_if(errors, [](double e) { return std::abs(std::exp(e) - 1) < near_share; });
  return static_cast<double>(near) / static_cast<double>(errors.size());
}

/// Errors of the rows of each distance, with laws selected and fitted without them.
std::vector<double> held_out_errors(std::span<const SpreadRow> rows, const SpreadNoise& noise) {
  std::set<double> distances;
  for (const SpreadRow& row : rows) distances.insert(row.distance);
  std::vector<double> errors;
  for (const double distance : distances) {
    std::vector<SpreadRow> others;
    std::ranges::copy_if(rows, std::back_inserter(others), [&](const SpreadRow& r) { return r.distance != distance; });
    if (others.size() < spread_laws + 2) return {};
    const SpreadFit fit(others, chosen_laws(others, noise), noise);
    for (const SpreadRow& row : rows) {
      if (row.distance == distance) errors.push_back(fit.error(row));
    }
  }
  return errors;
}

/// The group with the largest significant mean error.
std::optional<SpreadResidual> residual_of(std::span<const SpreadRow> rows, const SpreadFit& fit, double rms) {
  constexpr std::size_t few = 3;
  constexpr double significant = 3;  // standard deviations
  std::map<std::pair<std::string, std::string>, std::vector<double>> groups;
  for (const SpreadRow& row : rows) {
    groups[{"distance", fmt::format("{:.4g} m", row.distance)}].push_back(fit.error(row));
    groups[{"target", row.target}].push_back(fit.error(row));
    groups[{"integration_time", fmt::format("{:.4g} ms", row.integration_time * 1e3)}].push_back(fit.error(row));
  }
  std::optional<SpreadResidual> worst;
  for (const auto& [name, errors] : groups) {
    const auto n = static_cast<double>(errors.size());
    const double mean = std::accumulate(errors.begin(), errors.end(), 0.0) / n;
    if (errors.size() < few || std::abs(mean) * std::sqrt(n) < significant * rms) continue;
    if (!worst || std::abs(mean) > std::abs(std::log(worst->ratio)))
      worst = SpreadResidual{name.first, name.second, std::exp(mean), errors.size()};
  }
  return worst;
}

}  // namespace

std::optional<PixelSpread> pixel_spread(const io::Campaign& campaign, bool physical, const Problem& problem,
                                        const State& state) {
  if (!campaign.from_table) return std::nullopt;
  const tofgraph_camera& camera = campaign.camera->view();
  const SpreadNoise noise{camera.read_noise, camera.shot_noise, camera.contrast,
                          physics::metres_per_radian(camera.modulation_frequency)};
  return fit_spread(spread_rows(campaign, physical, problem, state), noise);
}

std::vector<std::string> notes_on_spread(const PixelSpread& spread) {
  std::vector<std::string> parts;
  for (const SpreadTerm& term : spread.terms) {
    const Law& law = law_of(term.law);
    parts.push_back(fmt::format(fmt::runtime(law.sentence), term.value * law.scale));
  }
  std::vector<std::string> notes = {fmt::format(
      "{} standard deviations over the pixels of boards are explained by {}: {:.0f} % of them within 25 %{}.",
      spread.rows, fmt::join(parts, ", "), 100 * spread.within,
      std::isfinite(spread.held_out_within)
          ? fmt::format(", {:.0f} % where laws were chosen and fitted without their distance",
                        100 * spread.held_out_within)
          : "")};
  if (spread.residual)
    notes.push_back(fmt::format(
        "Of the pixels' standard deviations, no law explains those of {} {}: {} rows are {:.2g} times the fitted ones.",
        spread.residual->setting, spread.residual->level, spread.residual->rows, spread.residual->ratio));
  return notes;
}

std::optional<PixelSpread> fit_spread(std::span<const SpreadRow> rows, const SpreadNoise& noise) {
  if (rows.size() < spread_laws + 2) return std::nullopt;
  const SpreadFit fit(rows, chosen_laws(rows, noise), noise);
  std::vector<double> errors;
  for (const SpreadRow& row : rows) errors.push_back(fit.error(row));
  PixelSpread result{.rows = rows.size(), .terms = fit.terms(), .light = fit.light()};
  result.rms = root_mean_square(errors);
  result.within = share_near(errors);
  if (const std::vector<double> aside = held_out_errors(rows, noise); aside.size() == rows.size()) {
    result.held_out_rms = root_mean_square(aside);
    result.held_out_within = share_near(aside);
  }
  result.residual = residual_of(rows, fit, result.rms);
  return result;
}

std::string_view spread_law_name(SpreadLaw law) { return law_of(law).name; }

std::string_view spread_law_unit(SpreadLaw law) { return law_of(law).unit; }

}  // namespace tofgraph::diagnosis
