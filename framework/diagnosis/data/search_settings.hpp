// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Every threshold of the gap search. A comment has the decision, the unit and the source of the value, as in the table
/// of docs/method.md, which tests/thresholds.py makes from this file.
#pragma once

#include "diagnosis/data/observables.hpp"

#include <array>
#include <cstddef>

namespace tofgraph::diagnosis {

/// Lengths in m, angles in rad, times in s; deviance is -2 ln likelihood, sd a standard deviation.
struct SearchSettings {
  // == Data ==
  /// edge of a board with a size that is left out | px | chosen
  std::size_t outer_margin_px = 2;
  /// tilt from which a misplaced board differs from an offset of the camera | rad | chosen
  double offset_min_tilt = 0.05;
  /// conditions of a search, and conditions that a fold leaves, at least | conditions | statistical: with
  /// fewer, a model's error and a condition's own cannot be distinguished
  std::size_t min_conditions = 3;
  /// reflectivity at which a search begins where none is known | | chosen: a start; without any amplitudes,
  /// that of the first target
  double unknown_reflectivity = 0.5;
  /// deviation of a pixel from its superpixel's median beyond which it is left out | robust sd | chosen
  double pixel_outlier = 6;
  /// pixels of a superpixel, at least | px | chosen
  std::size_t min_pixels = 8;
  /// pairs of neighbouring pixels whose scatter is compared with the profile's noise, at least | pairs | statistical:
  /// it is known to a quarter then
  std::size_t min_neighbours = 30;
  /// amplitude below which a superpixel is too dark | sd of its mean | chosen
  double min_amplitude = 10;
  /// mean below which a tap is too dark | sd of its noise | physical: a tap cannot be below zero, so its mean
  /// is not the light's
  double min_tap_mean = 4;
  /// mean beyond which a tap is near the full well | of the full well | physical: several sd of its noise,
  /// which is clipped there
  double max_full_well_fraction = 0.98;
  /// least variance of a sample | counts^2 | numerical
  double min_sample_variance = 1e-9;
  /// mean square, in variances of one condition's noise, beyond which phase offsets of pixels are taken out |
  /// variances | chosen
  double pixel_phase_excess = 4;
  /// least sd of a mean in a table | m | physical: tables are printed to a few decimals
  double table_min_sd = 1e-4;
  /// sd of ln amplitude in a table | | chosen: tables do not state it
  double table_amplitude_sd = 1e-2;

  // == Fit ==
  /// sd of the prior of what is linear | typical values | chosen, wide: data that determine anything decide
  double prior_width = 100;
  /// least sd between conditions that is estimated | m; of ln | chosen, wide
  double min_sd = 1e-6;
  /// sd of the boards' places, at most | m | chosen, wide
  double max_jitter_sd = 1;
  /// sd of the camera's offset between conditions, at most | m | chosen
  double max_offset_sd = 1e-2;
  /// sd of the light between conditions, at most | ln | chosen
  double max_light_sd = 0.1;
  /// sd of a drift of the distances, at most | m | physical: warm cameras drift by as much at most
  double max_drift_sd = 2e-3;
  /// sd of a drift of the light, at most | ln | physical: likewise
  double max_drift_light_sd = 2e-2;
  /// sd of sessions, at most | m; ln | chosen
  double max_session_sd = 0.3;
  /// value of an unknown that conditions share beyond which it is held | widest priors | physical: cameras do
  /// not drift by metres
  double max_shared_widths = 5;
  /// gain of a drift to be one; only then may the mean about which it drifts be as large | deviance | chosen: as
  /// min_bic_gain
  double min_drift_gain = 10;
  /// half waves of a drift, at most | half waves | chosen
  std::size_t max_drift_waves = 8;
  /// conditions for each half wave of a drift | conditions | chosen
  std::size_t conditions_per_drift_wave = 6;
  /// deviation of a contrast from the profile's that counts; beside the 95 % interval | | chosen
  double contrast_tolerance = 0.01;
  /// agreement of the conditions' contrasts for it to be an unknown | of the deviation | chosen
  double contrast_agreement = 0.5;
  /// share of the brighter half of the conditions that agree | of the conditions | chosen
  double contrast_min_agreeing = 0.75;
  /// rounds over all variances, at most | rounds | numerical
  int max_variance_rounds = 8;
  /// fall of the deviance at which these end | deviance | numerical: small against converged
  double variances_converged = 0.005;
  /// steps of a fit, at most | steps | numerical
  int max_fit_steps = 30;
  /// fall of the deviance at which a fit ends | deviance | numerical: small against the 10 that decide
  double converged = 0.02;
  /// likewise, for a comparison of candidates | deviance | numerical: small against the 10 that decide
  double roughly_converged = 0.5;
  /// halvings of a start where effects give no number | halvings | numerical
  int max_start_halvings = 6;
  /// step of a derivative | typical values | numerical: small for wide nonlinear parameters, large against
  /// rounding
  double derivative_step = 0.02;

