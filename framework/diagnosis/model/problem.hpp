// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Data to be explained, and a model of them with its expectations and derivatives. Everything that belongs to one
/// model is in its State.
#pragma once

#include "diagnosis/data/design.hpp"
#include "diagnosis/model/candidate.hpp"
#include "diagnosis/model/mixed_model.hpp"
#include "diagnosis/model/nuisances.hpp"
#include "diagnosis/model/smooth_field.hpp"

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

// ---- Time limit of a computation ----

/// Aborts a computation; its partial results are discarded.
struct TimeExpired : std::runtime_error {
  TimeExpired() : std::runtime_error("the time limit ended the search") {}
};

class Deadline {
 public:
  using Clock = std::chrono::steady_clock;

  Deadline() = default;  ///< never passes
  explicit Deadline(Clock::time_point at) : at_(at) {}

  bool has_passed() const { return at_ != Clock::time_point::max() && Clock::now() >= at_; }
  /// @throws TimeExpired
  void check() const {
    if (has_passed()) throw TimeExpired();
  }

 private:
  Clock::time_point at_ = Clock::time_point::max();
};

/// Deadlines of the parts of a run, which share one time limit.
struct TimeLimit {
  double seconds = 0;  ///< 0: none
  Deadline::Clock::time_point begin = Deadline::Clock::now();

  /// @param share of the limit, counted from `begin`
  Deadline at(double share) const {
    if (!(seconds > 0)) return {};
    return Deadline(
        begin + std::chrono::duration_cast<Deadline::Clock::duration>(std::chrono::duration<double>(share * seconds)));
  }
};

// ---- Expectation of a model for every condition, and its derivatives ----

/// Rows of observables x superpixels, one row per condition: an expectation of a model, or the change by a parameter.
using Rows = std::vector<std::vector<double>>;
/// Column of the linearised problem: the change by one typical step of a parameter.
using Column = Rows;

/// Boards that are not flat, see BoardFlatness.
struct Boards {
  double sd = 0;    ///< m, of the heights at the superpixels
  Rows rows;        ///< change of the observables by the heights
  double cost = 0;  ///< contribution to the deviance: the prior of the heights, and the determinant of their posterior
};

/// Nuisances of single conditions, estimated together with a model.
struct ConditionNuisances {
  std::vector<double> jitter_scale = {};  ///< factor on the usual jitter of each board's position; empty: 1
  std::shared_ptr<const SmoothField> smooth_field = nullptr;  ///< part of the noise of the superpixels; null: none
  /// Run of each condition: neighbours over which the smooth field hardly changes. Empty: each condition is a run.
  std::vector<Eigen::Index> runs = {};
  std::shared_ptr<const Boards> boards = nullptr;  ///< null: flat
};

/// Data to be explained. Changed only by its maker: before any model is fitted to it, or by FoldProblem::fix_contrast()
/// between the predictions with the given and with the fitted model.
struct Problem {
  const Design& design;
  const std::vector<Observations>& data;  ///< one per condition
  std::vector<std::string> targets;       ///< those of unknown reflectivity
  std::vector<int> target;                ///< index among `targets` for each condition; -1: known reflectivity
  Nuisances nuisances;
  const Deadline* deadline = nullptr;  ///< beyond it expected() throws TimeExpired; null: none
  /// Reasons why conditions of the campaign were excluded, for the error of a fit to too few conditions.
  std::vector<std::string> left_out = {};

