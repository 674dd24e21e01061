// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Lens from views of a pattern: calibration file and summary.
#include "calibration/intrinsics.hpp"

#include "calibration/campaign_inputs.hpp"
#include "config/quantity.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Core>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::calibration {
namespace {

[[noreturn]] void refuse(const Request& request, const std::string& problem) {
  throw config::ConfigurationError(fmt::format("{}: error: {}", request.campaign.string(), problem));
}

LensOptions options_of(const Request& request) {
  const auto has = [](const std::vector<std::string>& list, const char* word) {
    return std::ranges::find(list, word) != list.end();
  };
  return {.k3 = has(request.free, "k3"),
          .skew = has(request.free, "skew"),
          .rational = has(request.free, "rational"),
          .warp = !has(request.without, "warp"),
          .distances = !has(request.without, "distances")};
}

/// Fits the lens to corners, looks up the board distances with it, then fits the lens to both.
void solve(const Request& request, Intrinsics& result) {
  Observations& observations = result.views.observations;
  LensOptions corners = result.options;
  corners.distances = false;
  result.alone = result.solution = solve_lens(observations, corners);
  if (!result.options.distances || !observations.light) return;
  for (const SolvedView& view : result.alone.views)
    observations.views[view.view].distances =
        board_distances(result.views.images[view.view], result.views, result.alone.lens, view.pose);
  if (request.progress) request.progress(0.6, "fitting with the distances");
  result.joint = solve_lens(observations, result.options);
  if (!result.joint.with_distances) return;
  result.distances = check_distances(result.alone, result.joint);
  if (result.distances.fit())
    result.solution = result.joint;
  else
    result.options.distances = false;  // the validation then uses corners only
}

void judge(const Request& request, Intrinsics& result) {
  const Observations& observations = result.views.observations;
  const auto progress = [&](double share) {
    if (request.progress) request.progress(share, "judging on views left out");
  };
  progress(0.7);
  result.halves = compare_halves(observations, result.options, result.solution);
  progress(0.8);
  result.held_out = predict_left_out(observations, result.options, result.solution);
  result.lens = lens_structure(observations, result.solution);
  result.board = board_structure(observations, result.solution);
  progress(0.9);
  result.next = suggest_view(observations, result.solution);
}

/// Median standard deviation of a corner coordinate, px, from the fits to its pixels.
double corner_sd(const Intrinsics& result) {
  std::vector<double> variances;
  for (const SolvedView& view : result.solution.views)
    for (const Corner& corner : result.views.observations.views[view.view].corners)
      variances.push_back((corner.covariance[0] + corner.covariance[2]) / 2);
  return std::sqrt(physics::median(variances));
}

void write_lens(const Intrinsics& result, io::CalibrationWriter& writer) {
  const LensSolution& s = result.solution;
  const auto write = [&](const char* key, std::initializer_list<std::size_t> parameters, const char* unit) {
    io::Calibrated values;
    for (const std::size_t p : parameters) {
      values.value.push_back(s.lens[p]);
      values.sd.push_back(s.sd(p));
    }
    writer.numbers(key, values, unit, 1);
  };
  write("focal_length", {lens::fx, lens::fy}, "px");
  write("principal_point", {lens::cx, lens::cy}, "px");
  if (result.views.observations.fisheye)
    write("fisheye", {lens::k1, lens::k2, lens::k3, lens::k4}, "");
  else
    write("distortion", {lens::k1, lens::k2, lens::p1, lens::p2, lens::k3}, "");
  if (result.options.rational) write("rational", {lens::k4, lens::k5, lens::k6}, "");
  if (result.options.skew) writer.number("skew", s.lens[lens::skew], s.sd(lens::skew), "", 1);
  io::Calibrated warp;
  for (std::size_t i = 0; i < s.layout.warp; ++i) {
    const auto at = static_cast<Eigen::Index>(s.layout.lens.size() + i);
    warp.value.push_back(s.warp[i]);
    warp.sd.push_back(std::sqrt(s.covariance(at, at)));
  }
  if (!warp.value.empty()) writer.column("board_warp", warp, "mm", 1e-3);
  if (!s.with_distances) return;
  const auto at = static_cast<Eigen::Index>(s.layout.lens.size() + s.layout.warp);
  writer.column("range_offset", {{s.range_offset}, {std::sqrt(s.covariance(at, at))}}, "mm", 1e-3);
  writer.column("range_scale", {{s.range_scale}, {std::sqrt(s.covariance(at + 1, at + 1))}}, "", 1);
}

/// Projection uncertainty, px: at the image centre, mean over the image, maximum.
std::array<double, 3> uncertainty_of(const Intrinsics& result, double range) {
  const auto width = static_cast<double>(result.views.observations.width);
  const auto height = static_cast<double>(result.views.observations.height);
  const ProjectionUncertainty uncertainty(result.solution);
  double sum = 0, count = 0, max = 0;
  for (int i = 0; i < 9; ++i) {
    for (int k = 0; k < 9; ++k) {
      const double sd = uncertainty.at((width - 1) * i / 8, (height - 1) * k / 8, range);
      if (!std::isfinite(sd)) continue;
      sum += sd;
      count += 1;
      max = std::max(max, sd);
    }
  }
  return {uncertainty.at((width - 1) / 2, (height - 1) / 2, range), sum / std::max(count, 1.0), max};
}

void write_judgement(const Intrinsics& result, io::CalibrationWriter& writer) {
  const LensSolution& s = result.solution;
  writer.column("corner_sd", {{corner_sd(result)}, {}}, "px", 1);
  writer.column("variance_factor", {{s.variance_factor}, {}}, "", 1);
  writer.column("reprojection", {{s.rms}, {}}, "px", 1);
  if (result.held_out.done)
    writer.column("held_out_views", {{result.held_out.rms, result.held_out.low, result.held_out.high}, {}}, "px", 1);
  if (result.halves.done) writer.column("two_sets", {{result.halves.difference, result.halves.predicted}, {}}, "px", 1);
  io::Calibrated range, centre, mean, max;
  for (const double factor : {0.5, 0.75, 1.0, 1.5, 2.0, 4.0}) {
    range.value.push_back(factor * typical_range(s));
    const auto [c, a, m] = uncertainty_of(result, range.value.back());
    centre.value.push_back(c);
    mean.value.push_back(a);
    max.value.push_back(m);
  }
  writer.column("uncertainty_range", range, "mm", 1e-3);
  writer.column("uncertainty_centre", centre, "px", 1);
  writer.column("uncertainty_mean", mean, "px", 1);
  writer.column("uncertainty_max", max, "px", 1);
}

void write_views(const Intrinsics& result, io::CalibrationWriter& writer) {
  io::Calibrated rms, rotation, translation;
  std::vector<std::string> ids;
  for (const SolvedView& view : result.solution.views) {
    ids.push_back(config::yaml_word(result.views.observations.views[view.view].id));
    rms.value.push_back(view.rms);
    const auto& r = view.pose.rotation;
    const double angle = std::acos(std::clamp((r[0] + r[4] + r[8] - 1) / 2, -1.0, 1.0));
    const double scale = angle > 1e-9 ? angle / (2 * std::sin(angle)) : 0.5;
    rotation.value.insert(rotation.value.end(), {scale * (r[7] - r[5]), scale * (r[2] - r[6]), scale * (r[3] - r[1])});
    translation.value.insert(translation.value.end(), view.pose.translation.begin(), view.pose.translation.end());
  }
  writer.setting("views", fmt::format("[{}]", fmt::join(ids, ", ")));
  writer.column("view_reprojection", rms, "px", 1);
  writer.column("view_rotation", rotation, "rad", 1);
  writer.column("view_translation", translation, "mm", 1e-3);
}

std::vector<std::string> summary_of(const Intrinsics& result, std::size_t conditions) {
  const LensSolution& s = result.solution;
  const auto with_sd = [&](std::size_t p, int digits) {
    return fmt::format("{:.{}f} +- {:.{}f}", s.lens[p], digits, s.sd(p), digits);
  };
  std::vector<std::string> lines = {
      fmt::format("{} of {} views used; residuals of {:.3f} px a coordinate (corners located to {:.3f} px)",
                  s.views.size(), conditions, s.rms, corner_sd(result)),
      fmt::format("focal length {} x {} px, principal point {}, {} px", with_sd(lens::fx, 2), with_sd(lens::fy, 2),
                  with_sd(lens::cx, 2), with_sd(lens::cy, 2)),
      result.views.observations.fisheye
          ? fmt::format("fisheye: k1 {}, k2 {}, k3 {}, k4 {}", with_sd(lens::k1, 4), with_sd(lens::k2, 4),
                        with_sd(lens::k3, 4), with_sd(lens::k4, 4))
          : fmt::format("k1 {}, k2 {}, p1 {}, p2 {}", with_sd(lens::k1, 4), with_sd(lens::k2, 4), with_sd(lens::p1, 5),
                        with_sd(lens::p2, 5))};
  if (s.with_distances)
    lines.push_back(
        fmt::format("with the board's measured distances (from corners alone fx +- {:.2f} px): they are {:.1f} "
                    "mm too long, {:+.2f} %",
                    result.alone.sd(lens::fx), s.range_offset * 1e3, s.range_scale * 100));
  else if (result.distances.done)
    lines.push_back("from corners alone: the board's measured distances do not fit them and are not used");
  const double range = typical_range(s);
  const auto [centre, mean, max] = uncertainty_of(result, range);
  lines.push_back(
      fmt::format("projection at {} known to {:.3f} px in the middle, {:.3f} px on the average, {:.3f} px at "
                  "worst",
                  config::format_quantity(std::round(range * 1e3) / 1e3, "m"), centre, mean, max));
  if (result.held_out.done)
    lines.push_back(
        fmt::format("views left out are predicted to {:.3f} px (95 %: {:.3f} to {:.3f} px; {:.3f} px where they "
                    "were fitted)",
                    result.held_out.rms, result.held_out.low, result.held_out.high, result.held_out.fitted));
  if (result.halves.done)
    lines.push_back(fmt::format("two halves of the views differ by {:.3f} px, predicted {:.3f} px: {}",
                                result.halves.difference, result.halves.predicted,
                                result.halves.agree() ? "they agree" : "they do not agree"));
  if (result.next.found)
    lines.push_back(fmt::format(
        "the next view that helps most: the board's middle at ({:.0f}, {:.0f}) px, {} away, tilted "
        "by {:.0f} deg about x and {:.0f} deg about y: {:.3f} px become {:.3f} px",
        result.next.pixel[0], result.next.pixel[1],
        config::format_quantity(std::round(result.next.centre[2] * 100) / 100, "m"), result.next.tilt[0] * 180 / M_PI,
        result.next.tilt[1] * 180 / M_PI, result.next.before, result.next.after));
  return lines;
}

std::string square_of(const Intrinsics& result) {
  return square_problem(result.alone, result.views.observations, result.views.pattern.square);
}

void add_distance_notes(const Intrinsics& result, std::vector<std::string>& notes) {
  if (!result.distances.done) return;
  if (!result.distances.fit())
    notes.push_back(fmt::format("the measured distances do not fit the corners ({}): they are not used",
                                result.distances.reason()));
  const std::string square = square_of(result);
  if (!square.empty()) notes.push_back(square);
}

/// Parameters that the views do not determine.
std::vector<std::string> undetermined(const LensSolution& s) {
  std::vector<std::string> names;
  const auto n = static_cast<Eigen::Index>(s.layout.lens.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t p = s.layout.lens[static_cast<std::size_t>(i)];
    double correlation = 0;
    for (Eigen::Index k = 0; k < n; ++k)
      if (k != i)
        correlation =
            std::max(correlation, std::abs(s.covariance(i, k)) / std::sqrt(s.covariance(i, i) * s.covariance(k, k)));
    const bool unknown = s.sd(p) > std::abs(s.lens[p]) && correlation > 0.999;
    const bool denominator = p >= lens::k4 && s.lens[lens::fisheye] == 0;
    if (unknown || (denominator && s.sd(p) > 10)) names.emplace_back(lens::names[p]);
  }
  return names;
}

bool scattered(const LensSolution& s) { return s.variance_factor > 4; }

void add_fit_notes(const Intrinsics& result, std::vector<std::string>& notes) {
  if (const std::vector<std::string> names = undetermined(result.solution); !names.empty())
    notes.push_back(fmt::format("not determined by these views: {}; free less, or take views up to the image's corners",
                                fmt::join(names, ", ")));
  if (scattered(result.solution))
    notes.push_back(fmt::format("the corners scatter more than the noise of the pixels explains: by a factor of {:.1f}",
                                std::sqrt(result.solution.variance_factor)));
}

/// Returns true if the lens needs a warning; the notes give the reason.
bool doubtful(const Intrinsics& result) {
  const bool judged = result.halves.done && result.halves.agree() && result.held_out.done;
  const bool distances = !result.distances.done || (result.distances.fit() && square_of(result).empty());
  return !judged || !distances || result.lens.found || result.board.found || !result.solution.doubtful.empty() ||
         scattered(result.solution) || !undetermined(result.solution).empty();
}

std::vector<std::string> notes_of(const Intrinsics& result) {
  std::vector<std::string> notes;  // most serious first: only a few are printed
  if (result.lens.found)
    notes.push_back(
        fmt::format("the lens is not of the fitted model: the residuals have a pattern of {:.3f} px; {}{}",
                    result.lens.size, result.lens.explanation,
                    result.views.observations.fisheye
                        ? ""
                        : "; try --free k3, --free rational or, for a wide angle, lens: fisheye in the profile"));
  notes.insert(notes.end(), result.views.notes.begin(), result.views.notes.end());
  for (const SkippedView& skipped : result.views.skipped)
    notes.push_back(fmt::format("{}: not used: {}", skipped.id, skipped.reason));
  for (const LeftOut& out : result.solution.left_out)
    notes.push_back(fmt::format("{}: left out: {}", result.views.observations.views[out.view].id, out.reason));
  for (const LeftOut& kept : result.solution.doubtful)
    notes.push_back(fmt::format("{}: used, because {} views are needed, but {}",
                                result.views.observations.views[kept.view].id, min_views, kept.reason));
  add_distance_notes(result, notes);
  add_fit_notes(result, notes);
  if (result.board.found)
    notes.push_back(
        fmt::format("the board is bent otherwise than fitted: the residuals have a pattern of {:.3f} px that "
                    "moves with the board; {}",
                    result.board.size, result.board.explanation));
  if (result.halves.done && !result.halves.agree())
    notes.emplace_back(
        "two halves of the views give lenses that differ by more than their uncertainties: something "
        "moved, or the lens is not of the fitted model");
  if (!result.halves.done)
    notes.push_back(result.solution.views.size() < 2 * min_views
                        ? fmt::format("too few views to compare two halves: {} would do", 2 * min_views)
                        : "half of the views does not determine a lens: two halves could not be compared");
  if (!result.held_out.done)
    notes.emplace_back("too few views to leave some out: how the lens predicts others could not be judged");
  if (result.solution.sd(lens::fx) > 0.01 * result.solution.lens[lens::fx])
    notes.push_back(fmt::format("the focal length is known to {:.1f} % only: tilt the board more, by 20 to 40 deg",
                                100 * result.solution.sd(lens::fx) / result.solution.lens[lens::fx]));
  return notes;
}

/// Errors on held-out views, for the lens of the profile and for lenses fitted without these views.
std::optional<HeldOutErrors> held_out_of(const Intrinsics& result) {
  if (!result.held_out.done) return std::nullopt;
  return HeldOutErrors{.left_out = "some views at a time",
                       .before = result.held_out.nominal,
                       .after = result.held_out.rms,
                       .unit = "px",
                       .scale = 1,
                       .causes = "too few or too similar views, a pattern of another size than stated",
                       .tolerance = 0.05};  // accepted if up to 5 % worse, since it adds uncertainties
}

}  // namespace