  // == Nuisances of conditions ==
  /// half waves of a board's shape, in all directions | half waves | chosen
  int board_max_half_waves = 14;
  /// half waves from which on shapes are weaker | half waves | chosen
  double board_spectrum_bend = 3;
  /// smallest sd of shapes that is tried | m | numerical: a grid
  double board_min_trial_sd = 5e-5;
  /// largest sd of shapes that is tried | m | numerical: a grid
  double board_max_trial_sd = 1e-2;
  /// ratio of the sds of shapes that are tried | | numerical: a grid
  double board_trial_factor = 1.6;
  /// share that shapes explain, at least, where nothing may be left | of the excess of chi-square | chosen
  double board_min_share = 0.25;
  /// share that shapes explain to be accepted by themselves | of the excess of chi-square | chosen
  double board_sure_share = 0.5;
  /// gain of one shape for all targets, at most | of their gain | chosen
  double board_max_common_gain = 0.95;
  /// sd of shapes, at most | m | physical: what boards are not flat by
  double board_max_sd = 2e-3;
  /// fall of the deviance by shapes, at least | deviance | chosen
  double board_min_deviance_gain = 20;
  /// promise of sets of effects to be tried in the place of shapes | of their gain | chosen
  double board_min_subset_promise = 0.8;
  /// rounds of boards and effects in turn, two fits and one that goes on as they went | rounds | numerical
  int board_max_rounds = 12;
  /// fall of the deviance at which these end | deviance | numerical
  double board_converged = 1;
  /// half waves of a smooth field over the image, in all directions | half waves | chosen
  int field_max_half_waves = 6;
  /// fall of the deviance by a smooth field, at least | deviance | chosen
  double field_min_deviance_gain = 20;
  /// smallest sd of a smooth field that is tried | m | numerical: a grid
  double field_min_trial_sd = 2e-5;
  /// largest sd of a smooth field that is tried | m | numerical: a grid
  double field_max_trial_sd = 2e-2;
  /// ratio of the sds of smooth fields that are tried | | numerical: a grid
  double field_trial_factor = 1.5;
  /// runs of conditions over which a smooth field stays the same, at least | runs | chosen: what stays for half
  /// of a campaign may be the camera's
  std::ptrdiff_t field_min_runs = 3;
  /// correlation of a smooth field within a run | | chosen
  double field_run_correlation = 0.2;
  /// sd beyond which a smooth field is unexplained, and not a nuisance | m | physical: what boards and rooms
  /// leave
  double field_max_nuisance_sd = 2e-3;
  /// degrees of freedom of Student's t of the boards' places | | chosen
  double board_offset_freedom = 4;
  /// factor on the jitter from which a board counts less, which is 2.7 sd off | | chosen
  double min_jitter_scale = 1.5;
  /// deviation from which a board is reported as misplaced | sd | chosen
  double misplaced_sd = 6;
  /// likewise, at least | m | physical: less is what rails and boards do
  double misplaced_distance = 3e-3;
  /// conditions for a median of the boards' places | conditions | chosen
  std::size_t misplaced_min_conditions = 8;
  /// change of the jitter scale after which effects are looked for again | ln | chosen
  double jitter_scale_change = 0.2;

