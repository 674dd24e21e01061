// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Photon transfer: the variance of a tap is read_noise^2 + shot_noise level, fitted to all pixels of all conditions.
#include "calibration/noise.hpp"
#include "calibration/noise_pixels.hpp"
#include "config/diagnostics.hpp"

#include <fmt/format.h>
#include <Eigen/Dense>
#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <cmath>
#include <map>

namespace tofgraph::calibration {
namespace {

constexpr double min_level_ratio = 2;    ///< ratio of the levels' 99 and 1 percentiles: below, one term is unknown
constexpr double max_phase_sigma = 0.2;  ///< rad: above, phase noise is not proportional to noise over amplitude

/// Sums of one condition for a weighted fit of a straight line.
struct Line {
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
  Eigen::Vector2d product = Eigen::Vector2d::Zero();
  Line& operator+=(const Line& other) {
    square += other.square;
    product += other.product;
    return *this;
  }
};

Line operator-(const Line& a, const Line& b) { return {a.square - b.square, a.product - b.product}; }

/// Returns true if both parameters are determined.
bool solvable(const Line& line) {
  constexpr double singular = 1e-6;
  return line.square(0, 0) > 0 && line.square.determinant() > singular * line.square(0, 0) * line.square(1, 1);
}

/// Solution (read_noise^2, shot_noise); neither is negative.
Eigen::Vector2d solve(const Line& line) {
  Eigen::Vector2d x = line.square.ldlt().solve(line.product);
  if (x[0] < 0) x = {0, line.product[1] / line.square(1, 1)};
  if (x[1] < 0) x = {line.product[0] / line.square(0, 0), 0};
  return x;
}

double variance_at(const Eigen::Vector2d& x, double level) { return std::max(x[0] + x[1] * level, 1e-12); }

/// Index of the logarithmic bin of a positive value, with `ranges` bins per octave.
int octave_of(double value, int ranges) { return physics::to_integer(std::floor(ranges * std::log2(value)), 0); }

bool usable(const PixelNoise& p, const std::vector<std::uint8_t>& bad, std::size_t i) {
  return bad[i] == 0 && p.is_good(i) && p.level[i] > 0 && std::isfinite(p.variance[i]);
}

std::vector<Line> lines_of(const NoiseData& data, const Eigen::Vector2d& x, const std::vector<std::uint8_t>& bad) {
  std::vector<Line> lines;
  for (const NoiseCondition& c : data.conditions) {
    Line& line = lines.emplace_back();
    for (std::size_t i = 0; i < bad.size(); ++i) {
      if (!usable(c.pixels, bad, i)) continue;
      const double level = c.pixels.level[i], v = variance_at(x, level), weight = c.pixels.samples / (2 * v * v);
      const Eigen::Vector2d row(1, level);
      line.square += weight * row * row.transpose();
      line.product += weight * double{c.pixels.variance[i]} * row;
    }
  }
  return lines;
}

Line sum_of(const std::vector<Line>& lines) {
  Line all;
  for (const Line& line : lines) all += line;
  return all;
}

/// Iteratively reweighted fit: weights follow from the variances of the previous fit.
Eigen::Vector2d settle(const NoiseData& data, const std::vector<std::uint8_t>& bad, std::vector<Line>& lines) {
  Eigen::Vector2d x(1, 0.01);
  for (int round = 0; round < 6; ++round) {
    lines = lines_of(data, x, bad);
    x = solve(sum_of(lines));
  }
  return x;
}

void check_levels(const NoiseData& data, const std::vector<std::uint8_t>& bad, NoiseFit& fit) {
  std::vector<double> levels;
  for (const NoiseCondition& c : data.conditions) {
    for (std::size_t i = 0; i < bad.size(); ++i) {
      if (usable(c.pixels, bad, i)) levels.push_back(c.pixels.level[i]);
    }
  }
  if (levels.empty())
    throw config::ConfigurationError(
        "no pixel was valid, lit and unsaturated in every frame of a condition\n  the noise needs frames of a static "
        "scene, two or more of each condition");
  const auto at = [&](double share) {
    const auto place = levels.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(levels.size() - 1));
    std::ranges::nth_element(levels, place);
    return *place;
  };
  bool changes = false;
  for (const NoiseCondition& c : data.conditions)
    changes = changes || std::ranges::any_of(c.pixels.variance, [](float v) { return v > 0; });
  if (!changes)
    throw config::ConfigurationError(
        "nothing changes from frame to frame: these frames have no noise\n  record several frames with a camera, or "
        "simulate them with noise");
  const double low = at(0.01), high = at(0.99);
  fit.max_level = high;
  if (high / low < min_level_ratio)
    throw config::ConfigurationError(
        fmt::format("the light hardly varies: the taps hold {:.4g} to {:.4g} counts\n  read and shot noise cannot be "
                    "separated: record at several integration times or distances",
                    low, high));
}

/// Sets standard deviations of both parameters by the jackknife over conditions; for few conditions from the fit.
void set_deviations(const std::vector<Line>& lines, const Eigen::Vector2d& x, NoiseFit& fit) {
  const Line all = sum_of(lines);
  const Eigen::Matrix2d covariance = all.square.inverse();
  Eigen::Vector2d sd(std::sqrt(covariance(0, 0)), std::sqrt(covariance(1, 1)));
  if (constexpr std::size_t enough = 4; lines.size() >= enough) {
    Eigen::Vector2d squares = Eigen::Vector2d::Zero();
    for (const Line& line : lines) squares += (solve(all - line) - x).cwiseAbs2();
    const auto n = static_cast<double>(lines.size());
    sd = sd.cwiseMax(((n - 1) / n * squares).cwiseSqrt());
  }
  // For a read noise near 0 only its square is determined.
  fit.read_sd = std::min(sd[0] / (2 * std::max(fit.noise.read_noise, 1e-9)), std::sqrt(sd[0]));
  fit.shot_sd = sd[1];
}

/// Fits a third term, q level^2: flickering light, or a non-linear converter.
void set_excess(const NoiseData& data, const Eigen::Vector2d& x, NoiseFit& fit) {
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
  Eigen::Vector3d product = Eigen::Vector3d::Zero();
  for (const NoiseCondition& c : data.conditions) {
    for (std::size_t i = 0; i < fit.bad.size(); ++i) {
      if (!usable(c.pixels, fit.bad, i)) continue;
      const double level = c.pixels.level[i], v = variance_at(x, level);
      const Eigen::Vector3d row(1, level, level * level);
      const double weight = c.pixels.samples / (2 * v * v);
      square += weight * row * row.transpose();
      product += weight * double{c.pixels.variance[i]} * row;
    }
  }
  const Eigen::Matrix3d covariance = square.inverse();
  fit.excess = (covariance * product)[2];
  fit.excess_sd = std::sqrt(covariance(2, 2));
}

/// Sums of measured and predicted variances of distances.
struct Sum {
  double measured = 0, predicted = 0, amplitude = 0;
  std::size_t pixels = 0;
  void add(double m, double p, double a) {
    measured += m;
    predicted += p;
    amplitude += a;
    ++pixels;
  }
  SigmaRatio ratio(const std::string& name, double time) const {
    const double n = static_cast<double>(std::max<std::size_t>(pixels, 1));
    return {name, time, amplitude / n, std::sqrt(measured / n), std::sqrt(predicted / n), pixels};
  }
};

/// Predicts every condition with a fit without its level.
void predict(const NoiseData& data, const io::Campaign* campaign, const std::vector<Line>& lines, NoiseFit& fit) {
  std::map<double, std::vector<std::size_t>> levels;
  bool known = true;
  for (std::size_t c = 0; c < data.conditions.size(); ++c) {
    known = known && std::isfinite(data.conditions[c].integration_time);
    if (known) levels[data.conditions[c].integration_time].push_back(c);
  }
  const bool by_time = known && levels.size() >= 3;
  fit.left_out = by_time ? "integration_time" : "condition";
  if (!by_time) {
    levels.clear();
    for (std::size_t c = 0; c < data.conditions.size(); ++c) levels[static_cast<double>(c)].push_back(c);
  }
  const Line all = sum_of(lines);
  const double scale = physics::metres_per_radian(data.modulation_frequency);
  std::map<int, Sum> by_amplitude;
  std::map<double, std::vector<double>> ratios, errors, stated;
  Eigen::Vector2d profile(unknown, unknown);
  if (campaign != nullptr) {
    const tofgraph_camera& camera = campaign->camera->view();
    profile = {camera.read_noise * camera.read_noise, camera.shot_noise};
  }
  if (levels.size() > 1) {
    for (const auto& [level, members] : levels) {
      Line others = all;
      for (const std::size_t c : members) others = others - lines[c];
      if (!solvable(others)) continue;
      const Eigen::Vector2d x = solve(others);
      for (const std::size_t c : members) {
        const PixelNoise& p = data.conditions[c].pixels;
        Sum sum, by_profile;
        for (std::size_t i = 0; i < fit.bad.size(); ++i) {
          if (!usable(p, fit.bad, i)) continue;
          const double a = p.amplitude[i], sigma = scale * std::sqrt(variance_at(x, p.level[i])) / a;
          if (sigma > max_phase_sigma * scale) continue;
          sum.add(p.distance_variance[i], sigma * sigma, a);
          by_profile.add(p.distance_variance[i], scale * scale * variance_at(profile, p.level[i]) / (a * a), a);
          by_amplitude[octave_of(a, 2)].add(p.distance_variance[i], sigma * sigma, a);
        }
        if (sum.pixels == 0) continue;
        const std::size_t index = data.conditions[c].index;
        fit.conditions.push_back(
            sum.ratio(campaign != nullptr ? campaign->conditions[index].id : "", data.conditions[c].integration_time));
        ratios[level].push_back(fit.conditions.back().measured / fit.conditions.back().predicted);
        errors[level].push_back(std::log(ratios[level].back()));
        stated[level].push_back(std::log(by_profile.measured / by_profile.predicted) / 2);
      }
    }
  }
  for (const auto& [bin, sum] : by_amplitude) fit.amplitudes.push_back(sum.ratio("", unknown));
  fit.held_out = interval_of(ratios);
  fit.error = interval_of(errors).value;
  fit.error_by_profile = interval_of(stated).value;
}

/// Mean variances in ranges of the level, for the plot.
void set_bins(const NoiseData& data, const Eigen::Vector2d& x, NoiseFit& fit) {
  std::map<int, std::array<double, 3>> bins;
  for (const NoiseCondition& c : data.conditions) {
    for (std::size_t i = 0; i < fit.bad.size(); ++i) {
      if (!usable(c.pixels, fit.bad, i)) continue;
      auto& bin = bins[octave_of(c.pixels.level[i], 8)];
      bin[0] += 1;
      bin[1] += c.pixels.level[i];
      bin[2] += c.pixels.variance[i];
    }
  }
  for (const auto& [key, bin] : bins) {
    constexpr double few = 50;
    if (bin[0] < few) continue;
    fit.bin_level.push_back(bin[1] / bin[0]);
    fit.bin_variance.push_back(bin[2] / bin[0]);
    fit.bin_model.push_back(variance_at(x, bin[1] / bin[0]));
  }
}

}  // namespace

NoiseFit fit_noise(const NoiseData& data, const io::Campaign* campaign) {
  NoiseFit fit;
  fit.bad = data.listed;
  mark_response(data, fit);
  check_levels(data, fit.bad, fit);
  std::vector<Line> lines;
  Eigen::Vector2d x;
  // Bad pixels are detected against a fit that they bias: two passes are sufficient.
  for (int round = 0; round < 3; ++round) {
    x = settle(data, fit.bad, lines);
    fit.noise = {.read_noise = std::sqrt(x[0]), .shot_noise = x[1]};
    if (round == 2) break;
    mark_noise(data, fit);
    mark_frozen(data, fit);
  }
  set_deviations(lines, x, fit);
  set_excess(data, x, fit);
  predict(data, campaign, lines, fit);
  set_bins(data, x, fit);
  return fit;
}

}  // namespace tofgraph::calibration
