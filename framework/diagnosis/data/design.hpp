// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The conditions of a campaign on a coarse grid: what any model expects of them, as differences to the ideal.
#pragma once

#include "diagnosis/data/observables.hpp"
#include "io/campaign.hpp"
#include "simulation/board.hpp"
#include "simulation/forward_model.hpp"

#include <algorithm>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Superpixels in a row and in a column: 17 x 17 px of 204 x 204. One where the data are means over a board.
inline constexpr std::size_t grid = 12, single = 1;
/// Points in a row and in a column of a superpixel that stand for all its pixels: at the middles of equal parts, so
/// that what they miss of a curved pattern is a 25th of what its centre alone misses.
inline constexpr std::size_t fine = 5;

/// @throws std::invalid_argument when conditions are too few for a search @param left_out which are not among them
void require_enough(std::size_t conditions, const std::vector<std::string>& left_out);

/// A capped camera sees no board, and its signal is near zero, so that it has neither a distance nor a logarithm. It is
/// told as what it would add to a board that no effect touches, at half of the unambiguous range and with
/// unknown_reflectivity: the same is added to what is measured and to what a model expects.
io::Condition stand_in(const io::Condition& capped, const tofgraph_camera& camera);

/// True if the light of a condition is not an unknown: its reflectivity is stated, or no board is seen.
bool is_light_known(const io::Condition& condition);

/// The board of a condition; where its reflectivity is not known it is unknown_reflectivity.
simulation::BoardPose pose_of(const io::Condition& condition);

/// Immutable; may be used from several threads.
class Design {
 public:
  /// @param conditions each with a board that fills the view, or a capped lens, and an integration time
  /// @param superpixels in a row and in a column @param jitter m, see jitter()
  /// @throws std::invalid_argument as Demodulation
  Design(io::CameraPtr camera, bool physical, std::vector<io::Condition> conditions, std::size_t superpixels = grid,
         double jitter = std::numeric_limits<double>::infinity());

  /// Design of some of its conditions, independent of the others. @param chosen conditions, ascending
  Design part(std::span<const std::size_t> chosen) const;

  const tofgraph_camera& camera() const { return camera_->view(); }
  const io::CameraPtr& camera_pointer() const { return camera_; }
  bool physical() const { return physical_; }
  std::size_t size() const { return conditions_.size(); }
  const std::vector<io::Condition>& conditions() const { return conditions_; }
  /// Scale of the position errors of the boards as the campaign states it, m; infinity: it does not.
  double jitter() const { return jitter_; }
  const simulation::Acquisition& acquisition(std::size_t condition) const { return shots_[condition]; }
  const simulation::Pixels& pixels() const { return pixels_; }
  std::size_t superpixels() const { return pixels_.size(); }
  std::size_t rows() const { return observables * superpixels(); }

  /// Not where the lens is capped: such a condition has no distance, no reflectivity and no place.
  bool shows_board(std::size_t condition) const { return !conditions_[condition].is_capped(); }
  /// Conditions that do.
  std::size_t boards() const {
    return size() - static_cast<std::size_t>(std::ranges::count_if(conditions_, &io::Condition::is_capped));
  }

  /// Expectation of the model, observables x superpixels. @param light logarithm of the factor on the reflectivity
  /// @throws simulation::EffectError
  std::vector<double> predict(const simulation::ForwardModel& model, std::size_t condition, double light = 0) const;

  /// The same from all over the superpixels, as measurements are reduced: what their centres miss of a curved pattern
  /// is the difference to predict(). Of a board's mean its middle stands for it: there is no difference.
  /// @param every_pixel where pixels are not like their neighbours
  std::vector<double> predict_finely(const simulation::ForwardModel& model, std::size_t condition, double light,
                                     bool every_pixel) const;

  /// Signal that every pixel is to show.
  std::vector<Signal> photograph(const simulation::ForwardModel& model, std::size_t condition, double light) const;

  /// Change of the observables for each metre that the board is farther away.
  const std::vector<double>& shift(std::size_t condition) const { return shifts_[condition]; }
  /// Change of the observables for each metre that the camera shows too much. Where a board is tilted that is the same
  /// in all pixels, which tells it from a board that is misplaced. Where it is not, both are one and the same on
  /// purpose: two directions that nearly are would together be taken for patterns of the pixels.
  const std::vector<double>& offset(std::size_t condition) const {
    return offsets_[condition].empty() ? shifts_[condition] : offsets_[condition];
  }
  /// True if a board is tilted, so that the data can distinguish a camera's offset from a misplaced board.
  bool tells_offset() const {
    return std::ranges::any_of(offsets_, [](const auto& rows) { return !rows.empty(); });
  }
  /// True if all conditions state when they were measured.
  bool tells_order() const {
    return std::ranges::all_of(conditions_, [](const io::Condition& c) { return c.order.has_value(); });
  }
  /// The ideal camera's signal, one a superpixel.
  const std::vector<Signal>& ideal(std::size_t condition) const { return ideal_[condition]; }
  /// cos of the angle of incidence on the board as seen from the lens, one a superpixel.
  double incidence(std::size_t condition, std::size_t superpixel) const;

 private:
  std::vector<Signal> signals(const simulation::ForwardModel& model, const simulation::Pixels& pixels,
                              std::size_t condition, const simulation::BoardPose& pose) const;
  /// Signals of the ideal camera; of its stand-in where the lens is capped.
  std::vector<Signal> ideal_signals(const simulation::Pixels& pixels, std::size_t condition) const;
  std::vector<Signal> demodulated(std::span<const double> taps, std::size_t pixels) const;
  std::vector<double> rows_of(const std::vector<Signal>& seen, const std::vector<Signal>& ideal,
                              std::size_t condition) const;
  std::vector<double> shift_of(const simulation::ForwardModel& ideal, std::size_t condition,
                               const simulation::BoardPose& pose) const;

  io::CameraPtr camera_;
  Demodulation demodulation_;
  bool physical_;
  std::size_t grid_;
  std::vector<io::Condition> conditions_;
  double jitter_;
  std::vector<simulation::Acquisition> shots_;
  simulation::Pixels pixels_, fine_, whole_;
  std::vector<std::vector<Signal>> ideal_, fine_ideal_;  ///< the latter not for single
  std::vector<std::vector<double>> shifts_, offsets_;    ///< the latter only where it differs
};

}  // namespace tofgraph::diagnosis
