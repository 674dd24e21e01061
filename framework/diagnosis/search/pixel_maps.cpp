// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/maps.hpp"

#include "diagnosis/data/ingest.hpp"
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/data/superpixels.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <Eigen/Dense>
#include <tofgraph/physics/constants.hpp>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <iterator>
#include <span>

namespace tofgraph::diagnosis {
namespace {

using Row = std::array<double, observables>;

/// Residual of a pixel.
Row difference_of(const Signal& seen, const Signal& base, double metres_per_radian) {
  const std::complex<double> ratio = seen.phasor / base.phasor;
  return {metres_per_radian * std::arg(ratio), std::log(std::abs(ratio)), std::log(seen.intensity / base.intensity),
          (seen.null1 - base.null1) / (2 * base.intensity), (seen.null2 - base.null2) / std::abs(base.phasor)};
}

/// Least squares for the maps of one term, pixel by pixel.
class PixelFit {
 public:
  PixelFit(const Problem& problem, const State& state, std::size_t term)
      : problem_(problem),
        state_(state),
        design_(problem.design),
        maps_(state.terms[term].maps->maps()),
        term_(term),
        model_(forward_model(state.terms, design_.camera(), design_.physical())),
        width_(design_.camera().width),
        height_(design_.camera().height),
        fits_(std::size_t{width_} * height_, {Eigen::MatrixXd::Zero(size(), size()), Eigen::VectorXd::Zero(size())}) {
    for (std::size_t m = 0; m < maps_.size(); ++m) probes_.push_back(probed(m));
    const auto rows = expected(problem, state);
    shared_ = difference(with_nuisances(problem, state, rows), rows);
  }

  /// Contribution of one condition to each pixel.
  struct Contribution {
    std::vector<Row> left, weight;
    std::vector<std::vector<Row>> responses;  ///< for each map
  };
  Contribution contribution_of(std::size_t condition, const FrameSums& frames) const {
    const double light = log_reflectivity_of(problem_, state_, condition);
    const double scale = physics::metres_per_radian(design_.acquisition(condition).condition.modulation_frequency);
    const std::vector<Signal> base = design_.photograph(model_, condition, light);
    const std::vector<bool> used = used_pixels(condition, frames);
    std::vector<std::size_t> members(design_.superpixels(), 0);
    for (std::size_t p = 0; p < used.size(); ++p) members[block_of(p)] += used[p] ? 1U : 0U;
    Contribution part{std::vector<Row>(base.size()), std::vector<Row>(base.size(), Row{}), {}};
    std::vector<Row>&left = part.left, &weight = part.weight;
    for (const simulation::ForwardModel& other : probes_) {
      const std::vector<Signal> moved = design_.photograph(other, condition, light);
      std::vector<Row>& response = part.responses.emplace_back(base.size(), Row{});
      for (std::size_t p = 0; p < base.size(); ++p) response[p] = difference_of(moved[p], base[p], scale);
    }
    for (std::size_t p = 0; p < base.size(); ++p) {
      if (!used[p] || !(std::abs(base[p].phasor) > 0)) continue;
      left[p] = difference_of(frames.mean(p), base[p], scale);
      for (std::size_t o = 0; o < observables; ++o) {
        // The noise of a pixel in the frames: a superpixel's variance is smaller by its number of pixels.
        const double variance =
            problem_.data[condition].variance[row(o, p)] * static_cast<double>(members[block_of(p)]);
        if (std::isfinite(variance) && std::isfinite(left[p][o])) weight[p][o] = 1 / variance;
        left[p][o] -= shared_[condition][row(o, p)];
        if (state_.nuisances.boards) left[p][o] -= state_.nuisances.boards->rows[condition][row(o, p)];
      }
    }
    take_out_own(condition, left, weight);
    return part;
  }

  /// Adds in the given order: sums in another order would differ in their last digits.
  void add(std::span<const Contribution> parts) {
    tbb::parallel_for(std::size_t{0}, fits_.size(), [&](std::size_t p) {
      Eigen::MatrixXd response(observables, size());
      for (const Contribution& part : parts) {
        if (part.left.empty()) continue;
        for (std::size_t m = 0; m < maps_.size(); ++m) {
          for (std::size_t o = 0; o < observables; ++o)
            response(static_cast<Eigen::Index>(o), static_cast<Eigen::Index>(m)) =
                part.weight[p][o] > 0 ? part.responses[m][p][o] / map_probe : 0;
        }
        const Eigen::Map<const Eigen::Array<double, observables, 1>> w(part.weight[p].data()), d(part.left[p].data());
        const Eigen::VectorXd pull = (w > 0).select(w * d, 0.0).matrix();
        fits_[p].information += response.transpose() * w.matrix().asDiagonal() * response;
        fits_[p].score += response.transpose() * pull;
      }
    });
  }

