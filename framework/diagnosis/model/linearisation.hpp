// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Expectation of a model for every condition, and its derivatives. A Problem never changes; everything that belongs to
/// one model, also what it is linearised about, is in its State.
#pragma once

#include "diagnosis/data/design.hpp"
#include "diagnosis/model/candidate.hpp"
#include "diagnosis/model/mixed_model.hpp"
#include "diagnosis/model/nuisances.hpp"
#include "diagnosis/model/smooth_field.hpp"

#include <chrono>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

// ---- The time at which a computation is abandoned ----

/// Abandons a computation, which leaves nothing behind.
struct TimeExpired : std::runtime_error {
  TimeExpired() : std::runtime_error("the time limit ended the search") {}
};

class Deadline {
 public:
  using Clock = std::chrono::steady_clock;

  Deadline() = default;  ///< never
  explicit Deadline(Clock::time_point at) : at_(at) {}

  bool has_passed() const { return at_ != Clock::time_point::max() && Clock::now() >= at_; }
  /// @throws TimeExpired
  void check() const {
    if (has_passed()) throw TimeExpired();
  }

 private:
  Clock::time_point at_ = Clock::time_point::max();
};

/// Deadlines of the parts of a run that together must not take longer than a limit.
struct TimeLimit {
  double seconds = 0;  ///< 0: none
  Deadline::Clock::time_point begin = Deadline::Clock::now();

  /// @param share of the limit, counted from the begin
  Deadline at(double share) const {
    if (!(seconds > 0)) return {};
    return Deadline(
        begin + std::chrono::duration_cast<Deadline::Clock::duration>(std::chrono::duration<double>(share * seconds)));
  }
};

// ---- Expectation of a model for every condition, and its derivatives ----

/// Values of observables x superpixels, one row a condition: what a model expects, or what a parameter changes.
using Rows = std::vector<std::vector<double>>;
/// A column of the linearised problem: the change for one typical step of a parameter.
using Column = Rows;

/// Boards that are not flat, see BoardFlatness.
struct Boards {
  double sd = 0;    ///< m, of their heights where superpixels see them
  Rows rows;        ///< what that changes
  double cost = 0;  ///< of the deviance, for being any shape: that of their prior, and of what it leaves of them
};

/// Nuisances of single conditions beside a model: found with it.
struct ConditionNuisances {
  std::vector<double> jitter_scale = {};  ///< factor on the usual jitter of each board's place; empty: 1
  std::shared_ptr<const SmoothField> smooth_field = nullptr;  ///< part of the noise of the superpixels, or nothing
  /// Run of each condition: neighbours over which the smooth field stays nearly the same. Empty: each has its own.
  std::vector<Eigen::Index> runs = {};
  std::shared_ptr<const Boards> boards = nullptr;  ///< or nothing: flat
};

/// Data that are to be explained. Immutable.
struct Problem {
  const Design& design;
  const std::vector<Observations>& data;  ///< one a condition
  std::vector<std::string> targets;       ///< whose reflectivity is not known
  std::vector<int> target;                ///< of each condition, among those; -1: known
  Nuisances nuisances;
  const Deadline* deadline = nullptr;  ///< after it expected() throws TimeExpired; nullptr: none
  /// Reasons for which conditions of the campaign are not among these, in words: for the error of a fit to too few.
  std::vector<std::string> left_out = {};

  /// True if amplitudes are among the data. Else reflectivities show through effects alone, relative to that of the
  /// first target, which is unknown_reflectivity.
  bool light_seen() const;
  /// Unknowns of a fit with so many effects' columns.
  Unknowns unknowns(std::size_t effects) const {
    return {static_cast<Eigen::Index>(effects),
            target,
            static_cast<Eigen::Index>(targets.size()),
            nuisances.of_condition,
            nuisances.sd,
            nuisances.jitter};
  }
  /// True if a row is of an observable.
  bool is_of(std::size_t observable, std::size_t row) const {
    const std::size_t n = design.superpixels();
    return row >= observable * n && row < (observable + 1) * n;
  }
  /// Factor on a difference of an observable as it is reported: half paths become depths.
  double shown_scale(std::size_t observable, std::size_t condition, std::size_t row) const {
    return observable == distance && design.shows_board(condition) ? 1 / design.shift(condition)[row] : 1;
  }
  /// Change for a metre that the camera shows more: along the board's normal, and the same in all pixels. Of a row of
  /// observables x superpixels.
  double offset_response(std::size_t condition, std::size_t row) const { return design.offset(condition)[row]; }
  double uniform_response(std::size_t condition, std::size_t row) const {
    return design.shows_board(condition) && is_of(distance, row) ? 1 : 0;
  }
  /// Change for a contrast that is lower by a factor e: as much amplitude comes with more intensity, of the light from
  /// the board and of that from inside the camera alike.
  double contrast_response(std::size_t condition, std::size_t row) const {
    return design.shows_board(condition) && is_of(intensity, row) ? 1 : 0;
  }
};

/// True if an observable is known anywhere in the data.
bool are_seen(std::size_t observable, const Design& design, const std::vector<Observations>& data);

/// Finds the targets whose reflectivity is not known.
Problem make_problem(const Design& design, const std::vector<Observations>& data, const Deadline* deadline = nullptr);
/// The same problem with other data of the same conditions. @param data must live on
Problem with_data(const Problem& problem, const std::vector<Observations>& data);

