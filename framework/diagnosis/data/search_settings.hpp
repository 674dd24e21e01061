// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Every threshold of the verdict. Its comment states decision, unit and source, as in the table of docs/method.md,
/// which tests/thresholds.py makes from this file.
#pragma once

#include "diagnosis/data/observables.hpp"

#include <array>
#include <cstddef>

namespace tofgraph::diagnosis {

/// Lengths in m, angles in rad, times in s; deviance is -2 ln likelihood, sd a standard deviation.
struct SearchSettings {
  // == Data ==
  /// margin left out at a board's edge | px | chosen
  std::size_t outer_margin_px = 2;
  /// tilt that separates board and camera offset | rad | chosen
  double offset_min_tilt = 0.05;
  /// conditions of a search or fold, at least | | statistical: with fewer, a model's error and a condition's own cannot
  /// be distinguished
  std::size_t min_conditions = 3;
  /// conditions that are searched, at most; the others are only predicted | | chosen, for time and memory
  std::size_t max_conditions = 500;
  /// levels of a setting, at most, to choose these conditions by them | of the searched conditions | chosen
  double max_level_share = 0.5;
  /// repetitions among these conditions | | chosen
  double share_of_repetitions = 0.1;
  /// start of an unknown reflectivity | | chosen: a start; without any amplitudes, that of the first target
  double unknown_reflectivity = 0.5;
  /// pixel dropped as an outlier beyond | robust sd | chosen
  double pixel_outlier = 6;
  /// pixels of a superpixel, at least | | chosen
  std::size_t min_pixels = 8;
  /// neighbouring pairs to estimate noise, at least | | statistical: the noise is then known to a quarter
  std::size_t min_neighbours = 30;
  /// superpixel too dark below this amplitude | sd of its mean | chosen
  double min_amplitude = 10;
  /// tap too dark below this mean | sd of its noise | physical: a tap cannot be below zero, so its mean is not the
  /// light's
  double min_tap_mean = 4;
  /// tap near the full well above this fraction | | physical: several sd of its noise, which is clipped there
  double max_full_well_fraction = 0.98;
  /// least variance of a sample | counts^2 | numerical
  double min_sample_variance = 1e-9;
  /// mean square above which pixel phases are subtracted | variances | chosen
  double pixel_phase_excess = 4;
  /// least sd of a distance in tables | m | physical: tables are printed to a few decimals
  double table_min_sd = 1e-4;
  /// sd of ln amplitude in tables | | chosen: tables do not state it
  double table_amplitude_sd = 1e-2;

  // == Fit ==
  /// prior sd of linear parameters | typical values | chosen, wide: any informative data outweigh it
  double prior_width = 100;
  /// least sd between conditions | m; of ln | chosen, wide
  double min_sd = 1e-6;
  /// largest sd of board positions | m | chosen, wide
  double max_jitter_sd = 1;
  /// largest sd of camera offset | m | chosen
  double max_offset_sd = 1e-2;
  /// largest sd of light | ln | chosen
  double max_light_sd = 0.1;
  /// largest sd of distance drift | m | physical: upper limit for warm cameras
  double max_drift_sd = 2e-3;
  /// largest sd of light drift | ln | physical: upper limit for warm cameras
  double max_drift_light_sd = 2e-2;
  /// largest sd between sessions | m; ln | chosen
  double max_session_sd = 0.3;
  /// shared unknown held beyond | widest priors | physical: cameras do not drift by metres
  double max_shared_widths = 5;
  /// gain by a drift of distance or light that is significant, at least | deviance | chosen: as min_bic_gain
  double min_drift_gain = 10;
  /// half waves of a drift, at most | | chosen
  std::size_t max_drift_waves = 8;
  /// conditions per half wave of drift | | chosen
  std::size_t conditions_per_drift_wave = 6;
  /// least contrast deviation that counts | | chosen
  double contrast_tolerance = 0.01;
  /// relative agreement required between contrasts | | chosen
  double contrast_agreement = 0.5;
  /// share of brighter conditions that must agree | | chosen
  double contrast_min_agreeing = 0.75;
  /// rounds over all variances, at most | | numerical
  int max_variance_rounds = 8;
  /// fall of the deviance at which the rounds over variances end | deviance | numerical: small against converged
  double variances_converged = 0.005;
  /// steps of a fit, at most | steps | numerical
  int max_fit_steps = 30;
  /// fall of the deviance at which a fit ends | deviance | numerical: small against min_bic_gain
  double converged = 0.02;
  /// fall of the deviance at which a fit for a comparison of candidates ends | deviance | numerical: small against
  /// min_bic_gain
  double roughly_converged = 0.5;
  /// halvings of a start that gives no number or a worse model | halvings | numerical
  int max_start_halvings = 6;
  /// step of a derivative | typical values | numerical: small for wide nonlinear parameters, large against rounding
  double derivative_step = 0.02;