  std::vector<PixelMap> result() const {
    const Eigen::Index n = size();
    std::vector<std::vector<double>> raw(maps_.size()), variance(maps_.size());
    for (const Fit& fit : fits_) {
      const Eigen::VectorXd unit = fit.information.diagonal().cwiseSqrt().cwiseInverse();  // units of the maps differ
      const Eigen::LDLT<Eigen::MatrixXd> solver(unit.asDiagonal() * fit.information * unit.asDiagonal());
      if (!unit.allFinite() || !(solver.rcond() > 1e-12)) continue;
      const Eigen::MatrixXd covariance =
          unit.asDiagonal() * solver.solve(Eigen::MatrixXd::Identity(n, n)) * unit.asDiagonal();
      const Eigen::VectorXd value = covariance * fit.score;
      for (Eigen::Index m = 0; m < n; ++m) {
        raw[static_cast<std::size_t>(m)].push_back(std::abs(value(m)));
        variance[static_cast<std::size_t>(m)].push_back(covariance(m, m));
      }
    }
    std::vector<PixelMap> maps;
    Eigen::VectorXd prior(n);
    for (std::size_t m = 0; m < maps_.size(); ++m) {
      PixelMap& map = maps.emplace_back();
      map.effect = state_.terms[term_].candidate->name();
      map.dataset = state_.terms[term_].candidate->map_dataset(maps_[m].parameter);
      map.unit = maps_[m].parameter.unit;
      map.noise = std::sqrt(physics::median(variance[m]));
      // The median excludes broken pixels.
      const double all = physics::sd_of_deviations * physics::median(raw[m]);
      map.spread = std::min(std::sqrt(std::fmax(all * all - map.noise * map.noise, 0)), bound_of(m));
      map.values = state_.terms[term_].maps->of_pixels(m);
      prior(static_cast<Eigen::Index>(m)) = map.spread > 0 ? 1 / (map.spread * map.spread) : 1e30;
    }
    for (std::size_t p = 0; p < fits_.size(); ++p) {
      const Eigen::MatrixXd information = fits_[p].information + Eigen::MatrixXd(prior.asDiagonal());
      const Eigen::VectorXd value = information.ldlt().solve(fits_[p].score);
      for (std::size_t m = 0; m < maps.size(); ++m) {
        const double found = maps[m].values[p] + value(static_cast<Eigen::Index>(m)), bound = bound_of(m);
        maps[m].values[p] = std::clamp(found, -bound, bound);
      }
    }
    return maps;
  }

 private:
  /// Pixels that the superpixels may have used: those in the roi; for a board of stated size, those that see only it.
  std::vector<bool> used_pixels(std::size_t condition, const FrameSums& frames) const {
    const io::Condition& c = design_.conditions()[condition];
    std::vector<bool> used(fits_.size(), true);
    if (c.board_size) {
      const auto tracer = simulation::board_tracer(design_.camera().focal_length, pose_of(c));
      const simulation::Pixels whole = simulation::whole_image(design_.camera());
      used = on_board(c, model_.expect(tracer, design_.acquisition(condition), whole).hits, width_);
    }
    for (std::size_t p = 0; p < used.size(); ++p) {
      const std::size_t u = p % width_, v = p / width_;
      const bool inside = !c.roi || (u >= c.roi->first_column && u <= c.roi->last_column && v >= c.roi->first_row &&
                                     v <= c.roi->last_row);
      used[p] = used[p] && inside && frames.is_usable(p);
    }
    return used;
  }

  struct Fit {
    Eigen::MatrixXd information;
    Eigen::VectorXd score;
  };

  double bound_of(std::size_t m) const { return maps_[m].parameter.bound(design_); }
  Eigen::Index size() const { return static_cast<Eigen::Index>(maps_.size()); }
  std::size_t block_of(std::size_t pixel) const { return superpixel_of(pixel, height_, width_, design_.side()); }
  std::size_t row(std::size_t observable, std::size_t pixel) const {
    return observable * design_.superpixels() + block_of(pixel);
  }

  simulation::ForwardModel probed(std::size_t m) const {
    std::vector<EstimatedMaps::Map> moved = maps_;
    for (double& value : moved[m].values) value += map_probe;
    State other = state_;
    other.terms[term_].maps =
        std::make_shared<const EstimatedMaps>(std::move(moved), 0, design_.side(), design_.camera());
    return forward_model(other.terms, design_.camera(), design_.physical());
  }