  // == Alternatives and sets ==
  /// refinements of an alternative, at most | refinements | chosen
  int max_refinements_at_once = 2;
  /// amplitudes of an effect that can be searched | amplitudes | chosen, for the time
  std::size_t max_amplitudes = 8;
  /// nonlinear parameters that are varied, at most | parameters | chosen, for the time
  std::ptrdiff_t max_varied = 2;
  /// cosine from which an effect does the same at all values of its nonlinear parameters, or as a simpler one | cosine
  /// | numerical
  double collinear = 0.9999;
  /// chi-square below which nothing is left to explain | of its expectation | chosen
  double explained = 1.05;
  /// fall of BIC for a set of effects, and for each effect in it | BIC | chosen; as far as BIC gives odds, 150
  /// to 1
  double min_bic_gain = 10;
  /// effects that are added in all | effects | chosen
  std::size_t max_effects = 6;
  /// effects of a set | effects | chosen, for the time
  std::size_t max_set_effects = 4;
  /// sets of a size that are fitted | sets | chosen
  std::size_t kept_sets = 3;
  /// sets of a size that are enlarged | sets | chosen, for the time
  std::size_t beam = 2500;
  /// fall of BIC for a set to take the lead | BIC | chosen
  double min_lead = 1;
  /// enumerations of sets, each in the noise that the best fit before has left | rounds | chosen
  std::size_t max_subset_rounds = 3;
  /// share of the best set's promise that is nearly all: what is missing may be curvature | of the promise |
  /// chosen
  double nearly_all = 0.97;
  /// gain that more effects than needed have | deviance | chosen
  double chance_gain = 30;
  /// single effects that are fitted, at most | effects | chosen
  std::size_t max_singles = 8;
  /// single effects that are always fitted | effects | chosen
  std::size_t sure_singles = 3;
  /// promise of a single effect to be fitted beyond these | of the best | chosen: a large gap is curved
  double min_single_promise = 0.3;
  /// forms of a rival that are fitted | forms | chosen, for the time
  std::size_t max_forms = 3;
  /// difference up to which sets promise the same as before | of the promise | chosen, for the time
  double same_promise = 0.02;
  /// change by a whole step below which an amplitude is begun at half a step, too | chi-square | statistical
  double min_visible_chi_square = 1;
  /// reduction by an addition beside others, at least | of the excess of chi-square | chosen
  double min_excess_reduction = 0.1;
  /// linearised worth from which an effect is not fitted without | times its price | chosen: boards and light
  /// that scatter more are accounted for
  double clearly_worth = 3;

  // == Maps ==
  /// change by one step of a superpixel's value | sd | numerical
  double map_step_sd = 10;
  /// change by the largest values for a map to be estimated | sd | numerical: less is rounding
  double map_min_visible = 1;
  /// updates of a trial's maps, for what is not linear | rounds | numerical
  int map_trial_rounds = 2;
  /// updates of maps beside what else is fitted | rounds | numerical
  int map_max_rounds = 8;
  /// fall of the deviance at which these end | deviance | numerical
  double map_converged = 1;
  /// rough gain of a map to be scored | of its price | chosen: the rough gain ignores what effects can take
  /// over
  double map_min_rough_gain = 0.5;
  /// gain of maps alone for a search that begins with them | of what was gained | chosen
  double map_start_share = 0.3;
  /// promise of sets of effects to be tried in the place of a map | of what the map gains | chosen: curvature
  /// may make more of it
  double map_replacement_promise = 0.75;
  /// excess left by maps in the place of other effects | of the excess of chi-square | chosen
  double map_max_excess = 0.01;