  // == Nuisances of conditions ==
  /// half waves of a board, at most | | chosen
  int board_max_half_waves = 14;
  /// half waves at which the sd halves | | chosen
  double board_spectrum_bend = 3;
  /// smallest sd of flatness that is tried | m | numerical: a grid
  double board_min_trial_sd = 5e-5;
  /// largest sd of flatness that is tried | m | numerical: a grid
  double board_max_trial_sd = 1e-2;
  /// ratio of the sds of flatness that are tried | | numerical: a grid
  double board_trial_factor = 1.6;
  /// share of excess explained by flatness, at least | | chosen
  double board_min_share = 0.25;
  /// share of excess at which flatness is accepted | | chosen
  double board_sure_share = 0.5;
  /// relative gain of one common field, at most | | chosen
  double board_max_common_gain = 0.95;
  /// sd of flatness, at most | m | physical: usual deviation of boards from flatness
  double board_max_sd = 2e-3;
  /// gain by flatness, at least | deviance | chosen
  double board_min_deviance_gain = 20;
  /// relative predicted gain for effects to replace flatness | | chosen
  double board_min_subset_promise = 0.8;
  /// rounds that alternate between boards and effects, at most | | numerical
  int board_max_rounds = 12;
  /// fall of the deviance at which that alternation ends | deviance | numerical
  double board_converged = 1;
  /// half waves of a smooth field, at most | | chosen
  int field_max_half_waves = 6;
  /// gain by a smooth field, at least | deviance | chosen
  double field_min_deviance_gain = 20;
  /// smallest sd of a smooth field that is tried | m | numerical: a grid
  double field_min_trial_sd = 2e-5;
  /// largest sd of a smooth field that is tried | m | numerical: a grid
  double field_max_trial_sd = 2e-2;
  /// ratio of the sds of smooth fields that are tried | | numerical: a grid
  double field_trial_factor = 1.5;
  /// runs of a lasting field, at least | | chosen: a field that lasts half of a campaign may be the camera's
  std::ptrdiff_t field_min_runs = 3;
  /// least correlation within a run | | chosen
  double field_run_correlation = 0.2;
  /// smooth field is unexplained above | m | physical: usual residual of boards and rooms
  double field_max_nuisance_sd = 2e-3;
  /// degrees of freedom of board offsets | | chosen
  double board_offset_freedom = 4;
  /// jitter factor (2.7 sd) that downweights a board | | chosen
  double min_jitter_scale = 1.5;
  /// board is reported as misplaced above | sd | chosen
  double misplaced_sd = 6;
  /// distance error of a misplaced board, at least | m | physical: smaller errors are usual for rails and boards
  double misplaced_distance = 3e-3;
  /// conditions for median board offset, at least | | chosen
  std::size_t misplaced_min_conditions = 8;
  /// change of jitter or drift mean that repeats a fit or selection | ln | chosen
  double jitter_scale_change = 0.2;

