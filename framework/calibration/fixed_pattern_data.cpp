// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/fixed_pattern.hpp"
#include "config/diagnostics.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/constants.hpp>
#include <tofgraph/physics/non_linearity.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <set>

namespace tofgraph::calibration {
namespace {

constexpr float none = std::numeric_limits<float>::quiet_NaN();

PatternView view_of(std::size_t index, const Board& board, const MeanImages& images, const BoardModel& model,
                    std::size_t pixels) {
  constexpr double step = 1e-3;  // m
  PatternView view{.condition = index, .board_distance = board.condition.board_distance};
  view.residual.assign(pixels, none);
  view.weight.assign(pixels, 0);
  view.distance.assign(pixels, none);
  view.along_z.assign(pixels, none);
  view.faintness.assign(pixels, none);
  view.place.resize(pixels);
  const io::Condition& c = board.condition;
  io::Condition farther = c;
  farther.board_distance += step;
  const std::vector<double> here = model.modelled(c, images.pixels), there = model.modelled(farther, images.pixels);
  const physics::Plane plane = plane_of(c);
  // The noise of a distance is proportional to 1 / amplitude; its mean over the pixels was measured.
  double inverse = 0;
  for (const double a : images.amplitude) inverse += 1 / (a * a) / static_cast<double>(images.pixels.size());
  const double frames = static_cast<double>(images.frames);
  for (std::size_t k = 0; k < images.pixels.size(); ++k) {
    const std::size_t i = images.pixels[k];
    const physics::Vector3 ray = model.ray(i);
    const double path = physics::reflected_path(model.geometry(), ray, plane);
    const std::array<double, 2> place = on_board(c, physics::point_on_ray(model.geometry(), ray, path));
    double variance = std::isfinite(images.noise) && images.noise > 0 ? images.noise * images.noise / frames : 1e-6;
    if (inverse > 0) variance *= 1 / (images.amplitude[k] * images.amplitude[k]) / inverse;
    view.residual[i] = static_cast<float>(images.distance[k] - here[k]);
    view.weight[i] = static_cast<float>(1 / variance);
    view.distance[i] = static_cast<float>(here[k]);
    view.along_z[i] = static_cast<float>((there[k] - here[k]) / step);
    view.place[i] = {static_cast<float>(place[0]), static_cast<float>(place[1])};
    if (!images.amplitude.empty()) view.faintness[i] = static_cast<float>(c.integration_time / images.amplitude[k]);
  }
  return view;
}

/// Divides the faintness by its mean. If a condition has no amplitudes, it is 1 everywhere, which a note says.
void normalise_faintness(PatternData& data) {
  double sum = 0, count = 0;
  std::vector<std::string> without;
  for (const PatternView& view : data.views) {
    double of_view = 0;
    for (std::size_t i = 0; i < view.residual.size(); ++i) {
      if (!std::isfinite(view.residual[i])) continue;
      of_view += view.faintness[i];
      count += 1;
    }
    sum += of_view;
    if (!std::isfinite(of_view)) without.push_back("'" + data.campaign.conditions.conditions[view.condition].id + "'");
  }
  const double mean = sum / count;
  for (PatternView& view : data.views) {
    for (float& f : view.faintness) f = std::isfinite(mean) ? static_cast<float>(f / mean) : 1;
  }
  if (!without.empty())
    data.campaign.boards.notes.push_back(
        fmt::format("no amplitudes in {}: crosstalk is taken as equal in all pixels of all conditions; record "
                    "amplitudes or leave these conditions out",
                    fmt::join(without, ", ")));
}

void check_enough(const Request& request, PatternData& data) {
  std::set<double> distances, rolls;
  std::vector<std::string>& notes = data.campaign.boards.notes;
  for (const PatternView& v : data.views) {
    const io::Condition& c = data.campaign.conditions.conditions[v.condition];
    distances.insert(std::round(c.board_distance * 1e3));
    rolls.insert(std::round(std::remainder(c.roll, 2 * M_PI) * 1e2));
  }
  if (distances.size() * rolls.size() < 2)
    throw config::ConfigurationError(fmt::format(
        "{}: error: {} at one distance and one roll: errors of the board cannot be distinguished from errors of the "
        "pixels\n  record the board at three distances or more, and with the camera rolled, e.g. roll: 90 deg{}",
        request.campaign.string(), data.views.size() == 1 ? "one condition" : "all conditions are",
        used_of(data.campaign.boards)));
  if (rolls.size() < 2)
    notes.emplace_back(
        "every condition has the same roll: a board that is not flat or not square to the camera can be distinguished "
        "from the pattern by its distances alone");
  if (distances.size() < 3)
    notes.push_back(fmt::format("{} distance{}: a growth of the pattern with the distance cannot be determined",
                                distances.size(), distances.size() == 1 ? "" : "s"));
}

}  // namespace

PatternData read_pattern(const Request& request) {
  PatternData data{.campaign = {read_conditions(request), {}}};
  const io::Campaign& campaign = data.campaign.conditions;
  if (campaign.from_table)
    throw config::ConfigurationError(
        fmt::format("{}: error: a table has no images\n  give conditions with captures", request.campaign.string()));
  refuse_duplicates(campaign);
  const tofgraph_camera& camera = campaign.camera->view();
  data.rows = camera.height;
  data.columns = camera.width;
  data.metres_per_radian = physics::metres_per_radian(camera.modulation_frequency);
  std::mutex turn;
  try {
    const BoardModel model(camera, request.variant);
    data.campaign.boards = read_boards(campaign, request.variant,
                                       {.progress =
                                            [&](double share) {
                                              if (request.progress)
                                                request.progress(0.5 * share, "reading the campaign");
                                            },
                                        .repeats = Repeats::kept,
                                        .visit =
                                            [&](std::size_t index, const Board& board, const MeanImages& images) {
                                              PatternView view =
                                                  view_of(index, board, images, model, data.rows * data.columns);
                                              const std::scoped_lock lock(turn);
                                              data.noise_known = data.noise_known && images.frames > 1;
                                              data.views.push_back(std::move(view));
                                            }});
  } catch (const std::invalid_argument& problem) {
    throw config::ConfigurationError(fmt::format("{}: error: {}", request.campaign.string(), problem.what()));
  }
  std::ranges::sort(data.views, {}, &PatternView::condition);
  if (data.views.empty())
    throw config::ConfigurationError(
        fmt::format("{}: error: no usable condition\n  it needs boards at known distances{}", request.campaign.string(),
                    used_of(data.campaign.boards)));
  check_enough(request, data);
  normalise_faintness(data);
  data.extent = 0;
  for (const PatternView& v : data.views) {
    for (const auto& [x, y] : v.place) data.extent = std::max({data.extent, double{std::abs(x)}, double{std::abs(y)}});
  }
  return data;
}

}  // namespace tofgraph::calibration
