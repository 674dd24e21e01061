// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/data/ingest.hpp"

#include "diagnosis/data/superpixels.hpp"
#include "io/captures/campaign_captures.hpp"
#include "io/captures/condition_statistics.hpp"
#include "io/serial.hpp"
#include "io/sha256.hpp"
#include "simulation/files/pose.hpp"
#include "simulation/simulation.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tofgraph/physics/exposures.hpp>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <numeric>
#include <set>

namespace tofgraph::diagnosis {

namespace {

/// Reason why the search cannot use a condition; empty if it can.
std::string problem_of(const io::Condition& c) {
  if (!c.is_capped() && (!c.has_board() || !c.scene.empty())) return "it shows no single board";
  return "";
}

/// Result of reading one condition, or the reason why it could not be read.
struct Read {
  io::Condition condition;
  std::string serial;
  Observations observations;
  ReductionCounts counts;
  double recorded_time = io::unknown;  ///< s
  std::size_t saturated = 0, frames = 0;
  FrameSums::Kind kind = FrameSums::Kind::phases;
  std::string why_not;  ///< reason why it cannot be used; empty if it can
};

class Reader {
 public:
  Reader(const io::Campaign& campaign, const IngestOptions& options)
      : profile_(*campaign.camera),
        camera_(campaign.camera->view()),
        ideal_(camera_, options.physical, {}),
        demodulation_(physics::exposures_of(camera_)),
        pixels_(simulation::whole_image(camera_)),
        edge_(pixels_.size(), false) {
    const auto place = [this](std::size_t i) { return superpixel_of(i, pixels_.rows, pixels_.columns, grid); };
    std::vector<bool> partly_outside(grid * grid, false);
    for (std::size_t i = 0; i < edge_.size(); ++i)
      if (std::isnan(pixels_.rays[i].z)) partly_outside[place(i)] = true;
    for (std::size_t i = 0; i < edge_.size(); ++i) edge_[i] = partly_outside[place(i)];
  }

  PixelPhases no_phases() const { return PixelPhases(pixels_.size()); }

  /// Completes a condition from its capture, without reading frames.
  Read settings(const io::Condition& written) const {
    Read result;
    result.condition = written;
    io::complete(result.condition, io::read_facts(written), camera_);
    return result;
  }

  /// @param own, found as in reduce()
  Read read(const io::Condition& written, const PixelPhases* own, PixelPhases* found) const {
    Read result;
    result.condition = written;
    io::Condition& condition = result.condition;
    const ConditionFrames frames = read_frames(condition, profile_);
    const FrameSums& sums = frames.sums;
    result.serial = frames.facts.header.serial;
    io::complete(condition, frames.facts, camera_);
    result.recorded_time = frames.facts.first.integration_time;
    const double scale = physics::metres_per_radian(camera_.modulation_frequency);
    if (condition.is_capped() && sums.kind() == FrameSums::Kind::distances) {
      result.why_not = "its lens is capped: distances without amplitudes hold no information there";
      return result;
    }
    const std::vector<Signal> base = ideal(condition);
    const io::Roi part = condition.roi.value_or(io::Roi{0, camera_.width - 1, 0, camera_.height - 1});
    const std::array<std::size_t, 4> roi = {part.first_column, part.last_column, part.first_row, part.last_row};
    result.observations =
        reduce(sums, base, grid, {camera_.read_noise, camera_.shot_noise}, scale, roi, result.counts,
               condition.is_capped() ? nullptr : own, condition.is_capped() ? nullptr : found, condition.is_capped());
    result.saturated = sums.saturated(roi);
    result.frames = sums.frames();
    result.kind = sums.kind();
    return result;
  }