  // == Alternatives and sets ==
  /// refinements per alternative, at most | | chosen
  int max_refinements_at_once = 2;
  /// amplitude parameters per effect, at most | | chosen, for the time
  std::size_t max_amplitudes = 8;
  /// nonlinear parameters on a grid, at most | | chosen, for the time
  std::ptrdiff_t max_varied = 2;
  /// signatures are the same above | cosine | numerical
  double collinear = 0.9999;
  /// lack of fit: explained below | | chosen
  double explained = 1.05;
  /// fall of BIC per set or effect | BIC | chosen; if BIC is read as odds, 150 to 1
  double min_bic_gain = 10;
  /// effects added in all, at most | | chosen
  std::size_t max_effects = 6;
  /// effects per set, at most | | chosen, for the time
  std::size_t max_set_effects = 4;
  /// sets per size that are fitted | | chosen
  std::size_t kept_sets = 3;
  /// sets per size that are extended | | chosen, for the time
  std::size_t beam = 2500;
  /// fall of BIC to become best set | BIC | chosen
  double min_lead = 1;
  /// enumerations per step, at most | | chosen
  std::size_t max_subset_rounds = 3;
  /// sufficient share of the best predicted gain | | chosen
  double nearly_all = 0.97;
  /// predicted gain attributed to superfluous effects | deviance | chosen
  double chance_gain = 30;
  /// single effects that are fitted, at most | | chosen
  std::size_t max_singles = 8;
  /// single effects that are always fitted | | chosen
  std::size_t sure_singles = 3;
  /// share of the best single predicted gain to fit further single effects | | chosen: the response to a large gap is
  /// nonlinear
  double min_single_promise = 0.3;
  /// forms per rival that are fitted | | chosen, for the time
  std::size_t max_forms = 3;
  /// predicted gains are the same within (relative) | | chosen, for the time
  double same_promise = 0.02;
  /// start also at half a step below | chi-square | statistical
  double min_visible_chi_square = 1;
  /// share of excess a further addition removes, at least | | chosen
  double min_excess_reduction = 0.1;
  /// removal not fitted if predicted cost over price exceeds | | chosen: the predicted cost excludes what boards and
  /// light can take over
  double clearly_worth = 3;

  // == Maps ==
  /// change by one step of a superpixel's value | sd | numerical
  double map_step_sd = 10;
  /// change by the largest values for a map to be estimated | sd | numerical: less is rounding
  double map_min_visible = 1;
  /// updates of a trial's maps | | numerical
  int map_trial_rounds = 2;
  /// updates of maps beside the other parameters, at most | | numerical
  int map_max_rounds = 8;
  /// fall of the deviance at which updates of maps end | deviance | numerical
  double map_converged = 1;
  /// approximate gain over price to evaluate a map | | chosen: the rough gain ignores what effects can take over
  double map_min_rough_gain = 0.5;
  /// share of BIC fall by maps alone to start with them | | chosen
  double map_start_share = 0.3;
  /// relative predicted gain for effects to replace maps | | chosen: the nonlinear gain may be larger
  double map_replacement_promise = 0.75;
  /// share of a map's gain that effects in its place may lose if they explain everything | | chosen: small errors of
  /// their formulas
  double map_replacement_loss = 0.01;
  /// share of excess left by maps that replace effects | | chosen
  double map_max_excess = 0.01;

