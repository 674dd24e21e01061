// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/board_nuisances.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "simulation/board.hpp"

#include <tbb/parallel_for.h>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Products of a direction with itself and with one observable's residual in a condition, in units of the noise.
struct Along {
  double square = 0, product = 0;
};
/// @param direction, off functions of a row: the direction, and the residual
template <class Direction, class Off> Along along(const Problem& problem, std::size_t condition, std::size_t observable,
                                                  const Direction& direction, const Off& off) {
  const std::size_t n = problem.design.superpixels();
  Along sums;
  for (std::size_t row = observable * n; row < (observable + 1) * n; ++row) {
    const double variance = problem.data[condition].variance[row];
    if (std::isinf(variance)) continue;
    sums.square += direction(row) * direction(row) / variance;
    sums.product += direction(row) * off(row) / variance;
  }
  return sums;
}

/// Points at which superpixels see a board.
std::vector<PlaceOnBoard> places_on_board(const Design& design, std::size_t condition) {
  const simulation::BoardPose pose = pose_of(design.conditions()[condition]);
  const std::vector<simulation::Vector3>& rays = design.pixels().rays;
  std::vector<simulation::Hit> hits(rays.size());
  simulation::board_tracer(design.camera().focal_length, pose)({}, rays, hits);
  const auto turned = [&](simulation::Vector3 axis) {
    return simulation::rotation(0, 0, -pose.roll) * (simulation::rotation(pose.tilt_x, pose.tilt_y, 0) * axis);
  };
  const simulation::Vector3 across = turned({1, 0, 0}), down = turned({0, 1, 0}), middle{0, 0, pose.distance};
  std::vector<PlaceOnBoard> places(rays.size(), {NAN, NAN});
  for (std::size_t s = 0; s < rays.size(); ++s) {
    if (!std::isfinite(hits[s].return_path)) continue;
    const simulation::Vector3 from = hits[s].point - middle;
    places[s] = {physics::dot(from, across), physics::dot(from, down)};
  }
  return places;
}

/// Columns of a condition over the noise: the board's position, its light, and the camera's drift. They are projected
/// out, so that flatness cannot absorb them.
Eigen::MatrixXd own_directions(const Problem& problem, std::size_t i) {
  const std::size_t n = problem.design.superpixels();
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(problem.design.rows()), 3);
  for (std::size_t row = 0; row < problem.design.rows(); ++row) {
    const double variance = problem.data[i].variance[row];
    if (std::isinf(variance)) continue;
    const bool light = row / n == amplitude || row / n == intensity;
    columns.row(static_cast<Eigen::Index>(row)) << problem.design.shift(i)[row] / std::sqrt(variance),
        light ? 1 / std::sqrt(variance) : 0, problem.uniform_response(i, row) / std::sqrt(variance);
  }
  return columns;
}

/// Residuals of the other columns after projection on the first ones.
Eigen::MatrixXd less(const Eigen::MatrixXd& first, const Eigen::MatrixXd& others) {
  const Eigen::MatrixXd gram = first.transpose() * first + 1e-9 * Eigen::MatrixXd::Identity(first.cols(), first.cols());
  return others - first * gram.ldlt().solve(first.transpose() * others);
}

struct Wave {
  int x = 0, y = 0;  ///< half waves
  double sd = 0;     ///< the squares of all waves sum to 1
};

std::vector<Wave> make_waves() {
  std::vector<Wave> waves;
  double sum = 0;
  for (int x = 0; x <= settings.board_max_half_waves; ++x) {
    for (int y = 0; y <= settings.board_max_half_waves; ++y) {
      if (x + y == 0 || std::hypot(x, y) > settings.board_max_half_waves) continue;
      waves.push_back(
          {x, y, 1 / (1 + (x * x + y * y) / (settings.board_spectrum_bend * settings.board_spectrum_bend))});
      sum += waves.back().sd * waves.back().sd;
    }
  }
  for (Wave& wave : waves) wave.sd /= std::sqrt(sum);
  return waves;
}

const std::vector<Wave>& waves_of_boards() {
  static const std::vector<Wave> waves = make_waves();
  return waves;
}

struct ScoreTest {
  double deviance = 0, square = 0;
};

/// Score test of height fields with a standard deviation.
ScoreTest score_test(const Eigen::MatrixXd& information, const Eigen::VectorXd& score, double sd) {
  Eigen::MatrixXd inner = sd * sd * information;
  inner.diagonal().array() += 1;
  const Eigen::LDLT<Eigen::MatrixXd> factors(inner);
  const Eigen::VectorXd values = sd * sd * factors.solve(score);
  return {values.dot(score) - factors.vectorD().array().log().sum(),
          2 * values.dot(score) - values.dot(information * values)};
}

double mean_of_wave(double phase) { return phase == 0 ? 1 : std::sin(phase / 2) / (phase / 2); }

}  // namespace

