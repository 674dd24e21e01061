// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Comparison of measured depths with the known planes of a campaign: bias, flatness and noise. SI.
#pragma once

#include "io/campaign.hpp"
#include "report/page.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Errors of the depth over some pixels, m. NaN: unknown.
struct DepthErrors {
  double bias = io::unknown;      ///< mean over the pixels of the mean error over the frames
  double flatness = io::unknown;  ///< standard deviation over the pixels of their mean error, corrected for noise
  double noise = io::unknown;     ///< root mean square over the pixels of the standard deviation between frames
  double rms = io::unknown;       ///< root mean square error of a pixel in one frame
  std::size_t pixels = 0;
};

/// Rings around the principal point, of equal width in pixels.
inline constexpr std::size_t ring_count = 5;

struct EvaluatedCondition {
  io::Condition condition;
  std::string channel;  ///< depth, range, points, or raw: decoded and converted by the camera's geometry only
  std::size_t frames = 0;
  double missing = 0;                    ///< fraction of the board's pixels without a valid value
  double predicted_noise = io::unknown;  ///< m, root mean square of the recorded sigma; NaN: not recorded
  DepthErrors all;
  std::array<DepthErrors, ring_count> rings;
};

/// Comparison of a campaign with its planes.
struct PlaneEvaluation {
  io::Campaign campaign;
  std::filesystem::path file;
  std::string serial;
  std::vector<EvaluatedCondition> conditions;
  std::vector<std::string> notes;              ///< excluded conditions, and why
  std::array<double, ring_count> ring_ends{};  ///< px from the principal point
  std::vector<double> shape;                   ///< m, per pixel: mean over the conditions of its error minus the bias
};

/// Campaign, and the one it is compared with.
struct EvaluationResult {
  PlaneEvaluation now;
  std::optional<PlaneEvaluation> before;
};

struct EvaluationRequest {
  std::filesystem::path campaign;
  std::filesystem::path before;  ///< empty: the source of the campaign, if it exists
  std::function<void(double share, const std::string& what)> progress;
};

/// Reads both campaigns. For a board whose capture has depth, range or points these are evaluated; raw samples and
/// distances are converted to depths by the camera's geometry.
/// @throws config::ConfigurationError for errors in the campaigns, captures of several devices, or no usable board
EvaluationResult evaluate_planes(const EvaluationRequest& request);

/// Errors of several conditions combined: biases as root mean square and largest magnitude, the others as root mean
/// square.
struct ErrorSummary {
  std::string name;  ///< "1 m", "0 .. 29 px", "all"
  std::size_t conditions = 0;
  double bias = io::unknown, mean_magnitude = io::unknown, largest = io::unknown;  ///< m, of the biases
  double flatness = io::unknown, noise = io::unknown, rms = io::unknown;           ///< m
};
ErrorSummary summary_of_all(const PlaneEvaluation& evaluation);
std::vector<ErrorSummary> summary_by_distance(const PlaneEvaluation& evaluation);
std::vector<ErrorSummary> summary_by_radius(const PlaneEvaluation& evaluation);

/// Summaries as lines of text, in mm.
std::string evaluation_table(const EvaluationResult& result);
nlohmann::json evaluation_json(const EvaluationResult& result);
report::Page evaluation_report(const EvaluationResult& result);

}  // namespace tofgraph::calibration
