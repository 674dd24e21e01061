// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/characterisation.hpp"

#include "config/quantity.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tofgraph/physics/non_linearity.hpp>
#include <tofgraph/physics/phasor.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <numeric>
#include <set>
#include <tuple>

namespace tofgraph::calibration {
namespace {

constexpr std::size_t max_shown = 8;  ///< residual maps
constexpr AccuracyProtocol protocol;

double depth_by(DepthModel model, const BoardModel& board, physics::Vector3 ray, double distance, double true_depth) {
  const physics::Geometry& g = board.geometry();
  if (model == DepthModel::optimized_bistatic)
    return physics::depth_of(g, ray, physics::optimized_bistatic_newton(g, ray, distance));
  const physics::LinearDepth line = model == DepthModel::perpendicular ? physics::perpendicular_illumination(g, ray)
                                                                       : physics::simple_bistatic(g, ray, true_depth);
  return line.offset + line.slope * distance;
}

/// Sums over the conditions of a pixel's error relative to the mean error of its board, in two halves.
struct Pattern {
  std::vector<double> sum[2], count[2];
  explicit Pattern(std::size_t pixels) {
    for (auto* values : {&sum[0], &sum[1], &count[0], &count[1]}) values->assign(pixels, 0);
  }
};

class SeriesReader {
 public:
  SeriesReader(Characterisation& data, const BoardModels& models)
      : data_(data),
        models_(models),
        camera_(data.campaign.conditions.camera->view()),
        half_(halves_of(data.campaign.conditions.conditions)),
        pattern_(std::size_t{camera_.width} * camera_.height) {}

  /// Called by several threads.
  void take(std::size_t index, const Board& board, const MeanImages& images) {
    const BoardModel& model = models_.of(board.condition);
    Characterised result{.condition = index, .board = board};
    const physics::Plane plane = plane_of(board.condition);
    std::array<std::vector<double>, 3> depths;
    std::vector<double> errors;
    std::vector<double> centre, centre_variances;
    double slope = 0;  // dz/dD: sensitivity of the depth to distance noise
    for (std::size_t k = 0; k < images.pixels.size(); ++k) {
      const std::size_t i = images.pixels[k];
      const physics::Vector3 ray = model.ray(i);
      const double path = physics::reflected_path(model.geometry(), ray, plane);
      const double truth = physics::depth_of(model.geometry(), ray, path);
      for (std::size_t m = 0; m < depths.size(); ++m)
        depths[m].push_back(
            depth_by(static_cast<DepthModel>(m), model, ray, images.distance[k], board.condition.board_distance));
      errors.push_back(depths.back().back() - truth);
      const double own = physics::optimized_bistatic_slope(model.geometry(), ray, path);
      slope += own / static_cast<double>(images.pixels.size());
      if (!in_centre(i)) continue;
      centre.push_back(errors.back());
      if (!images.variance.empty()) centre_variances.push_back(own * own * images.variance[k]);
    }
    for (std::size_t m = 0; m < depths.size(); ++m) result.depth[m] = moments_of(depths[m]);
    result.centre_error = moments_of(centre).mean;
    result.centre_noise = std::sqrt(std::max(moments_of(centre_variances).mean, 0.0));
    result.noise = slope * board.noise;
    result.protocol = against_protocol(board, centre.size());
    const Moments error = moments_of(errors);
    result.error_sd = error.sd;
    const std::scoped_lock lock(turn_);
    const std::size_t half = half_[index];
    for (std::size_t k = 0; k < errors.size(); ++k) {
      pattern_.sum[half][images.pixels[k]] += errors[k] - error.mean;
      pattern_.count[half][images.pixels[k]] += 1;
    }
    data_.conditions.push_back(std::move(result));
  }

  /// Fixed pattern of the pixels, and its mean square without noise: only the pattern is common to the two halves.
  double finish() {
    data_.pattern.assign(pattern_.sum[0].size(), unknown);
    double product = 0, count = 0;
    for (std::size_t i = 0; i < data_.pattern.size(); ++i) {
      const double a = pattern_.count[0][i], b = pattern_.count[1][i];
      if (a + b > 0) data_.pattern[i] = (pattern_.sum[0][i] + pattern_.sum[1][i]) / (a + b);
      if (a == 0 || b == 0) continue;
      product += pattern_.sum[0][i] / a * pattern_.sum[1][i] / b;
      count += 1;
    }
    std::ranges::sort(data_.conditions, {}, &Characterised::condition);
    return count > 0 ? std::max(product / count, 0.0) : unknown;
  }