BoardOffsets board_offsets_of(const Problem& problem, const State& state) {
  const auto rows = with_nuisances(problem, state, expected(problem, state));
  BoardOffsets offsets{std::vector<double>(rows.size(), 0), std::vector<double>(rows.size(), 0),
                       state.random_sd.jitter};
  std::vector<double> magnitudes;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto light = [&](std::size_t row) { return state.light_response(problem, i, row); };
    const auto shift = [&](std::size_t row) { return problem.design.shift(i)[row]; };
    const auto off = [&](std::size_t row) { return problem.data[i].value[row] - rows[i][row]; };
    const Along bright = along(problem, i, amplitude, light, off);
    const double prior = state.random_sd.light * state.random_sd.light;
    const double brighter = prior * bright.product / (1 + prior * bright.square);  // ln of its light, estimated
    const Along place =
        along(problem, i, distance, shift, [&](std::size_t row) { return off(row) - brighter * light(row); });
    if (!(place.square > 0)) continue;
    offsets.error[i] = place.product / place.square;
    offsets.noise[i] = 1 / std::sqrt(place.square);
    magnitudes.push_back(std::abs(offsets.error[i]));
  }
  if (magnitudes.size() < settings.misplaced_min_conditions) return offsets;
  offsets.sd = physics::sd_of_deviations * physics::median(magnitudes);
  return offsets;
}

std::vector<double> jitter_scale_of(const BoardOffsets& offsets) {
  std::vector<double> jitter_scale;
  for (std::size_t i = 0; i < offsets.error.size(); ++i) {
    const double t = offsets.error[i] / offsets.expected_sd(i);
    const double times = std::sqrt((settings.board_offset_freedom + t * t) / (settings.board_offset_freedom + 1));
    jitter_scale.push_back(times > settings.min_jitter_scale ? times : 1);
  }
  return jitter_scale;
}

std::vector<Misplaced> misplaced(const BoardOffsets& offsets) {
  std::vector<Misplaced> result;
  for (std::size_t i = 0; i < offsets.error.size(); ++i) {
    if (std::abs(offsets.error[i]) >
        std::max(settings.misplaced_sd * offsets.expected_sd(i), settings.misplaced_distance))
      result.push_back({i, offsets.error[i]});
  }
  return result;
}

BoardFlatness::BoardFlatness(const Problem& problem) : views_(problem.design.size()) {
  const Design& design = problem.design;
  for (std::size_t i = 0; i < design.size(); ++i) {
    if (!design.shows_board(i)) continue;
    View& view = views_[i];
    view.places = places_on_board(design, i);
    for (std::size_t s = 0; s < view.places.size(); ++s) {
      PlaceOnBoard& place = view.places[s];
      if (std::isinf(problem.data[i].variance[distance * design.superpixels() + s])) place = {NAN, NAN};
      if (std::isfinite(place.x)) view.widest = std::max({view.widest, std::abs(place.x), std::abs(place.y)});
    }
    double& half = half_width_[design.conditions()[i].target];
    half = std::max(half, view.widest);
  }
  const auto count = static_cast<Eigen::Index>(waves_of_boards().size());
  constexpr std::size_t at_once = 64;  // a Gram matrix has 0.2 MB
  std::vector<Eigen::MatrixXd> grams(at_once);
  for (std::size_t first = 0; first < design.size(); first += at_once) {
    const std::size_t end = std::min(first + at_once, design.size());
    tbb::parallel_for(first, end, [&](std::size_t i) {
      grams[i - first] = Eigen::MatrixXd::Zero(count, count);
      if (!design.shows_board(i)) return;
      const Eigen::MatrixXd taken = own_directions(problem, i);
      const Eigen::MatrixXd columns =
          less(taken, taken.col(0).asDiagonal() * heights(design, i).replicate(observables, 1));
      grams[i - first].selfadjointView<Eigen::Lower>().rankUpdate(columns.transpose());
    });
    for (std::size_t i = first; i < end; ++i) {
      if (!design.shows_board(i)) continue;
      Eigen::MatrixXd& of_target = information_[design.conditions()[i].target];
      if (of_target.size() == 0) of_target = Eigen::MatrixXd::Zero(count, count);
      of_target += grams[i - first].selfadjointView<Eigen::Lower>();
    }
  }
}

Eigen::MatrixXd BoardFlatness::heights(const Design& design, std::size_t i) const {
  const std::vector<Wave>& waves = waves_of_boards();
  const auto n = static_cast<Eigen::Index>(design.superpixels()), count = static_cast<Eigen::Index>(waves.size());
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(n, count);
  const View& view = views_[i];
  if (view.places.empty()) return result;
  // Heights are normal to the board; its position is measured along the axis.
  const io::Condition& condition = design.conditions()[i];
  const simulation::BoardPose pose = pose_of(condition);
  const double along_axis = std::cos(pose.tilt_x) * std::cos(pose.tilt_y);
  const double half = half_width_.at(condition.target);
  const double width = 2 * view.widest / (std::sqrt(static_cast<double>(n)) - 1);
  const auto frequency = [&](int half_waves) { return half_waves * std::numbers::pi / (2 * half); };
  Eigen::MatrixXd across(n, settings.board_max_half_waves + 1), down = across;
  for (int k = 0; k <= settings.board_max_half_waves; ++k) {
    for (Eigen::Index s = 0; s < n; ++s) {
      const PlaceOnBoard& place = view.places[static_cast<std::size_t>(s)];
      across(s, k) = std::cos(frequency(k) * (place.x + half));
      down(s, k) = std::cos(frequency(k) * (place.y + half));
    }
  }
  for (Eigen::Index c = 0; c < count; ++c) {
    const Wave& wave = waves[static_cast<std::size_t>(c)];
    // Superpixels average the waves.
    const double size =
        2 * wave.sd * mean_of_wave(frequency(wave.x) * width) * mean_of_wave(frequency(wave.y) * width) / along_axis;
    for (Eigen::Index s = 0; s < n; ++s) {
      if (std::isfinite(view.places[static_cast<std::size_t>(s)].x))
        result(s, c) = size * across(s, wave.x) * down(s, wave.y);
    }
  }
  return result;
}