 private:
  std::vector<Signal> ideal(const io::Condition& condition) const {
    const io::Condition board = condition.is_capped() ? stand_in(condition, camera_) : condition;
    const auto tracer = simulation::board_tracer(camera_.focal_length, pose_of(board));
    const auto expected = ideal_.expect(tracer, simulation::acquisition_of(camera_, board), pixels_);
    const auto& taps = expected.taps;
    std::vector<Signal> signals;
    signals.reserve(pixels_.size());
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      signals.push_back(demodulation_.of_taps(&taps[i], pixels_.size()));
      // The centre of a superpixel that is partly outside the lens model does not represent it.
      if (edge_[i]) signals.back() = {};
    }
    if (condition.board_size && !condition.is_capped()) {
      const std::vector<bool> seen = on_board(condition, expected.hits, camera_.width);
      for (std::size_t i = 0; i < signals.size(); ++i) {
        if (!seen[i]) signals[i] = {};
      }
    }
    return signals;
  }

  const io::Camera& profile_;
  const tofgraph_camera& camera_;
  simulation::ForwardModel ideal_;
  Demodulation demodulation_;
  simulation::Pixels pixels_;
  std::vector<bool> edge_;  ///< pixels of superpixels that are partly outside the lens model
};

/// Serial number of the device that recorded the captures; empty if not recorded.
/// @throws config::ConfigurationError for captures of several devices
std::string serial_of(const io::Campaign& campaign, const std::vector<Read>& read) {
  std::vector<std::string> serials;
  for (const Read& one : read) serials.push_back(one.serial);
  config::Diagnostics diagnostics;
  std::string serial = io::common_serial(campaign, serials, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return serial;
}

/// Measurements of the usable conditions. @param why reason why a condition is unusable, or empty; one per condition
/// @param searched those to be searched, ascending
Measurements together(const io::Campaign& campaign, bool physical, std::vector<Read> read,
                      const std::vector<std::string>& why, const std::vector<std::size_t>& searched) {
  Measurements result;
  std::vector<io::Condition> used;
  std::vector<double> noise;  // ratios of measured to profile noise, one per condition
  std::size_t pixels = 0, bad = 0, saturated = 0, single = 0;
  for (std::size_t i = 0; i < read.size(); ++i) {
    if (!why[i].empty()) {
      result.left_out.push_back(fmt::format("{}: {}", campaign.conditions[i].id, why[i]));
      continue;
    }
    if (std::ranges::binary_search(searched, i)) result.searched.push_back(used.size());
    Read& r = read[i];
    used.push_back(std::move(r.condition));
    result.observations.push_back(std::move(r.observations));
    result.recorded_times.push_back(r.recorded_time);
    result.frames += r.frames;
    pixels += r.counts.pixels;
    bad += r.counts.bad;
    if (r.counts.compared > 0) noise.push_back(std::sqrt(r.counts.noise / static_cast<double>(r.counts.compared)));
    saturated += r.saturated;
    single += r.frames < 2 ? 1U : 0U;
    result.taps |= r.kind == FrameSums::Kind::taps;
    result.phases |= r.kind == FrameSums::Kind::phases;
    result.decoded |= r.kind == FrameSums::Kind::decoded;
  }
  const auto boards = std::ranges::count_if(result.searched, [&](std::size_t i) { return !used[i].is_capped(); });
  if (result.searched.size() < used.size() && boards < static_cast<std::ptrdiff_t>(settings.min_conditions))
    throw std::invalid_argument(
        fmt::format("the {} conditions to be searched show {} boards, and a search needs {} at least: a larger "
                    "--max-conditions searches more",
                    result.searched.size(), boards, settings.min_conditions));
  require_enough(static_cast<std::size_t>(boards), result.left_out);
  if (!noise.empty()) {
    const auto [least, most] = std::ranges::minmax(noise);
    result.noise = {physics::median(noise), least, most};
  }
  result.bad_pixels = static_cast<double>(bad) / static_cast<double>(std::max<std::size_t>(pixels, 1));
  result.saturated = static_cast<double>(saturated) / static_cast<double>(std::max<std::size_t>(pixels, 1));
  result.replicates = single == 0;
  result.design = std::make_shared<const Design>(campaign.camera, physical, std::move(used), grid, campaign.jitter);
  return result;
}

/// Reads the conditions of a campaign.
class Conditions {
 public:
  /// @param campaign this and the options must outlive this object
  Conditions(const io::Campaign& campaign, const IngestOptions& options)
      : campaign_(campaign),
        options_(options),
        reader_(campaign, options),
        read_(campaign.conditions.size()),
        why_(read_.size()),
        missing_(read_.size(), 0),
        is_read_(read_.size(), 0) {}

  Measurements measured() {
    const std::vector<std::size_t> searched = to_be_searched();
    const PixelPhases phases = phases_of(searched);
    const PixelPhases* const own = phases.stand_out() ? &phases : nullptr;
    tbb::parallel_for(std::size_t{0}, read_.size(), [&](std::size_t i) {
      if (own != nullptr || is_read_[i] == 0) read(i, own, nullptr);
    });
    for (std::size_t i = 0; i < read_.size(); ++i) {
      if (missing_[i] != 0 && !options_.skip_missing)
        throw std::runtime_error(fmt::format("condition '{}': {}\n         --skip-missing continues without it",
                                             campaign_.conditions[i].id, why_[i]));
    }
    std::string serial = serial_of(campaign_, read_);
    Measurements result = together(campaign_, options_.physical, std::move(read_), why_, searched);
    result.serial = std::move(serial);
    return result;
  }

 private:
  /// Calls a function that reads a condition; sets the reason why the condition is unusable, if it is.
  void attempt(std::size_t i, const auto& function) {
    const io::Condition& condition = campaign_.conditions[i];
    why_[i] = problem_of(condition);
    missing_[i] = 0;
    if (!why_[i].empty()) return;
    try {
      read_[i] = function(condition);
      why_[i] = read_[i].why_not;
    } catch (const std::runtime_error& error) {
      const std::string file = condition.capture.string(), what = error.what();  // may begin with the file's name
      why_[i] = fmt::format("the capture {}", what.starts_with(file) ? what : file + " " + what);
      missing_[i] = 1;
    }
  }

  /// @param own, found as in reduce()
  void read(std::size_t i, const PixelPhases* own, PixelPhases* found) {
    attempt(i, [&](const io::Condition& condition) { return reader_.read(condition, own, found); });
    const auto known = [](double variance) { return std::isfinite(variance); };
    if (why_[i].empty() && std::ranges::none_of(read_[i].observations.variance, known))
      why_[i] = "no pixel can be used: all are off the board, outside the roi, saturated, or too dark";
    if (is_read_[i] == 0) ++done_;
    is_read_[i] = 1;
    if (options_.progress) options_.progress(static_cast<double>(done_) / static_cast<double>(read_.size()));
  }

  PixelPhases phases_of(const std::vector<std::size_t>& chosen) {
    return tbb::parallel_deterministic_reduce(
        tbb::blocked_range<std::size_t>(0, chosen.size()), reader_.no_phases(),
        [&](const tbb::blocked_range<std::size_t>& some, PixelPhases sum) {
          for (std::size_t k = some.begin(); k < some.end(); ++k) read(chosen[k], nullptr, &sum);
          return sum;
        },
        [](PixelPhases one, const PixelPhases& other) { return one += other; });
  }

  /// Indices of all conditions, or of usable ones that represent a larger campaign. Of a larger one, only the settings
  /// are read first; those chosen are then read, and if some turn out unusable, others are chosen.
  std::vector<std::size_t> to_be_searched() {
    std::vector<std::size_t> usable(read_.size());
    std::iota(usable.begin(), usable.end(), std::size_t{0});
    if (usable.size() <= options_.max_conditions) return usable;
    tbb::parallel_for(std::size_t{0}, read_.size(), [&](std::size_t i) {
      attempt(i, [&](const io::Condition& condition) { return reader_.settings(condition); });
      if (options_.progress) options_.progress(0);
    });
    while (true) {
      std::erase_if(usable, [&](std::size_t i) { return !why_[i].empty(); });
      std::vector<io::Condition> conditions;
      for (const std::size_t i : usable) conditions.push_back(read_[i].condition);
      std::vector<std::size_t> chosen = picked(usable, representative_conditions(conditions, options_.max_conditions));
      std::vector<std::size_t> unread;
      std::ranges::copy_if(chosen, std::back_inserter(unread), [&](std::size_t i) { return is_read_[i] == 0; });
      if (unread.empty()) return chosen;
      tbb::parallel_for(std::size_t{0}, unread.size(), [&](std::size_t k) { read(unread[k], nullptr, nullptr); });
    }
  }

  const io::Campaign& campaign_;
  const IngestOptions& options_;
  const Reader reader_;
  std::vector<Read> read_;
  std::vector<std::string> why_;  ///< reason why a condition is unusable, or empty
  std::vector<std::uint8_t> missing_, is_read_;
  std::atomic<std::size_t> done_ = 0;
};

}  // namespace

Measurements measure(const io::Campaign& campaign, const IngestOptions& options) {
  return Conditions(campaign, options).measured();
}

Measurements part(const Measurements& whole, std::span<const std::size_t> chosen) {
  Measurements some = whole;
  some.design = std::make_shared<const Design>(whole.design->part(chosen));
  some.observations = picked(whole.observations, chosen);
  some.recorded_times = picked(whole.recorded_times, chosen);
  some.searched.resize(chosen.size());
  std::iota(some.searched.begin(), some.searched.end(), std::size_t{0});
  return some;
}

std::vector<bool> on_board(const io::Condition& condition, std::span<const simulation::Hit> hits, std::size_t width) {
  const auto& size = *condition.board_size;
  const auto axes = simulation::rotation(condition.board_tilt_x, condition.board_tilt_y, 0);
  const auto roll = simulation::rotation(0, 0, condition.roll);  // undoes the camera's roll
  const std::size_t height = hits.size() / width;
  std::vector<bool> inside(hits.size()), result(hits.size());
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!std::isfinite(hits[i].return_path)) continue;
    const physics::Vector3 point =
        axes.inverse(roll * hits[i].point - physics::Vector3{0, 0, condition.board_distance});
    inside[i] = std::abs(point.x) <= size[0] / 2 && std::abs(point.y) <= size[1] / 2;
  }
  for (std::size_t v = 0; v < height; ++v) {
    for (std::size_t u = 0; u < width; ++u) {
      bool all = true;
      for (std::size_t y = v - std::min(v, settings.outer_margin_px);
           all && y <= std::min(v + settings.outer_margin_px, height - 1); ++y) {
        for (std::size_t x = u - std::min(u, settings.outer_margin_px);
             all && x <= std::min(u + settings.outer_margin_px, width - 1); ++x)
          all = inside[y * width + x];
      }
      result[v * width + u] = all;
    }
  }
  return result;
}

