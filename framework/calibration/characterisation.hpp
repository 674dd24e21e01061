// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Characterisation of a camera by boards at known positions: chapters 3 and 5 of the reference for any camera.
#pragma once

#include "calibration/campaign_inputs.hpp"
#include "calibration/interval.hpp"
#include "graph/plugin.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// The three distance non-linearity models, section 5.5 of the reference; the simple one requires the true depth.
enum class DepthModel { perpendicular, simple_bistatic, optimized_bistatic };
inline constexpr std::array depth_model_names = {"perpendicular_illumination", "simple_bistatic", "optimized_bistatic"};

/// Industry accuracy protocol: requirements on a condition, and the evaluated region.
struct AccuracyProtocol {
  double warm_up = 1200;                              ///< s since power-on
  std::array<double, 2> reflectivity = {0.85, 0.95};  ///< of the target: 90 %
  std::size_t side = 40;                              ///< px, of the square at the image centre
  std::size_t frames = 25;
};

/// Result of one condition. Lengths in m.
struct Characterised {
  std::size_t condition = 0;  ///< index in the campaign
  Board board;
  std::array<Moments, 3> depth;         ///< by model, over the window's pixels, averaged over frames
  double noise = unknown;               ///< depth noise of a pixel in one frame
  double error_sd = unknown;            ///< of depth minus true depth over the pixels, averaged over frames
  double modelled_amplitude = unknown;  ///< counts, with the target's mean reflectivity
  double centre_error = unknown;        ///< mean depth minus true depth, in the protocol's square
  double centre_noise = unknown;        ///< depth noise of a pixel in one frame, in the protocol's square
  std::vector<std::string> protocol;    ///< deviations from the protocol; empty: none
};

/// Contribution to the error of a pixel in one frame, root mean square over pixels and conditions.
struct BudgetLine {
  std::string name, text;
  double depth = 0;  ///< m
};

/// Images of one board, averaged over frames; row-major over the whole sensor, NaN where no board was seen.
struct BoardImages {
  std::vector<double> measured_distance, modelled_distance;    ///< m, half path; modelled: (6.1)
  std::vector<double> measured_amplitude, modelled_amplitude;  ///< relative to their mean; modelled: (5.9) to (5.13),
                                                               ///< (5.92)
};

struct Characterisation {
  Campaign campaign;
  std::vector<Characterised> conditions;  ///< in campaign order
  std::vector<double> pattern;  ///< m, mean over the conditions of a pixel's error minus the board's; NaN: none
  std::vector<std::vector<float>> residuals;  ///< residuals of `shown`, m: depth minus true depth
  std::vector<std::size_t> shown;             ///< indices into conditions
  BoardImages nearest;                        ///< of the nearest board in `shown`
  std::vector<BudgetLine> budget;             ///< from the data
  std::vector<BudgetLine> effects;            ///< per effect of the model, if one is given
  double total = 0;                           ///< m, root mean square of all errors
  Interval total_by_distance;                 ///< the same, with an interval by resampling distances
};

struct CharacterisationRequest {
  Request campaign;             ///< its file and the progress callback
  std::filesystem::path model;  ///< empty: none
};

/// @throws config::ConfigurationError with all errors
Characterisation characterise(const CharacterisationRequest& request, const graph::PluginRegistry& registry);

/// Sets the contributions to the error. @param pattern_square m^2, mean square of the fixed pattern without noise
void set_budget(Characterisation& data, double pattern_square);

/// Contribution of each effect of a model: root mean square change of the depth of the campaign's boards without it.
/// @throws config::ConfigurationError
std::vector<BudgetLine> effect_budget(const Characterisation& data, const std::filesystem::path& model,
                                      const graph::PluginRegistry& registry);

report::Page characterisation_report(const Characterisation& data);
nlohmann::json characterisation_json(const Characterisation& data);
/// Summary in a few lines.
std::string summary_of(const Characterisation& data);

}  // namespace tofgraph::calibration