 private:
  /// Assigns conditions that differ only in distance and roll alternately, so that exclusions, e.g. of saturated
  /// conditions, affect both halves alike.
  static std::vector<std::size_t> halves_of(const std::vector<io::Condition>& conditions) {
    std::vector<std::size_t> order(conditions.size()), halves(conditions.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, {}, [&](std::size_t i) {
      const io::Condition& c = conditions[i];
      const double time = std::isnan(c.integration_time) ? 0 : c.integration_time;
      const double distance = c.has_board() ? c.board_distance : 0;
      return std::tuple(time, c.target, c.sources, distance, c.roll, i);
    });
    for (std::size_t rank = 0; rank < order.size(); ++rank) halves[order[rank]] = rank % 2;
    return halves;
  }

  bool in_centre(std::size_t pixel) const {
    const auto inside = [](std::size_t at, std::size_t size) {
      const std::size_t side = std::min(protocol.side, size), first = (size - side) / 2;
      return at >= first && at < first + side;
    };
    return inside(pixel % camera_.width, camera_.width) && inside(pixel / camera_.width, camera_.height);
  }

  static std::vector<std::string> against_protocol(const Board& board, std::size_t pixels) {
    std::vector<std::string> problems;
    const io::Condition& c = board.condition;
    if (!std::isfinite(c.time_since_power_on))
      problems.emplace_back("time since power-on unknown");
    else if (c.time_since_power_on < protocol.warm_up)
      problems.push_back(fmt::format("only {:.0f} min since power-on", c.time_since_power_on / 60));
    if (!std::isfinite(c.reflectivity))
      problems.emplace_back("reflectivity unknown");
    else if (c.reflectivity < protocol.reflectivity[0] || c.reflectivity > protocol.reflectivity[1])
      problems.push_back(fmt::format("a target of {:.0f} %", 100 * c.reflectivity));
    if (pixels < protocol.side * protocol.side) problems.emplace_back("pixels of the square are missing");
    if (board.frames < protocol.frames) problems.push_back(fmt::format("{} frames", board.frames));
    return problems;
  }