BoardTrial BoardFlatness::trial(const Problem& problem, const State& state) const {
  const Design& design = problem.design;
  const State flat = with_flat_boards(state);
  const auto rows = with_nuisances(problem, flat, expected(problem, flat));
  std::map<std::string, Eigen::VectorXd> scores;
  const auto count = static_cast<Eigen::Index>(waves_of_boards().size());
  double excess = 0;
  for (std::size_t i = 0; i < design.size(); ++i) {
    if (!design.shows_board(i)) continue;
    const Observations& data = problem.data[i];
    Eigen::MatrixXd left = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(design.rows()), 1);
    for (std::size_t row = 0; row < design.rows(); ++row) {
      if (std::isinf(data.variance[row])) continue;
      left(static_cast<Eigen::Index>(row)) = (data.value[row] - rows[i][row]) / std::sqrt(data.variance[row]);
      excess -= 1;
    }
    const Eigen::MatrixXd taken = own_directions(problem, i);
    left = less(taken, left);
    excess += left.squaredNorm();
    const Eigen::VectorXd along = taken.col(0).cwiseProduct(left.col(0));
    Eigen::VectorXd& score = scores[design.conditions()[i].target];
    if (score.size() == 0) score = Eigen::VectorXd::Zero(count);
    score += heights(design, i).transpose() *
             along.reshaped(static_cast<Eigen::Index>(design.superpixels()), observables).rowwise().sum();
  }
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd sum_of_scores = Eigen::VectorXd::Zero(count);
  for (const auto& [name, score] : scores) all += information_.at(name), sum_of_scores += score;
  double best = 0, one_for_all = 0;
  ScoreTest max_fall{settings.board_min_deviance_gain, 0};
  for (double sd = settings.board_min_trial_sd; sd <= settings.board_max_trial_sd; sd *= settings.board_trial_factor) {
    one_for_all = std::max(one_for_all, score_test(all, sum_of_scores, sd).deviance);
    ScoreTest sum;
    for (const auto& [name, score] : scores) {
      const ScoreTest one = score_test(information_.at(name), score, sd);
      sum.deviance += one.deviance, sum.square += one.square;
    }
    if (sum.deviance > max_fall.deviance) max_fall = sum, best = sd;
  }
  const bool several = scores.size() > 1;
  if (best == 0 || max_fall.square < settings.board_min_share * excess ||
      (several && one_for_all > settings.board_max_common_gain * max_fall.deviance))
    return {};
  // Separate fields must gain more over a common one than the remaining excess, which may be the camera's.
  const bool sure = several && max_fall.square >= settings.board_sure_share * excess &&
                    max_fall.deviance - one_for_all >= excess - max_fall.square;
  std::shared_ptr<const Boards> boards = shaped(design, scores, best);
  if (!boards) return {};
  return {std::move(boards), max_fall.deviance, sure};
}

std::shared_ptr<const Boards> BoardFlatness::shaped(const Design& design,
                                                    const std::map<std::string, Eigen::VectorXd>& scores,
                                                    double sd) const {
  Boards result{0, Rows(design.size())};
  std::map<std::string, Eigen::VectorXd> values;
  for (const auto& [name, score] : scores) {
    Eigen::MatrixXd inner = information_.at(name);
    inner.diagonal().array() += 1 / (sd * sd);
    const Eigen::LDLT<Eigen::MatrixXd> factors(inner);
    values[name] = factors.solve(score);
    result.cost += values[name].squaredNorm() / (sd * sd) + (sd * sd * factors.vectorD().array()).log().sum();
  }
  for (std::size_t i = 0; i < design.size(); ++i) {
    result.rows[i].assign(design.rows(), 0);
    if (!design.shows_board(i)) continue;
    const Eigen::VectorXd height = heights(design, i) * values.at(design.conditions()[i].target);
    result.sd += (height.array() - height.mean()).square().mean() / static_cast<double>(design.boards());
    for (std::size_t row = 0; row < design.rows(); ++row)
      result.rows[i][row] = design.shift(i)[row] * height(static_cast<Eigen::Index>(row % design.superpixels()));
  }
  result.sd = std::sqrt(result.sd);
  if (result.sd > settings.board_max_sd) return nullptr;
  return std::make_shared<const Boards>(std::move(result));
}

}  // namespace tofgraph::diagnosis