  /// True if the data have amplitudes. Otherwise only effects reveal reflectivities, relative to that of the first
  /// target, which is unknown_reflectivity.
  bool light_seen() const;
  /// Unknowns of a fit with this number of effect columns.
  Unknowns unknowns(std::size_t effects) const {
    return {static_cast<Eigen::Index>(effects),
            target,
            static_cast<Eigen::Index>(targets.size()),
            nuisances.of_condition,
            nuisances.sd,
            nuisances.jitter};
  }
  /// True if a row belongs to an observable.
  bool is_of(std::size_t observable, std::size_t row) const {
    const std::size_t n = design.superpixels();
    return row >= observable * n && row < (observable + 1) * n;
  }
  /// Rows of an observable whose values are known in a condition.
  std::vector<std::size_t> known_rows(std::size_t condition, std::size_t observable) const {
    const std::size_t n = design.superpixels();
    std::vector<std::size_t> rows;
    for (std::size_t row = observable * n; row < (observable + 1) * n; ++row) {
      if (!std::isinf(data[condition].variance[row])) rows.push_back(row);
    }
    return rows;
  }
  /// Factor on a difference of an observable in reports: converts half paths to depths.
  double shown_scale(std::size_t observable, std::size_t condition, std::size_t row) const {
    return observable == distance && design.shows_board(condition) ? 1 / design.shift(condition)[row] : 1;
  }
  /// Change of a row (of observables x superpixels) per metre of camera offset, see Design::offset(); and per metre of
  /// a distance error that is equal in all pixels.
  double offset_response(std::size_t condition, std::size_t row) const { return design.offset(condition)[row]; }
  double uniform_response(std::size_t condition, std::size_t row) const {
    return design.shows_board(condition) && is_of(distance, row) ? 1 : 0;
  }
  /// Change for a contrast that is lower by a factor e: more intensity for the same amplitude, equally for light from
  /// the board and light from inside the camera.
  double contrast_response(std::size_t condition, std::size_t row) const {
    return design.shows_board(condition) && is_of(intensity, row) ? 1 : 0;
  }
};

/// True if any condition or superpixel has the observable.
bool are_seen(std::size_t observable, const Design& design, const std::vector<Observations>& data);

/// Problem of a design and its data; determines the targets of unknown reflectivity.
Problem make_problem(const Design& design, const std::vector<Observations>& data, const Deadline* deadline = nullptr);
/// The problem with other data of the same conditions. @param data must outlive the result
Problem with_data(const Problem& problem, const std::vector<Observations>& data);
/// The same problem with another deadline. @param deadline must live on
Problem with_deadline(Problem problem, const Deadline& deadline);

/// Bias of the coarse grid (fixed during a fit), and response to light (updated during a fit if no amplitudes are
/// known, restored afterwards). Shared by states; the rows themselves never change.
struct Precomputed {
  std::shared_ptr<const Rows> grid_bias = nullptr;  ///< fine grid minus coarse grid; null: 0
  /// Change of the observables by a factor e of light; null: that of the ideal camera. Light that does not come from
  /// the board reduces the change.
  std::shared_ptr<const Rows> reflectivity_jacobian = nullptr;
};

/// A model: a point in the space of models, with its nuisances.
struct State {
  std::vector<Term> terms;
  std::vector<double> log_reflectivity;  ///< per target, relative to that of the design
  RandomEffectSd random_sd;
  ConditionNuisances nuisances = {};
  Precomputed precomputed = {};

  /// Change per metre of board distance, times the jitter scale of the condition.
  double jitter_response(const Problem& problem, std::size_t condition, std::size_t row) const {
    return problem.design.shift(condition)[row] *
           (nuisances.jitter_scale.empty() ? 1 : nuisances.jitter_scale[condition]);
  }
  double light_response(const Problem& problem, std::size_t condition, std::size_t row) const {
    if (!problem.design.shows_board(condition)) return 0;
    if (precomputed.reflectivity_jacobian) return (*precomputed.reflectivity_jacobian)[condition][row];
    return problem.is_of(amplitude, row) || problem.is_of(intensity, row) ? 1 : 0;
  }
  /// Change per unit of a shared unknown. @param direction uniform, light or contrast
  double shared_response(const Problem& problem, Eigen::Index direction, std::size_t condition, std::size_t row) const {
    if (direction == uniform_direction) return problem.uniform_response(condition, row);
    return direction == contrast_direction ? problem.contrast_response(condition, row)
                                           : light_response(problem, condition, row);
  }
};

/// Units of sign flips, one per condition: each condition its own, or the runs of a smooth field.
std::vector<Eigen::Index> runs_of(const Problem& problem, const State& state);
/// Number of conditions per run: a smooth field that lasts over a run counts once.
double run_length(const Problem& problem, const State& state);