  // == Tests of an effect, and rivals ==
  /// p-value of the sign flips | | statistical: one wrong name in 200 campaigns
  double significance = 0.005;
  /// sign flips | draws | statistical: then p below 0.005 is four draws that gain as much, at most
  std::size_t sign_flips = 1000;
  /// conditions that carry a gain below which sign flips cannot be significant | conditions | statistical: p
  /// can reach 2/1024; with 8 it is 2/256 at least
  double min_effective_sample_size = 10;
  /// gain that is enough there, and where nothing is left; times the conditions of a run | deviance | chosen
  double certain_gain = 60;
  /// gain of an effect's own signature | of the best pattern's gain | chosen
  double min_explained_fraction = 0.8;
  /// likewise, of an effect that cross-fitting confirmed | of the best pattern's gain | chosen on one
  /// laboratory's campaign
  double min_explained_fraction_confirmed = 0.5;
  /// fall of a pattern's gain for it to be compared | of its gain | chosen
  double related_pattern_fall = 0.2;
  /// interval beyond which a nonlinear parameter is not identifiable | typical values | chosen
  double max_interval_width = 10;
  /// distance from its least value at which a nonlinear parameter is at its limit | typical values | numerical:
  /// within a step of a derivative
  double near_limit = 0.02;
  /// interval up to which it is identifiable there | typical values | chosen
  double max_width_at_limit = 1;
  /// confidence region in which amplitudes may be off together | | statistical: as of intervals
  double joint_confidence = 0.95;
  /// difference up to which a rival is tied, or chi-square of what conditions differ by | deviance or BIC |
  /// chosen: as min_bic_gain
  double tie_limit = 10;
  /// linear gain of a rival to be fitted | of the best gain | chosen
  double min_rival_gain = 0.5;
  /// deviance up to which a rival is fitted by every pixel | of the gain | chosen
  double close_rival = 0.01;
  /// linear gain of a candidate that may come near the unexplained residual | of the best gain | chosen:
  /// curvature may make more of it
  double min_nearest_gain = 0.3;
  /// gain from which it is listed | of the best pattern's gain | chosen
  double min_nearest_fraction = 0.01;
  /// candidates that are fitted for that | candidates | chosen, for the time
  std::size_t max_fitted_candidates = 6;
  /// starts of the fit of one candidate | starts | chosen
  std::size_t max_starts = 2;
  /// gain of the second start | of the first's gain | chosen
  double second_start_gain = 0.5;
  /// step of an amplitude below which half a typical step is tried | typical steps | chosen
  double unmoved_amplitude = 0.02;

  // == Held-out data ==
  /// levels of a setting, at least; groups of targets and sessions, at most | levels | chosen
  std::size_t min_levels = 4;
  /// groups of distances between the ends | groups | chosen
  std::size_t interleaved_groups = 3;
  /// clusters of conditions for an interval, else single conditions | clusters | statistical
  std::size_t min_clusters = 5;
  /// levels at either end | of the levels | chosen
  double end_share = 0.1;
  /// conditions that are left where a session is held out | of the conditions | chosen
  double min_left_by_session = 0.25;
  /// folds that choose an effect, at least | of the folds | chosen
  double min_chosen_fraction = 0.8;
  /// change from which a rise ends the folds | chi-square | chosen: 5 sd, as blind_below
  double min_harm_chi_square = 25;
  /// factor by which the held-out distance gap may grow, beside the practical threshold | | chosen
  double max_gap_growth = 1.05;
  /// factor by which the distance gap of the given model may grow | | physical: rounding and the coarse grid
  double max_given_gap_growth = 1.01;
  /// likewise, beside the factor | m | physical: rounding and the coarse grid
  double given_gap_tolerance = 2e-5;
  /// draws for the interval of the held-out gap | draws | chosen
  int gap_interval_draws = 1000;
  /// folds that are searched at the same time | folds | chosen, for memory and time
  std::size_t folds_at_once = 4;
  /// folds that are searched first | folds | chosen, for the time
  std::size_t first_folds = 2;
  /// folds before a rise may end the others | folds | chosen, for the time
  std::size_t min_folds_to_refute = 3;
  /// folds whose majority is followed | folds | chosen
  std::size_t min_agreeing_folds = 3;
  /// sets on which folds agree that are fitted | sets | chosen
  std::size_t max_agreed_models = 3;
  /// half interval of an amplitude of the given model beyond which it keeps its value | typical values | chosen
  double max_given_width = 1;
  /// likewise, of a nonlinear parameter | typical values | chosen
  double max_given_width_nonlinear = 5;
  /// sd beside a simpler effect beyond which it keeps its value | typical values | chosen
  double max_given_sd_beside = 0.5;
  /// sd without the simpler effect, at most | of that | chosen
  double max_given_sd_alone = 0.3;