  // == Tests of an effect, and rivals ==
  /// p-value, below | | statistical: one wrong name in 200 campaigns
  double significance = 0.005;
  /// random sign flips | | statistical: p below 0.005 is then at most four draws with as large a gain
  std::size_t sign_flips = 1000;
  /// effective sample size below which flips are insufficient | | statistical: p can reach 2/1024; with 8 it is 2/256
  /// at least
  double min_effective_sample_size = 10;
  /// gain beyond parameters that suffices, if flips cannot or everything is explained | deviance | chosen
  double certain_gain = 60;
  /// explained fraction, at least | | chosen
  double min_explained_fraction = 0.8;
  /// explained fraction of an effect confirmed by cross-fitting, at least | | chosen on one laboratory's campaign
  double min_explained_fraction_confirmed = 0.5;
  /// relative fall of a pattern that is compared | | chosen
  double related_pattern_fall = 0.2;
  /// interval of a nonlinear parameter, at most | typical values | chosen
  double max_interval_width = 10;
  /// distance from its least value at which a nonlinear parameter is at its limit | typical values | numerical: within
  /// a step of a derivative
  double near_limit = 0.02;
  /// interval of a nonlinear parameter at its lower limit, at most | typical values | chosen
  double max_width_at_limit = 1;
  /// joint region of amplitude parameters | | statistical: as for intervals
  double joint_confidence = 0.95;
  /// difference of tied rivals, less than | deviance, BIC | chosen: as min_bic_gain
  double tie_limit = 10;
  /// relative linear gain to fit a rival | | chosen
  double min_rival_gain = 0.5;
  /// relative difference below which rivals use every pixel | | chosen
  double close_rival = 0.01;
  /// relative linear gain to fit nearest candidates | | chosen: the nonlinear gain may be larger
  double min_nearest_gain = 0.3;
  /// explained fraction of a nearest candidate, at least | | chosen
  double min_nearest_fraction = 0.01;
  /// rivals or nearest candidates that are fitted, at most | | chosen, for the time
  std::size_t max_fitted_candidates = 6;
  /// starts per candidate, at most | | chosen
  std::size_t max_starts = 2;
  /// relative gain for a second start | | chosen
  double second_start_gain = 0.5;
  /// step below which half steps are tried | typical steps | chosen
  double unmoved_amplitude = 0.02;

  // == Held-out data ==
  /// levels of a setting to hold some out, at least; groups of targets or sessions, at most | | chosen
  std::size_t min_levels = 4;
  /// interleaved groups of distances | | chosen
  std::size_t interleaved_groups = 3;
  /// clusters of conditions to draw for an interval, at least; with fewer, conditions are drawn | | statistical
  std::size_t min_clusters = 5;
  /// share of levels held out at either end | | chosen
  double end_share = 0.1;
  /// share of conditions that remain without a session, at least | | chosen
  double min_left_by_session = 0.25;
  /// share of folds that support an effect, at least | to the nearest whole fold | chosen
  double min_supporting_fraction = 0.8;
  /// change by an effect that may end cross-fitting early, at least | chi-square | chosen: 5 sd, as blind_below
  double min_harm_chi_square = 25;
  /// growth of held-out gap, at most | | chosen
  double max_gap_growth = 1.05;
  /// gap over that of the given model, at most | | physical: rounding and the coarse grid
  double max_given_gap_growth = 1.01;
  /// growth of the given model's gap beyond that factor, at most | m | physical: rounding and the coarse grid
  double given_gap_tolerance = 2e-5;
  /// bootstrap draws of held-out gap | | chosen
  int gap_interval_draws = 1000;
  /// folds searched in parallel | | chosen, for memory and time
  std::size_t folds_at_once = 4;
  /// folds searched first | | chosen, for the time
  std::size_t first_folds = 2;
  /// folds before a worse prediction may end cross-fitting | | chosen, for the time
  std::size_t min_folds_to_refute = 3;
  /// folds for a majority, at least | | chosen
  std::size_t min_agreeing_folds = 3;
  /// sets with an effect of most folds that are fitted to all data, at most | | chosen
  std::size_t max_agreed_models = 3;
  /// half interval of refitted given amplitudes, at most | typical values | chosen
  double max_given_width = 1;
  /// half interval of refitted given nonlinear parameters, at most | typical values | chosen
  double max_given_width_nonlinear = 5;
  /// sd of a given amplitude beside a simpler effect, held above | typical values | chosen
  double max_given_sd_beside = 0.5;
  /// relative sd of such an amplitude without the simpler effect, at most | | chosen
  double max_given_sd_alone = 0.3;

