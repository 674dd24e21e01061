// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Fits the effects of a model to the observations, with the targets' reflectivities and the variances.
#pragma once

#include "diagnosis/candidate.hpp"
#include "diagnosis/deadline.hpp"
#include "diagnosis/design.hpp"
#include "diagnosis/mixed_model.hpp"
#include "diagnosis/nuisances.hpp"
#include "diagnosis/residue.hpp"

#include <functional>

namespace tofgraph::diagnosis {

/// Boards that are not flat, see BoardShapes.
struct Boards {
  double sd = 0;                          ///< m, of their heights where superpixels see them
  std::vector<std::vector<double>> rows;  ///< what that changes, one a condition
  double cost = 0;  ///< of the deviance, for being any shape: that of their prior, and of what it leaves of them
};

/// What conditions are allowed to have of their own, beside a model: found with it.
struct Allowances {
  std::vector<double> looseness = {};  ///< how many times the usual jitter each board's place may be off; empty: 1
  std::shared_ptr<const Residue> residue = nullptr;  ///< part of the noise of the superpixels, or nothing
  /// Of each condition, which run of conditions it belongs to over which the residue stays nearly the same. Empty: each
  /// has its own.
  std::vector<Eigen::Index> runs = {};
  std::shared_ptr<const Boards> boards = nullptr;  ///< or nothing: flat
};

/// What is to be explained.
struct Problem {
  const Design& design;
  const std::vector<Observations>& data;  ///< one a condition
  std::vector<std::string> targets;       ///< whose reflectivity is not known
  std::vector<int> target;                ///< of each condition, among those; -1: known
  Nuisances nuisances;
  /// What is added to the coarse grid's expectation, one a condition, or nothing: see correct().
  std::vector<std::vector<double>> correction = {};
  /// Change of the observables for a factor e of light, one a condition, or nothing: that of the ideal camera. Where
  /// light comes from elsewhere than the board, more light from the board changes them less. See brighten().
  std::vector<std::vector<double>> brightening = {};
  Allowances allowed = {};
  Deadline deadline = {};  ///< after it expected() throws TimeExpired

  /// Of each condition, which ones chance changes the signs of together: each its own, or the runs of a residue.
  std::vector<Eigen::Index> runs() const;
  /// Conditions of a run: a residue that stays over it counts once, not as often.
  double run_length() const;

