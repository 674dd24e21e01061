// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Measured depths against the known planes of a campaign: bias, flatness and noise. SI.
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

/// Errors of the depth over some pixels, m. NaN: not known.
struct DepthErrors {
  double bias = io::unknown;      ///< mean over the pixels of their mean error over the frames
  double flatness = io::unknown;  ///< standard deviation over the pixels of their mean error, noise taken out
  double noise = io::unknown;     ///< root mean square over the pixels of the standard deviation from frame to frame
  double rms = io::unknown;       ///< root mean square error of a pixel in one frame
  std::size_t pixels = 0;
};

/// Rings around the principal point, of equal width in pixels.
inline constexpr std::size_t ring_count = 5;

struct EvaluatedCondition {
  io::Condition condition;
  std::string channel;  ///< depth, range, points, or raw: decoded and taken through the camera's geometry alone
  std::size_t frames = 0;
  double missing = 0;                    ///< share of the board's pixels without a valid value
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
  std::vector<std::string> notes;              ///< conditions left out, and why
  std::array<double, ring_count> ring_ends{};  ///< px from the principal point
  std::vector<double> shape;  ///< m, of each pixel: mean over the conditions of its error less the bias
};

/// The campaign, and the one it is compared with.
struct EvaluationResult {
  PlaneEvaluation now;
  std::optional<PlaneEvaluation> before;
};

struct EvaluationRequest {
  std::filesystem::path campaign;
  std::filesystem::path before;  ///< empty: the campaign's own source, where it is there
  std::function<void(double share, const std::string& what)> progress;
};

/// Reads both campaigns. A board whose capture has depth, range or points is judged by these; of raw samples and
/// distances the camera's geometry makes depths.
/// @throws config::ConfigurationError mistakes of the campaigns, captures of several devices, no board to judge
EvaluationResult evaluate_planes(const EvaluationRequest& request);

/// Errors of several conditions together: biases as root mean square and largest magnitude, the others as root mean
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

/// The summaries as lines of text, in mm.
std::string evaluation_table(const EvaluationResult& result);
nlohmann::json evaluation_json(const EvaluationResult& result);
report::Page evaluation_report(const EvaluationResult& result);

}  // namespace tofgraph::calibration