  /// Projects out the position of the board and the light of the condition: nuisances that do not belong to a
  /// map.
  void take_out_own(std::size_t condition, std::vector<Row>& left, const std::vector<Row>& weight) const {
    Eigen::Matrix2d information = 1e-30 * Eigen::Matrix2d::Identity();
    Eigen::Vector2d score = Eigen::Vector2d::Zero();
    const auto own = [&](std::size_t p, std::size_t o) {
      return Eigen::Vector2d(design_.shift(condition)[row(o, p)],
                             state_.light_response(problem_, condition, row(o, p)));
    };
    for (std::size_t p = 0; p < left.size(); ++p) {
      for (std::size_t o = 0; o < observables; ++o) {
        if (!(weight[p][o] > 0)) continue;
        information += weight[p][o] * own(p, o) * own(p, o).transpose();
        score += weight[p][o] * left[p][o] * own(p, o);
      }
    }
    const Eigen::Vector2d size = information.ldlt().solve(score);
    for (std::size_t p = 0; p < left.size(); ++p) {
      for (std::size_t o = 0; o < observables; ++o) left[p][o] -= own(p, o).dot(size);
    }
  }

  const Problem& problem_;
  const State& state_;
  const Design& design_;
  const std::vector<EstimatedMaps::Map>& maps_;
  std::size_t term_;
  simulation::ForwardModel model_;
  std::vector<simulation::ForwardModel> probes_;
  std::size_t width_, height_;
  Column shared_;  ///< shared nuisances such as drift or contrast, not part of any map
  std::vector<Fit> fits_;
};

/// True if the data leave one of the amplitudes of a group undetermined when fitted with the maps of a fit.
bool is_left_open(const Problem& problem, const ModelFit& fit, const Group& group) {
  const Score score = score_of(problem, fit, group, {}, map_columns(problem, fit.state));
  const Eigen::Index n = score.information.rows();
  const Eigen::MatrixXd prior = Eigen::MatrixXd::Identity(n, n) / (settings.prior_width * settings.prior_width);
  const Eigen::VectorXd variance = (score.information + prior).inverse().diagonal();
  return 1.96 * std::sqrt(variance.maxCoeff()) > settings.max_tie_width;
}

}  // namespace

std::vector<PixelMap> pixel_maps(const Measurements& measurements, const Problem& problem, const State& state) {
  std::deque<PixelFit> fits;
  for (std::size_t t = 0; t < state.terms.size(); ++t) {
    if (state.terms[t].maps) fits.emplace_back(problem, state, t);
  }
  if (fits.empty()) return {};
  constexpr std::size_t together = 8;  // conditions held in memory at once
  for (std::size_t first = 0; first < problem.design.size(); first += together) {
    std::vector<std::vector<PixelFit::Contribution>> parts(
        fits.size(), std::vector<PixelFit::Contribution>(std::min(together, problem.design.size() - first)));
    tbb::parallel_for(std::size_t{0}, parts.front().size(), [&](std::size_t k) {
      const std::size_t i = first + k;
      if (!problem.design.shows_board(i)) return;
      const FrameSums sums =
          read_frames(measurements.design->conditions()[i], *measurements.design->camera_pointer()).sums;
      for (std::size_t f = 0; f < fits.size(); ++f) parts[f][k] = fits[f].contribution_of(i, sums);
    });
    for (std::size_t f = 0; f < fits.size(); ++f) fits[f].add(parts[f]);
  }
  std::vector<PixelMap> all;
  for (const PixelFit& fit : fits) std::ranges::move(fit.result(), std::back_inserter(all));
  return all;
}

std::vector<std::string> notes_on_pattern_ties(const Problem& problem, const ModelFit& given,
                                               const Candidates& candidates) {
  std::vector<std::string> notes;
  const ModelFit fit = with_jacobian(problem, given);
  const Probes probes = probes_of(problem, fit.state, candidates, NonlinearRange::usual);
  for (const Term& term : fit.state.terms) {
    if (!term.maps) continue;
    const std::vector<std::string> alike = confused_with(*term.candidate, candidates);
    for (std::size_t p = 0; p < probes.list.size(); ++p) {
      const Candidate& other = *probes.list[p].candidate;
      if (other.border().scope != TOFGRAPH_SCOPE_SETUP || !contains(alike, other.name()) ||
          !is_left_open(problem, fit, probes.groups[p]))
        continue;
      notes.push_back(fmt::format(
          "These conditions cannot distinguish {} from the map of {}: a slope of the map over the image may be either. "
          "What does: {}.",
          other.name(), term.candidate->name(), other.border().experiment));
    }
  }
  return notes;
}

}  // namespace tofgraph::diagnosis
