// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/board_measurements.hpp"

#include "calibration/camera_identity.hpp"
#include "calibration/campaign_checks.hpp"
#include "calibration/frame_mean.hpp"
#include "config/quantity.hpp"
#include "io/light_sources.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tofgraph/physics/constants.hpp>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

namespace tofgraph::calibration {
namespace {

using config::format_quantity;

constexpr double too_noisy = 0.05;  ///< relative to the unambiguous range: above it, single frames begin to wrap

/// Reason why a condition is excluded, with a note; empty: it is used.
std::string other_purpose(const io::Condition& c, bool table, bool single_sources) {
  if (!c.has_board() || !c.scene.empty()) return "it shows no board";
  if (c.is_capped()) return "the lens is capped";
  if (!c.sources.empty() && !single_sources) return "not all sources are on";
  if (std::isfinite(c.velocity) && c.velocity != 0) return "the board moves";
  if (table && !std::isfinite(c.measured.depth) && !std::isfinite(c.measured.distance))
    return "it has neither measured_depth nor measured_distance";
  return "";
}

/// Condition that was read, or the reason for its exclusion.
struct Read {
  std::optional<Board> board;
  CameraSeen seen;
  ConditionEvidence evidence;
  UnusablePixels unusable;    ///< numbers of pixels
  std::string left_out;       ///< reason for the exclusion, for a note
  std::string mistake, hint;  ///< of the user
};

class Reader {
 public:
  Reader(const io::Campaign& campaign, io::OffsetVariant variant)
      : campaign_(campaign),
        camera_(campaign.camera->view()),
        range_(physics::unambiguous_range(camera_.modulation_frequency)),
        models_(camera_, variant, campaign.conditions),
        checks_(campaign, models_) {}

  const CampaignChecks& checks() const { return checks_; }

  Read read(std::size_t index, const ReadBoards& options) const {
    const io::Condition& condition = campaign_.conditions[index];
    Read result;
    result.evidence.condition = condition;
    MeanImages images;
    result.left_out = other_purpose(condition, campaign_.from_table, options.single_sources);
    if (!result.left_out.empty()) return result;
    const std::vector<std::size_t> window = models_.of(condition).window(condition);
    if (window.empty()) {
      result.mistake = "no pixel of the window sees the board";
      result.hint =
          "give the board its size, and a roi that lies on it, e.g. roi: {columns: [60, 143], rows: [80, 123]}";
      return result;
    }
    const std::vector<double> modelled = models_.of(condition).modelled(condition, window);
    const double farthest = *std::ranges::max_element(modelled);
    const auto wrap = std::ranges::count_if(modelled, [this](double d) { return d >= range_; });
    if (2 * static_cast<std::size_t>(wrap) >= window.size()) {
      (options.skip_wrapped ? result.left_out : result.mistake) =
          fmt::format("the board's distances reach {}, beyond the unambiguous range of {} at {}: they wrap",
                      format_quantity(farthest, "m"), format_quantity(range_, "m"),
                      format_quantity(camera_.modulation_frequency, "Hz"));
      result.hint = "remove the condition";
      return result;
    }
    if (campaign_.from_table)
      from_table(condition, result);
    else
      from_capture(condition, window, modelled, result, images);
    if (result.board) check_distance(result);
    if (result.board && !campaign_.from_table) note_evidence(images, result);
    if (result.board && options.visit) options.visit(index, *result.board, images);
    return result;
  }

 private:
  void from_table(const io::Condition& condition, Read& result) const {
    if (!std::isfinite(condition.integration_time)) {
      result.left_out = "it has no integration_time";
      return;
    }
    try {
      result.board = models_.of(condition).measure(condition);
    } catch (const std::invalid_argument& problem) {
      result.mistake = problem.what();
    }
  }

