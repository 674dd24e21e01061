// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/lens_views.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <optional>

namespace tofgraph::calibration {
namespace {

/// Condition after reading and detection.
struct Read {
  ViewImages images;
  BoardSearch search;
  CameraSeen seen;
  std::string mistake, left_out;
};

bool is_foreign(const CameraSeen& seen, const io::Campaign& campaign) {
  return !seen.camera.empty() && seen.camera != campaign.camera->view().name;
}

Read read(const io::Campaign& campaign, const io::Condition& condition) {
  Read result;
  if (condition.is_capped()) {
    result.left_out = "the lens is capped";
    return result;
  }
  try {
    result.images = images_of(condition, *campaign.camera, result.seen);
    // A capture of another camera is an error in any case: the detection, which takes most of the time, is skipped.
    if (is_foreign(result.seen, campaign)) return result;
    result.search = find_board(result.images.image, *campaign.pattern);
  } catch (const std::runtime_error& error) {
    result.mistake = capture_problem(condition, error);
  }
  return result;
}

bool same_image(const Image& a, const Image& b) {
  return std::ranges::equal(a.values, b.values,
                            [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

/// Returns true if the corners differ by no more than their noise: neither camera nor board moved.
bool same_pose(const View& a, const View& b) {
  if (a.corners.size() != b.corners.size()) return false;
  double squares = 0;
  for (std::size_t i = 0; i < a.corners.size(); ++i) {
    const Corner &x = a.corners[i], &y = b.corners[i];
    if (x.point != y.point) return false;
    squares += std::pow(x.u - y.u, 2) / (x.covariance[0] + y.covariance[0]) +
               std::pow(x.v - y.v, 2) / (x.covariance[2] + y.covariance[2]);
  }
  constexpr double limit = 4;  // of a mean with expectation 1
  return squares < limit * 2 * static_cast<double>(a.corners.size());
}

/// Merges two measurements of one view by averaging the corners.
void merge(View& into, const View& other) {
  for (std::size_t i = 0; i < into.corners.size(); ++i) {
    Corner& corner = into.corners[i];
    corner.u = (corner.u + other.corners[i].u) / 2;
    corner.v = (corner.v + other.corners[i].v) / 2;
    for (std::size_t k = 0; k < 3; ++k)
      corner.covariance[k] = (corner.covariance[k] + other.corners[i].covariance[k]) / 4;
  }
}

class Views {
 public:
  Views(const io::Campaign& campaign, LensViews& all) : campaign_(campaign), all_(all) {}

  void add(const io::Condition& condition, Read& read) {
    if (!read.search.found()) {
      all_.skipped.push_back({condition.id, read.search.reason});
      if (read.search.other_size[0] != 0) ++other_sizes_[read.search.other_size];
      return;
    }
    View view{.id = condition.id, .corners = std::move(read.search.corners), .distances = {}};
    for (std::size_t i = 0; i < all_.images.size(); ++i) {
      View& before = all_.observations.views[i];
      if (same_image(all_.images[i].image, read.images.image)) {
        all_.skipped.push_back({condition.id, fmt::format("the same image as {}", before.id)});
        return;
      }
      if (!same_pose(before, view)) continue;
      all_.notes.push_back(
          fmt::format("{}, {}: the same view, neither camera nor board moved: merged", before.id, view.id));
      merge(before, view);
      return;
    }
    all_.observations.views.push_back(std::move(view));
    all_.images.push_back(std::move(read.images));
    all_.pixel_noise.push_back(read.search.pixel_noise);
  }

  /// Reports too few views as an error, with advice.
  void check(config::Diagnostics& diagnostics) const {
    const io::Pattern& pattern = *campaign_.pattern;
    const std::size_t found = all_.observations.views.size();
    if (found >= min_views) return;
    std::string hint =
        "take 10 to 30 views: the whole board inside the image, near and far, in the middle and towards "
        "the corners, tilted by 20 to 40 deg about both axes";
    const auto other = std::ranges::max_element(other_sizes_, {}, [](const auto& size) { return size.second; });
    if (other != other_sizes_.end() && 2 * static_cast<std::size_t>(other->second) >= all_.skipped.size())
      hint = fmt::format(
          "{} view{} a chessboard of other size: pattern: {{type: chessboard, columns: {}, rows: {}, ..}} "
          "would fit (inner corners)",
          other->second, other->second == 1 ? " shows" : "s show", other->first[0], other->first[1]);
    std::string reasons;
    for (std::size_t i = 0; i < std::min<std::size_t>(all_.skipped.size(), 3); ++i)
      reasons += fmt::format("; {}: {}", all_.skipped[i].id, all_.skipped[i].reason);
    diagnostics.error(
        pattern.at,
        fmt::format("the pattern of {} x {} was found in {} of {} views, at least {} different ones are "
                    "needed{}",
                    pattern.columns, pattern.rows, found, campaign_.conditions.size(), min_views, reasons),
        hint);
  }

 private:
  const io::Campaign& campaign_;
  LensViews& all_;
  std::map<std::array<int, 2>, int> other_sizes_;
};

/// Adds a note for all views with pixels that differ from their neighbours, or are bad in the profile's map.
void note_pixels(const io::Campaign& campaign, const std::vector<Read>& reads, std::vector<std::string>& notes) {
  const auto mapped = std::ranges::count_if(campaign.camera->bad_pixels, [](std::uint8_t bad) { return bad != 0; });
  if (mapped > 0) notes.push_back(fmt::format("{} pixels are left out: bad in the profile's map", mapped));
  const auto worst = std::ranges::max_element(reads, {}, [](const Read& r) { return r.images.isolated; });
  if (worst == reads.end() || worst->images.isolated == 0) return;
  notes.push_back(
      fmt::format("isolated pixels, unlike their neighbours by a factor of 3, are left out: at most {}, in {}",
                  worst->images.isolated, campaign.conditions[static_cast<std::size_t>(worst - reads.begin())].id));
}

/// Reports captures of a camera other than the campaign's.
void check_names(const io::Campaign& campaign, const std::vector<CameraSeen>& seen, config::Diagnostics& diagnostics) {
  const std::string name = campaign.camera->view().name;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!is_foreign(seen[i], campaign)) continue;
    diagnostics.error(place_of(campaign.conditions[i]),
                      fmt::format("the capture is of the camera '{}', the campaign's is '{}'", seen[i].camera, name),
                      fmt::format("`camera: {}` would fit; a calibration is of one camera: make a campaign for each",
                                  seen[i].camera));
  }
}

/// Sets the initial lens from the profile, and the light paths if they are known.
void use_profile(const tofgraph_camera& camera, Observations& observations) {
  const LensParameters lens = lens_of(camera);
  observations.fisheye = lens[lens::fisheye] > 0.5;
  const auto finite = [](double x) { return std::isfinite(x); };
  if (std::ranges::all_of(lens, finite) && lens[lens::fx] > 0 && lens[lens::fy] > 0) observations.expected = lens;
  if (!(camera.focal_length > 0 && camera.pitch[0] > 0 && camera.pitch[1] > 0)) return;
  try {
    observations.light = LightPaths{physics::geometry_of(camera).sources, {camera.pitch[0], camera.pitch[1]}};
  } catch (const std::invalid_argument&) {  // no source is known: distances cannot be used
    observations.light.reset();
  }
}

}  // namespace

LensParameters lens_of(const tofgraph_camera& camera) {
  if (camera.lens_model == TOFGRAPH_LENS_RAYS)
    throw config::ConfigurationError(
        fmt::format("the lens of the profile '{}' is a table of rays: patterns are fitted with OpenCV's perspective or "
                    "fisheye model, a profile with lens: opencv or lens: fisheye is needed",
                    camera.name));
  LensParameters lens{};
  lens[lens::fx] = camera.focal_px[0];
  lens[lens::fy] = camera.focal_px[1];
  lens[lens::cx] = camera.principal_point[0];
  lens[lens::cy] = camera.principal_point[1];
  lens[lens::skew] = camera.skew;
  if (camera.lens_model == TOFGRAPH_LENS_FISHEYE) {
    lens[lens::fisheye] = 1;
    for (std::size_t i = 0; i < 4; ++i) lens[lens::fisheye_powers[i]] = camera.distortion[i];
    return lens;
  }
  constexpr std::size_t order[] = {lens::k1, lens::k2, lens::p1, lens::p2, lens::k3};
  for (std::size_t i = 0; i < 5; ++i) lens[order[i]] = camera.distortion[i];
  for (std::size_t i = 0; i < 3; ++i) lens[lens::k4 + i] = camera.further_distortion[i];
  return lens;
}

LensViews read_lens_views(const io::Campaign& campaign, const std::function<void(double share)>& progress) {
  LensViews all{.pattern = *campaign.pattern};
  const tofgraph_camera& camera = campaign.camera->view();
  all.observations.width = camera.width;
  all.observations.height = camera.height;
  all.observations.points = board_points(all.pattern);
  all.observations.circle_radius = all.pattern.diameter / 2;
  all.observations.quarter_turns = looks_the_same_turned(all.pattern);
  use_profile(camera, all.observations);
  const std::size_t n = campaign.conditions.size();
  std::vector<Read> reads(n);
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
    reads[i] = read(campaign, campaign.conditions[i]);
    if (progress) progress(static_cast<double>(++done) / static_cast<double>(n));
  });
  config::Diagnostics diagnostics;
  std::vector<CameraSeen> seen;
  for (const Read& r : reads) seen.push_back(r.seen);
  all.serial = check_one_camera(campaign, seen, all.notes, diagnostics);
  check_names(campaign, seen, diagnostics);
  for (std::size_t i = 0; i < n; ++i)
    if (!reads[i].mistake.empty()) diagnostics.error(place_of(campaign.conditions[i]), reads[i].mistake, "");
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  note_pixels(campaign, reads, all.notes);
  Views views(campaign, all);
  for (std::size_t i = 0; i < n; ++i) {
    if (reads[i].left_out.empty())
      views.add(campaign.conditions[i], reads[i]);
    else
      all.skipped.push_back({campaign.conditions[i].id, reads[i].left_out});
  }
  views.check(diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return all;
}

}  // namespace tofgraph::calibration