/// Point about which a model is linear, as far as that costs more than its jacobian. Shared by states, never changed.
struct Linearisation {
  std::shared_ptr<const Rows> grid_bias = nullptr;  ///< fine grid minus coarse grid; nothing: 0
  /// Change of the observables for a factor e of light; nothing: that of the ideal camera. Where light comes from
  /// elsewhere than the board, more light from the board changes them less.
  std::shared_ptr<const Rows> reflectivity_jacobian = nullptr;
};

/// A model: a point in the space of models, with the nuisances beside it and what it is linearised about.
struct State {
  std::vector<Term> terms;
  std::vector<double> log_reflectivity;  ///< of each target, relative to that of the design
  RandomEffectSd random_sd;
  ConditionNuisances nuisances = {};
  Linearisation linearisation = {};

  /// Change for a metre that the board is farther away, as often as its place is less certain than others'.
  double jitter_response(const Problem& problem, std::size_t condition, std::size_t row) const {
    return problem.design.shift(condition)[row] *
           (nuisances.jitter_scale.empty() ? 1 : nuisances.jitter_scale[condition]);
  }
  double light_response(const Problem& problem, std::size_t condition, std::size_t row) const {
    if (!problem.design.shows_board(condition)) return 0;
    if (linearisation.reflectivity_jacobian) return (*linearisation.reflectivity_jacobian)[condition][row];
    return problem.is_of(amplitude, row) || problem.is_of(intensity, row) ? 1 : 0;
  }
  /// Change for one unit of an unknown that conditions share. @param direction uniform, light or contrast
  double shared_response(const Problem& problem, Eigen::Index direction, std::size_t condition, std::size_t row) const {
    if (direction == uniform_direction) return problem.uniform_response(condition, row);
    return direction == contrast_direction ? problem.contrast_response(condition, row)
                                           : light_response(problem, condition, row);
  }
};

/// Units of sign flips, one a condition: each its own, or the runs of a smooth field.
std::vector<Eigen::Index> runs_of(const Problem& problem, const State& state);
/// Conditions of a run: a smooth field that stays over it counts once, not as often.
double run_length(const Problem& problem, const State& state);

/// A state with the nuisances of conditions, and what it is linearised about, of another one.
State beside(const State& other, State state);
/// A state with flat boards: the gap is the camera's, the shape of a board stays in it.
State with_flat_boards(State state);

/// The place of a term's first parameter among those of all terms.
std::size_t first_parameter(const State& state, std::size_t term);

/// ln of the factor on a condition's reflectivity, 0 where that is known.
double log_reflectivity_of(const Problem& problem, const State& state, std::size_t condition);
/// ln of the targets' factors from their mean ln amplitude, so that effects of the amount of light begin at the right
/// amount.
std::vector<double> first_log_reflectivity(const Problem& problem);
/// The state in which a search begins with some terms.
State first_state(const Problem& problem, const std::vector<Term>& terms);

/// Linearises a state anew: what it differs by all over its superpixels from their centres, and how it answers to
/// light.
/// @param exactly by every pixel, which takes ten times as long
void update_grid_bias(const Problem& problem, State& state, bool exactly = false);
/// The latter alone.
void update_reflectivity_jacobian(const Problem& problem, State& state);

/// Rows of every condition as the model expects them. @throws simulation::EffectError, also for what is not finite
/// @throws TimeExpired
Rows expected(const Problem& problem, const State& state);

/// Difference of two columns.
Column difference(Column rows, const Column& other);

/// Derivative by a free parameter of a term, for one typical step. @param rows expected(problem, state)
Column derivative(const Problem& problem, const State& state, const Rows& rows, std::size_t term,
                  std::size_t parameter);

/// The derivatives by all free parameters of all terms, in their order.
/// @param known derivatives by the first ones, which are not taken again
std::vector<Column> jacobian(const Problem& problem, const State& state, const Rows& rows,
                             std::vector<Column> known = {});

/// Root mean square of a change in one condition, over what matters of it (practical_threshold), of the observable
/// where that is largest.
double normalised_rms(const Problem& problem, std::size_t condition, const std::vector<double>& change);
/// The same in the condition where it is largest.
double max_normalised_rms(const Problem& problem, const Column& change);

/// Columns of a condition, then its random directions and its residual, over their standard deviations and with unit
/// covariance; 0 where nothing is known. @param rows of the model
Eigen::MatrixXd weighted_columns(const Problem& problem, const State& state, const std::vector<double>& rows,
                                 std::span<const Column> columns, std::size_t condition);
/// Gram matrices of columns, tail included. @param rows of the model
std::vector<Gram> grams_of(const Problem& problem, const State& state, const Rows& rows,
                           std::span<const Column> columns);

/// Best linear fit beside rows of a model, with standard deviations as they are.
/// @param unknowns whose effects are the columns
Solution solve_linear(const Problem& problem, const State& state, const Rows& rows, std::span<const Column> columns,
                      const Unknowns& unknowns);

/// Rows of the model with the best fit of the unknowns that conditions share, with standard deviations as they are.
Rows with_nuisances(const Problem& problem, const State& state, Rows rows);

}  // namespace tofgraph::diagnosis