  void from_capture(const io::Condition& written, const std::vector<std::size_t>& window,
                    const std::vector<double>& modelled, Read& result, MeanImages& images) const {
    try {
      const BoardFrames frames(written, *campaign_.camera);
      const io::CaptureHeader& header = frames.header();
      const io::Condition& condition = frames.condition();
      result.seen = {header.camera, header.serial};
      if (const std::string problem = io::sources_problem(camera_, header.sources, condition.sources); !problem.empty())
        throw std::runtime_error(problem);
      ConditionEvidence& evidence = result.evidence;
      evidence.condition = condition;
      evidence.read = true;
      evidence.camera = header.camera;
      evidence.recorded_time = frames.recorded_time();
      evidence.applied = frames.applied();
      images = frames.mean(window, modelled);
      leave_out_wrapped(condition, images);
      result.unusable = images.left_out;
      if (images.noise > too_noisy * range_)
        result.left_out = fmt::format("too little light: the noise of a pixel is {} in one frame",
                                      format_quantity(images.noise, "m"));
      else if (!images.pixels.empty())
        result.board = models_.of(condition).measure(condition, images);
      else if (images.saturated > 0)
        result.left_out = "every pixel is saturated";
      else
        throw std::runtime_error(fmt::format("has no pixel in the window that can be used: of {}, {}",
                                             images.left_out.pixels, images.left_out.described()));
    } catch (const std::runtime_error& error) {
      result.mistake = capture_problem(written, error);
    }
  }

  /// Excludes pixels that differ from the others by a full range, e.g. in the corners of a far board.
  void leave_out_wrapped(const io::Condition& condition, MeanImages& images) const {
    const std::vector<double> modelled = models_.of(condition).modelled(condition, images.pixels);
    std::vector<double> difference;
    for (std::size_t i = 0; i < modelled.size(); ++i) difference.push_back(images.distance[i] - modelled[i]);
    if (difference.empty()) return;
    const double middle = physics::median(std::vector(difference));
    MeanImages kept{.noise = images.noise,
                    .frames = images.frames,
                    .saturated = images.saturated,
                    .shows_saturation = images.shows_saturation,
                    .left_out = images.left_out};
    for (std::size_t i = 0; i < difference.size(); ++i) {
      if (std::abs(difference[i] - middle) > range_ / 4) continue;
      kept.pixels.push_back(images.pixels[i]);
      kept.distance.push_back(images.distance[i]);
      if (!images.amplitude.empty()) kept.amplitude.push_back(images.amplitude[i]);
      if (!images.variance.empty()) kept.variance.push_back(images.variance[i]);
    }
    kept.left_out.wrapped = images.pixels.size() - kept.pixels.size();
    images = std::move(kept);
  }

  void check_distance(Read& result) const {
    const Board& board = *result.board;
    if (!std::isfinite(board.corrected.mean)) {
      result.mistake = fmt::format(
          "no depth fits the measured distances, {} on average: every light path from the sources by way of the board "
          "is longer",
          format_quantity(board.measured.mean, "m"));
      result.hint = "does the capture belong to this condition, and are the positions of the sources right?";
      result.board.reset();
      return;
    }
    if (!(std::abs(board.error()) > range_ / 2)) return;
    result.mistake = fmt::format(
        "the stated distance of the board is {}, but it was measured at {}: they differ by more than half the "
        "unambiguous range ({})",
        format_quantity(board.distance, "m"), format_quantity(board.corrected.mean, "m"),
        format_quantity(range_ / 2, "m"));
    result.hint =
        "is the distance right, and does the capture belong to this condition? Distances beyond the unambiguous range "
        "wrap";
    result.board.reset();
  }

  void note_evidence(const MeanImages& images, Read& result) const {
    ConditionEvidence& evidence = result.evidence;
    evidence.phasors = checks_.measured(evidence.condition, images);
    evidence.has_amplitude = !images.amplitude.empty();
    evidence.shows_saturation = images.shows_saturation;
  }

