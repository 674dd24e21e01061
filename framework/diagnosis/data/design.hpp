// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Conditions of a campaign on a coarse grid, and the model's expectations as differences from an ideal camera.
#pragma once

#include "diagnosis/data/observables.hpp"
#include "io/campaign.hpp"
#include "io/condition.hpp"
#include "simulation/board.hpp"
#include "simulation/forward_model.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// Superpixels per row and per column; `single`: the data are means over a board.
inline constexpr std::size_t grid = 12, single = 1;
/// Points per row and per column that represent a superpixel, at the centres of equal parts: their error for a curved
/// pattern is a 25th of that of the superpixel's centre alone.
inline constexpr std::size_t fine = 5;

/// @throws std::invalid_argument if a search has too few conditions @param left_out excluded conditions, with reasons
void require_enough(std::size_t conditions, const std::vector<std::string>& left_out);

/// Board of a capped condition, whose signal is near zero, so it has neither a distance nor a logarithm. The signal of
/// this board, without effects, at half the unambiguous range and with unknown_reflectivity, is added to the
/// measurement and to the expectation of a model.
io::Condition stand_in(const io::Condition& capped, const tofgraph_camera& camera);

/// True if the light of a condition is not an unknown: its reflectivity is stated, or no board is seen.
bool is_light_known(const io::Condition& condition);

/// Pose of a condition's board; an unknown reflectivity becomes unknown_reflectivity.
simulation::BoardPose pose_of(const io::Condition& condition);

/// Some elements of a list. @param chosen their indices
template <class T> std::vector<T> picked(const std::vector<T>& all, std::span<const std::size_t> chosen) {
  std::vector<T> some;
  for (const std::size_t i : chosen) some.push_back(all[i]);
  return some;
}

template <class Range, class T> bool contains(const Range& range, const T& value) {
  return std::ranges::find(range, value) != std::ranges::end(range);
}

/// Conditions with their ideal signals. Immutable; may be used from several threads.
class Design {
 public:
  /// @param conditions each with a board that fills the view or with a capped lens, and with an integration time
  /// @param superpixels per row and per column @param jitter m, see jitter()
  /// @throws std::invalid_argument as Demodulation
  Design(io::CameraPtr camera, bool physical, std::vector<io::Condition> conditions, std::size_t superpixels = grid,
         double jitter = std::numeric_limits<double>::infinity());

  /// Design of a subset of the conditions, independent of this one. @param chosen indices of conditions, ascending
  Design part(std::span<const std::size_t> chosen) const { return {*this, chosen}; }

  const tofgraph_camera& camera() const { return camera_->view(); }
  const io::CameraPtr& camera_pointer() const { return camera_; }
  bool physical() const { return physical_; }
  std::size_t size() const { return conditions_.size(); }
  const std::vector<io::Condition>& conditions() const { return conditions_; }
  /// Scale of the position errors of the boards as the campaign states it, m; infinity: unstated.
  double jitter() const { return jitter_; }
  const simulation::Acquisition& acquisition(std::size_t condition) const { return shots_[condition]; }
  const simulation::Pixels& pixels() const { return pixels_; }
  std::size_t superpixels() const { return pixels_.size(); }
  /// Superpixels per row and per column.
  std::size_t side() const { return grid_; }
  std::size_t rows() const { return observables * superpixels(); }

  /// True unless the lens is capped: such a condition has no distance, reflectivity or position.
  bool shows_board(std::size_t condition) const { return !conditions_[condition].is_capped(); }
  /// Number of conditions that show a board.
  std::size_t boards() const {
    return size() - static_cast<std::size_t>(std::ranges::count_if(conditions_, &io::Condition::is_capped));
  }

  /// Expectation of a model, observables x superpixels. @param light logarithm of the factor on the reflectivity
  /// @throws simulation::EffectError
  std::vector<double> predict(const simulation::ForwardModel& model, std::size_t condition, double light = 0) const;

  /// Expectation from points all over the superpixels, reduced like measurements; its difference from predict() is the
  /// error of using the centres for curved patterns. Equal to predict() for a `single` design.
  /// @param every_pixel uses every pixel, for patterns that vary from pixel to pixel
  std::vector<double> predict_finely(const simulation::ForwardModel& model, std::size_t condition, double light,
                                     bool every_pixel) const;

  /// Expected signal of every pixel.
  std::vector<Signal> photograph(const simulation::ForwardModel& model, std::size_t condition, double light) const;

  /// Change of the observables per metre of board distance.
  const std::vector<double>& shift(std::size_t condition) const { return shifts_[condition]; }
  /// Change of the observables per metre of camera offset. For a tilted board it is equal in all pixels, unlike that of
  /// a misplaced board. Otherwise shift() is returned deliberately: two nearly equal directions would together mimic
  /// patterns of the pixels.
  const std::vector<double>& offset(std::size_t condition) const {
    return offsets_[condition].empty() ? shifts_[condition] : offsets_[condition];
  }
  /// True if a board is tilted, so the data can distinguish a camera offset from a misplaced board.
  bool tells_offset() const {
    return std::ranges::any_of(offsets_, [](const auto& rows) { return !rows.empty(); });
  }
  /// Levels of a setting over the conditions that show a board.
  std::set<double> levels(double io::Condition::*setting) const;
  /// True if all conditions state their order of measurement.
  bool tells_order() const {
    return std::ranges::all_of(conditions_, [](const io::Condition& c) { return c.order.has_value(); });
  }
  /// Signal of the ideal camera, one per superpixel.
  const std::vector<Signal>& ideal(std::size_t condition) const { return ideal_[condition]; }
  /// Cosine of the angle of incidence on the board as seen from the lens.
  double incidence(std::size_t condition, std::size_t superpixel) const;

 private:
  Design(const Design& whole, std::span<const std::size_t> chosen);
  std::vector<Signal> signals(const simulation::ForwardModel& model, const simulation::Pixels& pixels,
                              std::size_t condition, const simulation::BoardPose& pose) const;
  /// Signals of the ideal camera; for a capped lens those of stand_in().
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
  std::vector<std::vector<Signal>> ideal_;
  std::vector<std::vector<double>> shifts_, offsets_;  ///< offsets_ are empty where they equal the shifts
};

// ---- Choice of conditions that represents all settings of a large campaign ----

/// All settings of a condition; equal for repeated measurements.
std::string settings_of(const io::Condition& condition);

/// Conditions that represent a campaign: those with equal settings apart from the distance form a group, and the groups
/// take turns, each next with distances far from its earlier ones. If there are more groups than turns, those with the
/// rarest levels come first. A share of the conditions repeats others, if the campaign has repetitions. Independent of
/// the order in the file.
/// @returns `count` indices, or those of all conditions if there are no more; ascending
std::vector<std::size_t> representative_conditions(const std::vector<io::Condition>& conditions, std::size_t count);

}  // namespace tofgraph::diagnosis
