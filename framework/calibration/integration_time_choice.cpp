// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/integration_time.hpp"

#include <tofgraph/physics/four_phase.hpp>
#include <tofgraph/physics/interpolation.hpp>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

namespace tofgraph::calibration {
namespace {

double time_of(const Board* board) { return board->condition.integration_time; }

void choose_best(Place& place) {
  for (const Board* board : place.times) {
    if (usable(*board, place) && (place.best == nullptr || board->rmse < place.best->rmse)) place.best = board;
  }
  if (place.best == nullptr) return;
  place.shortest = place.longest = time_of(place.best);
  for (const Board* board : place.times) {
    if (!usable(*board, place) || board->rmse > nearly_best * place.best->rmse) continue;
    place.shortest = std::min(place.shortest, time_of(board));
    place.longest = std::max(place.longest, time_of(board));
  }
}

/// Sets the limits of the profile at this reflectivity: the largest mean of a tap is a / (2 contrast) + a / 2.
void set_limits(Place& place, const tofgraph_camera& camera, double reflectivity, double accuracy) {
  const double path = 2 * place.times.front()->modelled.mean;
  const double rate = camera.gain * reflectivity / (path * path);  // amplitude per time, counts/s
  const double brightest = rate * (1 / (2 * camera.contrast) + 0.5);
  if (camera.full_well > 0) place.saturates = camera.full_well / brightest;
  const physics::TapNoise noise{camera.read_noise, camera.shot_noise};
  if (!noise.known() || !(rate > 0) || !std::isfinite(accuracy)) return;
  constexpr double longest = 1e3;  // s
  double low = 1e-9, high = longest;
  for (int step = 0; step < 60; ++step) {
    const double t = std::sqrt(low * high);
    const double variance = noise.sample_variance(rate * t / (2 * camera.contrast));
    const bool quiet = physics::distance_sigma(variance, rate * t, camera.modulation_frequency) <= accuracy;
    (quiet ? high : low) = t;
  }
  if (high < longest) place.signal = high;
}

std::vector<Place> places_of(const Campaign& campaign, double accuracy) {
  const Boards& boards = campaign.boards;
  std::map<std::pair<std::size_t, double>, Place> places;
  std::map<std::size_t, std::vector<double>> levels;
  for (const Board& b : boards.boards) {  // ordered by target, distance, time
    const std::size_t target = boards.target_of(b);
    Place& place = places[{target, b.distance}];
    place.target = target;
    place.distance = b.distance;
    place.times.push_back(&b);
    levels[target].push_back(std::log(b.reflectivity));
  }
  std::vector<Place> result;
  for (auto& [key, place] : places) {
    set_limits(place, campaign.conditions.camera->view(), std::exp(moments_of(levels[place.target]).mean), accuracy);
    choose_best(place);
    result.push_back(std::move(place));
  }
  return result;
}

/// Board of a place at this time, if it is usable.
const Board* at_time(const Place& place, double time) {
  for (const Board* board : place.times) {
    if (time_of(board) == time && usable(*board, place)) return board;
  }
  return nullptr;
}

/// Time with the smallest maximum error over all places, among those that serve the most places.
Suggestion best_for_all(const std::vector<const Place*>& places, const std::set<double>& times, double accuracy) {
  Suggestion best;
  for (const double time : times) {
    Suggestion one{.time = time, .worst = 0};
    for (const Place* place : places) {
      const Board* board = at_time(*place, time);
      if (board == nullptr || error_of(*board) > accuracy) continue;
      one.places.push_back(place);
      one.worst = std::max(one.worst, error_of(*board));
    }
    const bool more = one.places.size() > best.places.size();
    if (more || (one.places.size() == best.places.size() && one.worst < best.worst)) best = one;
  }
  return best;
}

void recommend(IntegrationTimes& result, double accuracy) {
  std::set<double> times;
  for (const Place* place : result.wanted) {
    for (const Board* board : place->times) times.insert(time_of(board));
  }
  constexpr double any = std::numeric_limits<double>::infinity();
  const Suggestion single = best_for_all(result.wanted, times, any);
  if (single.places.size() == result.wanted.size()) result.single = single;
  const bool enough = !result.single.places.empty() && !(result.single.worst > accuracy);
  if (enough) return;
  std::vector<const Place*> left = result.wanted;
  while (!left.empty()) {
    const Suggestion next = best_for_all(left, times, std::isfinite(accuracy) ? accuracy : any);
    if (next.places.empty()) break;
    result.several.push_back(next);
    std::erase_if(left, [&](const Place* p) { return std::ranges::find(next.places, p) != next.places.end(); });
  }
  result.out_of_reach = left;
}

/// For each inner distance, interpolates the best time from those of the target's other distances (log-log) and
/// compares the nearest usable measured time with the best one; likewise for the median of the others' best times.
void hold_out_distances(IntegrationTimes& result) {
  std::map<std::size_t, std::vector<const Place*>> by_target;
  for (const Place& place : result.places) {
    if (place.best != nullptr) by_target[place.target].push_back(&place);
  }
  std::vector<double> excess, of_one_time;
  for (const auto& [target, listed] : by_target) {
    const std::vector<const Place*>& places = listed;  // a structured binding cannot be captured
    for (std::size_t k = 1; k + 1 < places.size(); ++k) {
      std::vector<double> distance, time;
      for (const Place* place : places) {
        if (place == places[k]) continue;
        distance.push_back(std::log(place->distance));
        time.push_back(std::log(time_of(place->best)));
      }
      std::vector<const Board*> possible;
      std::ranges::copy_if(places[k]->times, std::back_inserter(possible),
                           [&](const Board* b) { return usable(*b, *places[k]); });
      if (possible.size() < 2) continue;
      const double wanted = physics::MonotoneCurve(distance, time)(std::log(places[k]->distance));
      const auto excess_at = [&](double log_time) {
        const auto apart = [&](const Board* b) { return std::abs(std::log(time_of(b)) - log_time); };
        return (*std::ranges::min_element(possible, {}, apart))->rmse / places[k]->best->rmse;
      };
      excess.push_back(excess_at(wanted));
      of_one_time.push_back(excess_at(physics::median(time)));
    }
  }
  if (excess.empty()) return;
  std::ranges::sort(excess);
  const Moments m = moments_of(excess);
  result.held_out = excess.size();
  const auto n = static_cast<double>(excess.size());
  const double half = excess.size() > 1 ? student_95(n - 1) * m.sd / std::sqrt(n) : unknown;
  result.excess_of_one_time = moments_of(of_one_time).mean;
  result.excess = {m.mean, std::max(m.mean - half, 1.0), m.mean + half};
}

}  // namespace

bool usable(const Board& board, const Place& place) {
  const bool full = !board.shows_saturation && time_of(&board) > place.saturates;
  return board.saturated <= usable_saturation && !full && std::isfinite(board.rmse);
}

double error_of(const Board& board) {
  if (!std::isfinite(board.noise) || board.frames < 2) return board.rmse;
  return std::hypot(board.rmse, board.noise * std::sqrt(1 - 1 / static_cast<double>(board.frames)));
}

IntegrationTimes choose_times(const Campaign& campaign, const Request& request) {
  const double accuracy = request.accuracy.value_or(unknown);
  IntegrationTimes result;
  result.places = places_of(campaign, accuracy);
  for (const Place& place : result.places) {
    const bool inside = !request.range ||
                        (place.distance >= (*request.range)[0] - 1e-9 && place.distance <= (*request.range)[1] + 1e-9);
    if (inside) result.wanted.push_back(&place);
  }
  result.compares = std::ranges::any_of(result.places, [](const Place& p) { return p.times.size() > 1; });
  if (result.compares) recommend(result, accuracy);
  hold_out_distances(result);
  return result;
}

}  // namespace tofgraph::calibration