  const io::Campaign& campaign_;
  const tofgraph_camera& camera_;
  double range_;
  BoardModels models_;
  CampaignChecks checks_;
};

/// Merges repeated measurements of a condition; their scatter gives the uncertainty.
Board merged(const std::vector<Board>& same) {
  Board result = same.front();
  if (same.size() == 1) return result;
  const auto mean = [&](auto member) {
    double sum = 0;
    for (const Board& board : same) sum += member(board) / static_cast<double>(same.size());
    return sum;
  };
  std::vector<double> depths;
  for (const Board& board : same) depths.push_back(board.corrected.mean);
  for (Moments Board::*moments : {&Board::modelled, &Board::measured, &Board::corrected, &Board::remodelled,
                                  &Board::offset, &Board::offset_corrected, &Board::final}) {
    (result.*moments).mean = mean([&](const Board& b) { return (b.*moments).mean; });
    (result.*moments).sd = mean([&](const Board& b) { return (b.*moments).sd; });
  }
  for (double Board::*value : {&Board::rmse, &Board::noise, &Board::amplitude, &Board::reflectivity, &Board::saturated})
    result.*value = mean([&](const Board& b) { return b.*value; });
  // fmax: the scatter alone if the spread of the pixels is unknown.
  result.depth_sd = std::fmax(mean([](const Board& b) { return b.depth_sd; }), moments_of(depths).sd) /
                    std::sqrt(static_cast<double>(same.size()));
  result.frames = 0;
  for (const Board& board : same) result.frames += board.frames;
  return result;
}

void merge_repeats(Boards& all) {
  std::map<std::tuple<std::size_t, double, double>, std::vector<Board>> groups;
  for (Board& board : all.boards) {
    const std::tuple key(all.target_of(board), board.distance, board.condition.integration_time);
    groups[key].push_back(std::move(board));
  }
  all.boards.clear();
  for (const auto& [key, same] : groups) {
    all.boards.push_back(merged(same));
    all.repeats += same.size() - 1;
    if (same.size() < 2) continue;
    std::string ids = same.front().condition.id;
    for (std::size_t i = 1; i < same.size(); ++i) ids += ", " + same[i].condition.id;
    all.notes.push_back(fmt::format("{}: the same target, distance and integration time: merged", ids));
  }
}

/// Detects a wrong unit of all distances: they increase at a different rate than the measured ones.
void check_unit(const io::Campaign& campaign, const std::vector<Board>& boards, config::Diagnostics& diagnostics) {
  if (boards.size() < 3) return;
  const auto [near, far] = std::ranges::minmax_element(boards, {}, &Board::distance);
  std::vector<double> rates;
  for (const Board& a : boards)
    for (const Board& b : boards)
      if (b.distance > a.distance) rates.push_back((b.measured.mean - a.measured.mean) / (b.distance - a.distance));
  if (rates.empty()) return;
  const double rate = physics::median(std::move(rates));
  constexpr double large = 2;  // beyond any camera's scale error
  if (!(rate > large) && !(rate < 1 / large)) return;
  diagnostics.error(
      place_of(campaign.conditions.front()),
      fmt::format("the stated distances of the boards are {} to {}, but they were measured at {} to {}: each metre "
                  "counts {:.2g} times",
                  format_quantity(near->distance, "m"), format_quantity(far->distance, "m"),
                  format_quantity(near->measured.mean, "m"), format_quantity(far->measured.mean, "m"), rate),
      "is the unit of the distances right? 1 cm = 10 mm");
}

/// Adds a note for all conditions with pixels that wrap.
void note_wrapped(const io::Campaign& campaign, const std::vector<Read>& read, Boards& all) {
  const auto share_of = [](const Read& r) {
    return static_cast<double>(r.unusable.wrapped) / static_cast<double>(std::max<std::size_t>(r.unusable.pixels, 1));
  };
  const auto count = std::ranges::count_if(read, [&](const Read& r) { return r.unusable.wrapped > 0; });
  if (count == 0) return;
  const auto worst = std::ranges::max_element(read, {}, share_of);
  all.notes.push_back(
      fmt::format("{} condition{} pixels that wrap, which are excluded: most of them in {} ({:.2g} % of its pixels)",
                  count, count == 1 ? " has" : "s have",
                  campaign.conditions[static_cast<std::size_t>(worst - read.begin())].id, 100 * share_of(*worst)));
}

/// Adds a note for all conditions with pixels excluded before averaging. Saturation is reported with each board.
void note_unusable(const io::Campaign& campaign, const std::vector<Read>& read, Boards& all) {
  const auto count_of = [](const Read& r) { return r.unusable.total() - r.unusable.saturated - r.unusable.wrapped; };
  const auto worst = std::ranges::max_element(read, {}, count_of);
  if (worst == read.end() || count_of(*worst) == 0) return;
  const auto affected = std::ranges::count_if(read, [&](const Read& r) { return count_of(r) > 0; });
  all.notes.push_back(
      fmt::format("{} of {} conditions have pixels that were excluded before averaging; {} most of them, {} of {}: {}",
                  affected, read.size(), campaign.conditions[static_cast<std::size_t>(worst - read.begin())].id,
                  worst->unusable.total(), worst->unusable.pixels, worst->unusable.described()));
}

}  // namespace

std::size_t Boards::target_of(const Board& board) const {
  return static_cast<std::size_t>(std::ranges::find(targets, board.condition.target) - targets.begin());
}

Boards read_boards(const io::Campaign& campaign, io::OffsetVariant variant, const ReadBoards& options) {
  const Reader reader(campaign, variant);
  const std::size_t n = campaign.conditions.size();
  std::vector<Read> read(n);
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
    read[i] = reader.read(i, options);
    if (options.progress) options.progress(static_cast<double>(++done) / static_cast<double>(n));
  });
  Boards all{.conditions = n};
  config::Diagnostics diagnostics;
  std::vector<CameraSeen> seen;
  for (const Read& r : read) seen.push_back(r.seen);
  all.serial = check_one_camera(campaign, seen, all.notes, diagnostics);
  for (std::size_t i = 0; i < n; ++i) {
    const io::Condition& c = campaign.conditions[i];
    if (!read[i].mistake.empty()) diagnostics.error(place_of(c), read[i].mistake, read[i].hint);
    if (!read[i].left_out.empty()) all.notes.push_back(fmt::format("{}: excluded: {}", c.id, read[i].left_out));
    if (!read[i].board) continue;
    all.unusable += read[i].unusable;
    if (std::ranges::find(all.targets, c.target) == all.targets.end()) all.targets.push_back(c.target);
    all.boards.push_back(std::move(*read[i].board));
  }
  std::vector<ConditionEvidence> evidence;
  for (Read& r : read) evidence.push_back(std::move(r.evidence));
  if (diagnostics.ok()) check_unit(campaign, all.boards, diagnostics);
  if (diagnostics.ok()) reader.checks().check(evidence, all.notes, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  for (const char* stage : {"model_correction", "offset_correction"}) {
    if (corrected_by(campaign, evidence, stage).empty()) continue;
    all.applied.emplace_back(stage);
    all.notes.push_back(
        fmt::format("the captures' distances have {} applied: errors that it corrected are not part of the result, and "
                    "a pipeline needs it as well",
                    stage));
  }
  note_wrapped(campaign, read, all);
  note_unusable(campaign, read, all);
  all.falloff = fit_falloff(all.boards);
  for (Board& b : all.boards) b.reflectivity *= std::exp(-all.falloff[0] * b.falloff.q - all.falloff[1] * b.falloff.q2);
  if (options.repeats == Repeats::merged) merge_repeats(all);
  return all;
}

}  // namespace tofgraph::calibration