  /// Whether amplitudes are among the data. Else reflectivities show through effects alone, relative to that of the
  /// first target, which is unknown_reflectivity.
  bool light_seen() const;
  /// Of a fit with so many effects' columns.
  Unknowns unknowns(std::size_t effects) const {
    return {static_cast<Eigen::Index>(effects), target, static_cast<Eigen::Index>(targets.size()),
            nuisances.of_condition, nuisances.sd};
  }
  /// Change for a metre that the board is farther away, as often as its place is less certain than others'. Of a row
  /// of observables x superpixels, as are the next.
  double jitter_response(std::size_t condition, std::size_t row) const {
    return design.shift(condition)[row] * (allowed.looseness.empty() ? 1 : allowed.looseness[condition]);
  }
  /// Change for a metre that the camera shows more.
  double offset_response(std::size_t condition, std::size_t row) const { return design.offset(condition)[row]; }
  double uniform_response(std::size_t condition, std::size_t row) const {
    return design.shows_board(condition) && is_of(distance, row) ? 1 : 0;
  }
  double light_response(std::size_t condition, std::size_t row) const {
    if (!design.shows_board(condition)) return 0;
    if (!brightening.empty()) return brightening[condition][row];
    return is_of(amplitude, row) || is_of(intensity, row) ? 1 : 0;
  }
  /// Change for a contrast that is lower by a factor e: as much amplitude comes with more intensity, of the light from
  /// the board and of that from inside the camera alike.
  double contrast_response(std::size_t condition, std::size_t row) const {
    return design.shows_board(condition) && is_of(intensity, row) ? 1 : 0;
  }
  /// Change for one unit of an unknown that conditions share. @param direction uniform, light or contrast
  double shared_response(Eigen::Index direction, std::size_t condition, std::size_t row) const {
    if (direction == uniform_direction) return uniform_response(condition, row);
    return direction == contrast_direction ? contrast_response(condition, row) : light_response(condition, row);
  }
  /// Whether a row is of an observable.
  bool is_of(std::size_t observable, std::size_t row) const {
    const std::size_t n = design.superpixels();
    return row >= observable * n && row < (observable + 1) * n;
  }
};

/// Whether an observable is known anywhere in the data.
bool are_seen(std::size_t observable, const Design& design, const std::vector<Observations>& data);

/// Finds the targets whose reflectivity is not known.
Problem make_problem(const Design& design, const std::vector<Observations>& data);
/// The same problem with other data of the same conditions. @param data must live on
Problem with_data(const Problem& problem, const std::vector<Observations>& data);

/// A point in the space of models.
struct State {
  std::vector<Term> terms;
  std::vector<double> light;  ///< ln of each target's factor on the reflectivity of the design
  Variances variances;
};

/// The place of a term's first parameter among those of all terms.
std::size_t first_parameter(const State& state, std::size_t term);

/// ln of the factor on a condition's reflectivity, 0 where that is known.
double light_of(const Problem& problem, const State& state, std::size_t condition);

/// Sets the correction to what a state differs by all over its superpixels from their centres, and how it answers to
/// light.
/// @param exactly by every pixel, which takes ten times as long
void correct(Problem& problem, const State& state, bool exactly = false);
/// The latter alone.
void brighten(Problem& problem, const State& state);

struct Fit {
  State state;
  double deviance = std::numeric_limits<double>::infinity();
  double dimension = 0;        ///< parameters of effects that the data determine
  Eigen::MatrixXd covariance;  ///< of the free parameters of all terms in their order, in units of their typical values
  double bic(std::size_t conditions) const { return deviance + dimension * std::log(static_cast<double>(conditions)); }
};

/// ln of the targets' factors from their mean ln amplitude, so that effects of the amount of light begin at the right
/// amount.
std::vector<double> first_light(const Problem& problem);

/// A column of the linearised problem: the change for one typical step of a parameter. rows, one a condition.
using Column = std::vector<std::vector<double>>;

/// Rows of every condition as the model expects them. @throws simulation::EffectError, also for what is not finite
/// @throws TimeExpired
std::vector<std::vector<double>> expected(const Problem& problem, const State& state);

/// What one has more than the other.
Column difference(Column rows, const Column& other);

/// Derivative by a free parameter of a term, for one typical step.
/// @param rows expected(problem, state)
Column derivative(const Problem& problem, const State& state, const std::vector<std::vector<double>>& rows,
                  std::size_t term, std::size_t parameter);

/// The largest that a change makes in one condition, root mean square of an observable over what matters of it:
/// least_change.
double importance(const Problem& problem, const Column& change);

/// The derivatives by all free parameters of all terms, in their order.
std::vector<Column> own_columns(const Problem& problem, const State& state,
                                const std::vector<std::vector<double>>& rows);

/// Columns of a condition, then its random directions and its residual, over their standard deviations and with unit
/// covariance; 0 where nothing is known. @param rows of the model
Eigen::MatrixXd weighted_columns(const Problem& problem, const std::vector<double>& rows,
                                 std::span<const Column> columns, std::size_t condition);
/// Gram matrices of columns, tail included. @param rows of the model
std::vector<Gram> grams_of(const Problem& problem, const std::vector<std::vector<double>>& rows,
                           std::span<const Column> columns);

/// Minimises the deviance over all free parameters. @param weight of each condition: 0 leaves it out
/// @throws simulation::EffectError
/// @throws std::invalid_argument when too few conditions are left
Fit fit(const Problem& problem, State start, std::span<const double> weight);

/// As fit(), as exactly as a comparison of models needs.
Fit fit_roughly(const Problem& problem, State start, std::span<const double> weight);

/// What suits the data best beside rows of a model, linear about them and with variances as they are.
/// @param unknowns whose effects are the columns
Solution least_squares(const Problem& problem, const std::vector<std::vector<double>>& rows,
                       std::span<const Column> columns, const Unknowns& unknowns, const Variances& variances);

/// What conditions share, as it suits rows of the model best: added to these. @param variances as they are
std::vector<std::vector<double>> with_nuisances(const Problem& problem, std::vector<std::vector<double>> rows,
                                                const Variances& variances);

/// Where a size below zero means the same as its opposite with an angle half a turn on: that.
State with_positive_sizes(const Problem& problem, State state);

/// As fit(), less exactly, for a comparison of candidates: the derivatives of all terms but the last are taken from
/// a fit of those alone. @param known own_columns() there
Fit fit_last(const Problem& problem, State start, std::span<const double> weight, std::span<const Column> known);

/// Of a state as it is, its variances included; only the reflectivities are those with the least.
double deviance_of(const Problem& problem, const State& state);

/// As fit() with the parameters of effects held, for reflectivities and variances alone.
Fit fit_nuisances(const Problem& problem, State start, std::span<const double> weight);

}  // namespace tofgraph::diagnosis