  // == Unexplained residual and intervals ==
  /// largest degree of patterns | | chosen
  int max_legendre = 4;
  /// largest frequency of phase patterns | cycles a turn | physical: that of a seventh harmonic in four samples
  int max_cycles = 8;
  /// false discovery rate of patterns | | statistical: Benjamini and Hochberg
  double false_discoveries = 0.05;
  /// gain of a listed pattern, at least | deviance | chosen
  double min_pattern_gain = 30;
  /// camera offset scatters above | m | chosen
  double unsteady_sd = 1e-3;
  /// gain by scatter of the camera offset, at least | deviance | chosen
  double unsteady_min_gain = 20;
  /// draws of the parallel analysis | | chosen
  int parallel_analysis_draws = 100;
  /// principal component is unexplained above | sd | chosen
  double component_sd = 6;
  /// bootstrap draws of intervals | | chosen
  int interval_draws = 500;
  /// refinement fitted for intervals above | its sd | chosen: below, most are linear
  double interval_refinement_sd = 2;

  // == Audit, and what to measure next ==
  /// direction of a signature counts above | sd | chosen
  double determined_above = 3;
  /// signature predicted to be found above | sd | chosen
  double found_at = 8;
  /// signatures are alike above | cosine | chosen
  double alike_above = 0.9;
  /// a rival beside maps also starts in the place of the effect above | cosine | chosen
  double twins_above = 0.9999;
  /// design is blind below | sd | chosen
  double blind_below = 5;
  /// size of a blind effect to distinguish | typical values | chosen
  double blind_share = 0.5;
  /// ratio of undetermined values to distinguish | | chosen
  double undetermined_ratio = 3;
  /// sd of nonlinear parameters in a new condition about their fitted values | typical values | numerical: beyond it
  /// the model is not linear
  double nonlinear_prior_sd = 1;
  /// distance of two models, at least | sd | statistical: one in twenty differs by as much by chance
  double min_distinction = 2;
  /// distance of two models over that in measured conditions, at least | | chosen
  double min_distinction_gain = 1.1;
  /// nearest proposed distance, relative | | chosen
  double near_board = 0.7;
  /// farthest proposed distance, relative | | chosen
  double far_board = 1.3;
  /// distance from unambiguous range, at least | m | chosen
  double range_margin = 0.1;
  /// cold camera measured after | s | physical: the earliest possible in a laboratory
  double cold_time = 60;
  /// set-up effect is determined below, beside a map | typical values | chosen
  double max_tie_width = 1;
  /// noise is noted above | | physical: profiles state their noise to some 30 %
  double max_noise_ratio = 1.4;
  /// share of bad pixels noted above | | chosen
  double noted_bad_pixels = 0.001;
  /// drift or sessions noted above | m | chosen
  double noted_drift = 2e-4;
  /// drift or sessions of light noted above | ln | chosen
  double noted_drift_light = 2e-3;

  // == Random halves ==
  /// random halves without repeated measurements | | chosen
  std::size_t halves = 40;
  /// share of halves choosing an effect, else weak | | chosen: a majority
  double min_share_of_halves = 0.5;

  // == Time limit ==
  /// share of time for the search | | chosen: reports take the rest
  double searched_by = 0.7;
  /// share of time for the search and a set on which the searched folds agree | | chosen
  double followed_by = 0.78;
  /// share of time for these and the comparison with the given model | | chosen: reports take the rest
  double verified_by = 0.86;
  /// share of time for all and the comparison with rivals | | chosen: reports take the rest
  double compared_by = 0.93;

  // == Practical significance ==
  /// change that does not matter, by observable (RMS) | m; of ln | physical: error of the coarse grid, and
  /// repeatability of a camera
  std::array<double, observables> practical_threshold = {1e-4, 1e-3, 1e-3, 2e-4, 2e-4};
};
inline constexpr SearchSettings settings;

}  // namespace tofgraph::diagnosis