  Characterisation& data_;
  const BoardModels& models_;
  const tofgraph_camera& camera_;
  std::mutex turn_;
  std::vector<std::size_t> half_;  ///< per condition
  Pattern pattern_;
};

/// Modelled and measured images of a board, section 5.7.1 of the reference.
BoardImages images_of(const Board& board, const MeanImages& images, const BoardModel& model,
                      const tofgraph_camera& camera) {
  BoardImages result;
  for (auto* image :
       {&result.measured_distance, &result.modelled_distance, &result.measured_amplitude, &result.modelled_amplitude})
    image->assign(std::size_t{camera.width} * camera.height, unknown);
  const physics::Plane plane = plane_of(board.condition);
  const physics::Exposure exposure{1, 1, 1, camera.modulation_frequency};
  const std::vector<double> distances = model.modelled(board.condition, images.pixels);
  double measured = 0, modelled = 0;
  for (std::size_t k = 0; k < images.pixels.size(); ++k) {
    const std::size_t i = images.pixels[k];
    const double path = physics::reflected_path(model.geometry(), model.ray(i), plane);
    result.measured_distance[i] = images.distance[k];
    result.modelled_distance[i] = distances[k];
    result.modelled_amplitude[i] =
        std::abs(physics::reference_light(model.geometry(), model.ray(i), path, 1, exposure).phasor);
    modelled += result.modelled_amplitude[i];
    if (images.amplitude.empty()) continue;
    result.measured_amplitude[i] = images.amplitude[k];
    measured += images.amplitude[k];
  }
  for (double& value : result.modelled_amplitude) value *= static_cast<double>(images.pixels.size()) / modelled;
  for (double& value : result.measured_amplitude) value *= static_cast<double>(images.pixels.size()) / measured;
  return result;
}

/// Sets the amplitudes of the camera model with one reflectivity per target.
void set_modelled_amplitudes(Characterisation& data) {
  std::map<std::string, std::vector<double>> logs;
  for (const Characterised& c : data.conditions) {
    if (c.board.reflectivity > 0) logs[c.board.condition.target].push_back(std::log(c.board.reflectivity));
  }
  for (Characterised& c : data.conditions) {
    const auto found = logs.find(c.board.condition.target);
    if (found == logs.end() || !(c.board.reflectivity > 0)) continue;
    c.modelled_amplitude = c.board.amplitude * std::exp(moments_of(found->second).mean) / c.board.reflectivity;
  }
}

/// Selects up to max_shown distances from the nearest to the farthest, each with its most precisely measured board.
void choose_shown(Characterisation& data) {
  std::map<double, std::size_t> by_distance;
  for (std::size_t k = 0; k < data.conditions.size(); ++k) {
    const Board& b = data.conditions[k].board;
    const auto [place, fresh] = by_distance.try_emplace(b.distance, k);
    if (!fresh && b.depth_sd < data.conditions[place->second].board.depth_sd) place->second = k;
  }
  std::vector<std::size_t> all;
  for (const auto& [distance, k] : by_distance) all.push_back(k);
  const std::size_t count = std::min(all.size(), max_shown);
  for (std::size_t k = 0; k < count; ++k)
    data.shown.push_back(all[count == 1 ? 0 : k * (all.size() - 1) / (count - 1)]);
}

}  // namespace

Characterisation characterise(const CharacterisationRequest& request, const graph::PluginRegistry& registry) {
  Characterisation data{.campaign = {read_conditions(request.campaign), {}}};
  const io::Campaign& campaign = data.campaign.conditions;
  const std::string file = request.campaign.campaign.string();
  if (campaign.from_table)
    throw config::ConfigurationError(fmt::format(
        "{}: error: a table holds statistics, a characterisation needs captures\n  tofgraph calibrate offset "
        "takes tables",
        file));
  refuse_duplicates(campaign);
  const auto progress = [&](double share) {
    if (request.campaign.progress) request.campaign.progress(0.9 * share, "reading the campaign");
  };
  double pattern_square = 0;
  try {
    const BoardModels models(campaign.camera->view(), request.campaign.variant, campaign.conditions);
    SeriesReader reader(data, models);
    ReadBoards options{.progress = progress, .repeats = Repeats::kept, .single_sources = true, .skip_wrapped = true};
    options.visit = [&](std::size_t i, const Board& b, const MeanImages& images) { reader.take(i, b, images); };
    data.campaign.boards = read_boards(campaign, request.campaign.variant, options);
    pattern_square = reader.finish();
    if (data.conditions.empty())
      throw config::ConfigurationError(fmt::format("{}: error: no usable condition\n  {}", file,
                                                   data.campaign.boards.notes.empty()
                                                       ? "it needs boards at known distances"
                                                       : sentence_of(data.campaign.boards.notes)));
    // The falloff over the image is known only after all boards were read.
    for (std::size_t k = 0; k < data.conditions.size(); ++k)
      data.conditions[k].board.reflectivity = data.campaign.boards.boards[k].reflectivity;
    choose_shown(data);
    std::set<std::size_t> wanted;
    for (const std::size_t k : data.shown) wanted.insert(data.conditions[k].condition);
    io::Campaign some = campaign;
    some.conditions.clear();
    for (const std::size_t k : data.shown) some.conditions.push_back(campaign.conditions[data.conditions[k].condition]);
    data.residuals.assign(data.shown.size(), std::vector<float>(data.pattern.size(), std::nanf("")));
    read_boards(some, request.campaign.variant,
                {.repeats = Repeats::kept,
                 .single_sources = true,
                 .visit = [&](std::size_t at, const Board& b, const MeanImages& images) {
                   const BoardModel& model = models.of(b.condition);
                   if (at == 0) data.nearest = images_of(b, images, model, campaign.camera->view());
                   const physics::Plane plane = plane_of(b.condition);
                   for (std::size_t k = 0; k < images.pixels.size(); ++k) {
                     const physics::Vector3 ray = model.ray(images.pixels[k]);
                     const auto& g = model.geometry();
                     data.residuals[at][images.pixels[k]] = static_cast<float>(
                         depth_by(DepthModel::optimized_bistatic, model, ray, images.distance[k], 0) -
                         physics::depth_of(g, ray, physics::reflected_path(g, ray, plane)));
                   }
                 }});
  } catch (const std::invalid_argument& problem) {
    throw config::ConfigurationError(fmt::format("{}: error: {}", file, problem.what()));
  }
  set_modelled_amplitudes(data);
  set_budget(data, pattern_square);
  if (!request.model.empty()) data.effects = effect_budget(data, request.model, registry);
  return data;
}

std::string summary_of(const Characterisation& data) {
  const auto mm = [](double metres) { return fmt::format("{:.2f} mm", metres * 1e3); };
  std::string parts;
  for (const BudgetLine& line : data.budget) {
    constexpr double worth_telling = 0.05;
    if (!(line.depth >= worth_telling * data.total)) continue;
    parts += fmt::format("{}{} {}", parts.empty() ? "" : ", ", line.name, mm(line.depth));
  }
  std::string interval;
  if (std::isfinite(data.total_by_distance.low))
    interval = fmt::format(" (95 % over distances: {:.2f} to {:.2f} mm)", data.total_by_distance.low * 1e3,
                           data.total_by_distance.high * 1e3);
  return fmt::format("{}\ndepth error of a pixel in one frame: {} rms{}: {}", described(data.campaign.boards),
                     mm(data.total), interval, parts);
}

}  // namespace tofgraph::calibration