namespace fs = std::filesystem;

std::vector<InputFile> hashed_inputs(const fs::path& model, const fs::path& data,
                                     const std::vector<io::Condition>& conditions) {
  std::vector<InputFile> inputs = {{model.string(), io::sha256_of_file(model)},
                                   {data.string(), io::sha256_of_file(data)}};
  const fs::path folder = fs::absolute(data).lexically_normal().parent_path();
  std::set<fs::path> seen;
  const auto add = [&](const fs::path& file) {
    std::error_code error;
    if (file.empty() || !fs::is_regular_file(file, error) || !seen.insert(file).second) return;
    if (io::is_statistics(file)) {  // lists the capture, once, because its content decides
      const io::StatisticsHeader header = io::read_statistics_header(file);
      if (seen.insert(header.capture).second) inputs.push_back({header.capture, header.capture_sha256});
      return;
    }
    inputs.push_back(
        {fs::absolute(file).lexically_normal().lexically_proximate(folder).generic_string(), io::sha256_of_file(file)});
  };
  for (const io::Condition& c : conditions) {
    add(c.campaign);
    add(c.capture);
    if (c.capture.empty() && c.at.source) add(c.at.source->name);  // the table that contains the condition
  }
  return inputs;
}

}  // namespace tofgraph::diagnosis