std::array<double, 2> tilts_of(const Pose& pose) {
  // R = R_y R_x from the board normal, as scenes tilt boards
  const double x = pose.rotation[2], y = pose.rotation[5], z = pose.rotation[8];
  const double sign = z < 0 ? -1 : 1;
  return {std::asin(std::clamp(-sign * y, -1.0, 1.0)), std::atan2(sign * x, sign * z)};
}

Result calibrate_intrinsics(const Request& request) {
  const io::Campaign campaign = read_conditions(request);
  if (campaign.from_table)
    refuse(request, "a table holds statistics, a lens shows in images\n  give conditions with captures");
  if (!campaign.pattern)
    refuse(request,
           "the campaign does not say what was looked at\n  example: pattern: {type: chessboard, columns: 8, rows: 6, "
           "square: 30 mm}");
  const auto progress = [&](double share) {
    if (request.progress) request.progress(0.5 * share, "looking for the pattern");
  };
  Intrinsics result{.views = read_lens_views(campaign, progress), .options = options_of(request)};
  if (result.views.observations.fisheye && (result.options.k3 || result.options.rational))
    refuse(request,
           fmt::format("--free k3 and --free rational are of OpenCV's perspective model; the profile '{}' says "
                       "lens: fisheye, whose k1 to k4 are fitted as it is",
                       campaign.camera->view().name));
  try {
    solve(request, result);
  } catch (const std::runtime_error& problem) {
    refuse(request, problem.what());
  }
  judge(request, result);
  io::CalibrationWriter writer = writer_for(request, campaign, result.views.serial, "intrinsics");
  write_lens(result, writer);
  write_judgement(result, writer);
  write_views(result, writer);
  const std::vector<std::string> lines = summary_of(result, campaign.conditions.size());
  return {.file = writer.text(),
          .page = intrinsics_report(campaign.camera->view().name, result, sentence_of({lines[0], lines[1]}),
                                    doubtful(result) ? "warn" : "good", lines),
          .summary = fmt::format("{}", fmt::join(lines, "\n")),
          .notes = notes_of(result),
          .held_out = held_out_of(result)};
}

}  // namespace tofgraph::calibration