/// The state with the nuisances of conditions and the precomputed parts of another one.
State comparable_with(const State& other, State state);
/// The state with flat boards, for gaps: these are the camera's, and include the shape of the boards.
State with_flat_boards(State state);

/// Index of the first parameter of a term, or of its refinement, among the parameters of all terms.
std::size_t first_parameter(const State& state, std::size_t term, std::optional<std::size_t> refinement = {});
/// The state without a term, or without a refinement of it.
State removed(State state, const ModelTerm& addition);

/// Index of the term of an effect in a state, by its name, in any of its forms; the number of terms: there is none.
std::size_t term_of(const State& state, const Candidate& candidate);
inline bool is_in(const State& state, const Candidate& candidate) {
  return term_of(state, candidate) < state.terms.size();
}

/// ln of the factor on a condition's reflectivity; 0 if it is known. @param light one per target
double log_reflectivity_of(const Problem& problem, std::span<const double> light, std::size_t condition);
inline double log_reflectivity_of(const Problem& problem, const State& state, std::size_t condition) {
  return log_reflectivity_of(problem, state.log_reflectivity, condition);
}
/// Mean ln amplitude of a target's superpixels minus its expectation; 0 if none is known.
/// @param expectation empty: zero
double mean_log_amplitude(const Problem& problem, std::size_t target, const Rows& expectation);
/// ln of the targets' factors from their mean ln amplitude, so that effects that depend on the light start near its
/// true level.
std::vector<double> first_log_reflectivity(const Problem& problem);
/// ln of the factors of a problem's targets, as in a state of another problem with targets of the same names.
/// @param light of targets that the other problem lacks
std::vector<double> log_reflectivity_from(const Problem& other, const State& state, const Problem& problem,
                                          std::vector<double> light);
/// State in which a search with some terms starts.
State first_state(const Problem& problem, const std::vector<Term>& terms);

/// Updates the bias of the coarse grid, and the change of the observables by light.
/// @param exactly uses every pixel, which takes ten times as long
void update_precomputed(const Problem& problem, State& state, bool exactly = false);
/// Updates only the change of the observables by light.
void update_reflectivity_jacobian(const Problem& problem, State& state);

/// Expectation of the model for every condition. @throws simulation::EffectError, also for values that are not finite
/// @throws TimeExpired
Rows expected(const Problem& problem, const State& state);

/// Difference of two columns.
Column difference(Column rows, const Column& other);

/// Derivative with respect to a free parameter of a term, per typical step. @param rows expected(problem, state)
Column derivative(const Problem& problem, const State& state, const Rows& rows, std::size_t term,
                  std::size_t parameter);

/// Derivatives with respect to all free parameters of all terms, in their order.
/// @param known derivatives with respect to the first ones, which are reused
std::vector<Column> jacobian(const Problem& problem, const State& state, const Rows& rows,
                             std::vector<Column> known = {});

/// Root mean square of a change in one condition over the practical threshold, for the observable in which this ratio
/// is largest.
double normalised_rms(const Problem& problem, std::size_t condition, const std::vector<double>& change);
/// Maximum of normalised_rms() over the conditions.
double max_normalised_rms(const Problem& problem, const Column& change);

/// Columns of a condition, then its random directions and its residual, divided by the standard deviations and
/// whitened; 0 for unknown values. @param rows expectation of the model
Eigen::MatrixXd weighted_columns(const Problem& problem, const State& state, const std::vector<double>& rows,
                                 std::span<const Column> columns, std::size_t condition);
/// Gram matrices of columns, tail included. @param rows expectation of the model
std::vector<Gram> grams_of(const Problem& problem, const State& state, const Rows& rows,
                           std::span<const Column> columns);

/// Best linear fit of columns to the residuals of a model, at the state's standard deviations.
/// @param unknowns with the columns as effects
Solution solve_linear(const Problem& problem, const State& state, const Rows& rows, std::span<const Column> columns,
                      const Unknowns& unknowns);

/// Expectation of the model plus the best fit of the shared nuisances, at the state's standard deviations.
Rows with_nuisances(const Problem& problem, const State& state, Rows rows);

}  // namespace tofgraph::diagnosis