  // == Unexplained residual and intervals ==
  /// degree of a pattern | degree | chosen
  int max_legendre = 4;
  /// cycles of a pattern over the phase | cycles a turn | physical: those of a seventh harmonic in four samples
  int max_cycles = 8;
  /// rate of false discoveries of patterns | | statistical: Benjamini and Hochberg
  double false_discoveries = 0.05;
  /// gain of a pattern to be listed | deviance | chosen
  double min_pattern_gain = 30;
  /// sd of the camera's offset from which it is unsteady | m | chosen
  double unsteady_sd = 1e-3;
  /// gain of that, at least | deviance | chosen
  double unsteady_min_gain = 20;
  /// draws of the parallel analysis | draws | chosen
  int parallel_analysis_draws = 100;
  /// excess over chance of a component that follows no axis | sd | chosen
  double component_sd = 6;
  /// draws of intervals | draws | chosen
  int interval_draws = 500;

  // == Audit, and what to measure next ==
  /// singular value from which a direction of a signature counts | sd | chosen
  double determined_above = 3;
  /// size of a signature from which a search is said to find an effect | sd | chosen
  double found_at = 8;
  /// cosine from which two effects are alike | cosine | chosen
  double alike_above = 0.9;
  /// signature below which a design is blind to an effect | sd | chosen
  double blind_below = 5;
  /// size of a blind effect that is to be distinguished | of its typical size | chosen
  double blind_share = 0.5;
  /// ratio of the values that are to be distinguished to the typical one | | chosen
  double undetermined_ratio = 3;
  /// sd of nonlinear parameters in a new condition about what was fitted | typical values | numerical: farther
  /// they are not linear
  double nonlinear_prior_sd = 1;
  /// distance of two models in a condition that distinguishes them | sd | statistical: one in twenty differs by
  /// as much by chance
  double min_distinction = 2;
  /// distance for a condition to be proposed | times what was measured | chosen
  double min_distinction_gain = 1.1;
  /// nearest distance that is proposed | of the campaign's | chosen
  double near_board = 0.7;
  /// farthest distance that is proposed | of the campaign's | chosen
  double far_board = 1.3;
  /// distance of a proposed board from the end of the unambiguous range | m | chosen
  double range_margin = 0.1;
  /// time since power-on at which a cold camera is measured | s | physical: as soon as a lab can
  double cold_time = 60;
  /// half interval beside a map up to which an effect of the set-up is determined | typical values | chosen
  double max_tie_width = 1;
  /// ratio of the noise to the profile's from which it is noted | | physical: profiles state their noise to
  /// some 30 %
  double max_noise_ratio = 1.4;
  /// bad pixels that are noted | of the pixels | chosen
  double noted_bad_pixels = 0.001;
  /// drift or sessions that are noted | m | chosen
  double noted_drift = 2e-4;
  /// likewise, of the light | ln | chosen
  double noted_drift_light = 2e-3;

  // == Random halves ==
  /// random halves of the data in which effects are chosen again where nothing was measured twice | | chosen
  std::size_t halves = 40;
  /// halves that choose an effect which is not weak, at least | of the halves | chosen: a majority
  double min_share_of_halves = 0.5;

  // == Time limit ==
  /// time by which the search has ended | of the limit | chosen: reports take the rest
  double searched_by = 0.65;
  /// time by which the comparison with the given model has ended | of the limit | chosen: likewise
  double verified_by = 0.8;
  /// time by which the comparison with other effects has ended | of the limit | chosen: likewise
  double compared_by = 0.9;

  // == Practical significance ==
  /// root mean square of a change in some condition, by observable, below which it does not matter | m; of ln |
  /// physical: what the coarse grid misses, and what a camera repeats
  std::array<double, observables> practical_threshold = {1e-4, 1e-3, 1e-3, 2e-4, 2e-4};
};
inline constexpr SearchSettings settings;

}  // namespace tofgraph::diagnosis
