// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/data/design.hpp"

#include "diagnosis/data/search_settings.hpp"

#include "simulation/simulation.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tofgraph/physics/constants.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tofgraph::diagnosis {
namespace {

constexpr double probe = 1e-3;  ///< m, step of the derivative with respect to the board's distance

simulation::BoardPose scaled_reflectivity(simulation::BoardPose pose, double light) {
  pose.reflectivity *= std::exp(light);
  return pose;
}

/// Acquisitions, which refer to the texts of the conditions.
std::vector<simulation::Acquisition> shots_of(const tofgraph_camera& camera,
                                              const std::vector<io::Condition>& conditions) {
  std::vector<simulation::Acquisition> shots;
  for (const io::Condition& condition : conditions) shots.push_back(simulation::acquisition_of(camera, condition));
  return shots;
}

}  // namespace

Design::Design(io::CameraPtr camera, bool physical, std::vector<io::Condition> conditions, std::size_t superpixels,
               double jitter)
    : camera_(std::move(camera)),
      demodulation_(physics::exposures_of(camera_->view())),
      physical_(physical),
      grid_(superpixels),
      conditions_(std::move(conditions)),
      jitter_(jitter),
      shots_(shots_of(camera_->view(), conditions_)),
      pixels_(simulation::superpixels(camera_->view(), grid_, grid_)),
      fine_(simulation::superpixels(camera_->view(), grid_ * fine, grid_ * fine)),
      whole_(simulation::whole_image(camera_->view())) {
  ideal_.resize(size());
  shifts_.resize(size());
  offsets_.resize(size());
  const simulation::ForwardModel ideal(this->camera(), physical_, {});
  tbb::parallel_for(std::size_t{0}, size(), [&](std::size_t i) {
    ideal_[i] = ideal_signals(pixels_, i);
    shifts_[i].assign(rows(), 0);
    if (!shows_board(i)) return;
    const simulation::BoardPose pose = pose_of(conditions_[i]);
    shifts_[i] = shift_of(ideal, i, pose);
    if (std::hypot(pose.tilt_x, pose.tilt_y) < settings.offset_min_tilt) return;
    offsets_[i].assign(rows(), 0);
    std::fill_n(offsets_[i].begin() + static_cast<std::ptrdiff_t>(distance * pixels_.size()), pixels_.size(), 1.0);
  });
}

Design::Design(const Design& whole, std::span<const std::size_t> chosen)
    : camera_(whole.camera_),
      demodulation_(whole.demodulation_),
      physical_(whole.physical_),
      grid_(whole.grid_),
      conditions_(picked(whole.conditions_, chosen)),
      jitter_(whole.jitter_),
      shots_(shots_of(camera_->view(), conditions_)),
      pixels_(whole.pixels_),
      fine_(whole.fine_),
      whole_(whole.whole_),
      ideal_(picked(whole.ideal_, chosen)),
      shifts_(picked(whole.shifts_, chosen)),
      offsets_(picked(whole.offsets_, chosen)) {}

void require_enough(std::size_t conditions, const std::vector<std::string>& left_out) {
  if (conditions >= settings.min_conditions) return;
  throw std::invalid_argument(
      fmt::format("{} condition{} can be used, and a search needs {} at least: errors of the model and errors of "
                  "single conditions cannot be distinguished{}",
                  conditions, conditions == 1 ? "" : "s", settings.min_conditions,
                  left_out.empty() ? "" : "; excluded: " + left_out[0]));
}

io::Condition stand_in(const io::Condition& capped, const tofgraph_camera& camera) {
  io::Condition board;
  board.integration_time = capped.integration_time;
  board.board_distance = physics::unambiguous_range(camera.modulation_frequency) / 2;
  return board;
}

bool is_light_known(const io::Condition& c) { return !std::isnan(c.reflectivity) || c.is_capped(); }

simulation::BoardPose pose_of(const io::Condition& c) {
  const auto known = [](double value, double otherwise) { return std::isnan(value) ? otherwise : value; };
  return {c.board_distance,
          known(c.board_tilt_x, 0),
          known(c.board_tilt_y, 0),
          known(c.reflectivity, settings.unknown_reflectivity),
          c.roll,
          known(c.velocity, 0)};
}

std::vector<Signal> Design::signals(const simulation::ForwardModel& model, const simulation::Pixels& pixels,
                                    std::size_t i, const simulation::BoardPose& pose) const {
  const auto nothing = [](const simulation::BoardChange&, std::span<const simulation::Vector3>,
                          std::span<simulation::Hit> hits) { std::ranges::fill(hits, simulation::Hit{}); };
  const simulation::Tracer scene =
      shows_board(i) ? simulation::board_tracer(camera().focal_length, pose) : simulation::Tracer(nothing);
  simulation::Expectation expectation = model.expect(scene, shots_[i], pixels);
  if (model.has_readout()) model.read_out(shots_[i], pixels, expectation.taps);
  std::vector<Signal> result = demodulated(expectation.taps, pixels.size());
  if (shows_board(i)) return result;
  const std::vector<Signal> board = &pixels == &pixels_ ? ideal_[i] : ideal_signals(pixels, i);
  for (std::size_t s = 0; s < pixels.size(); ++s) result[s] += board[s];
  return result;
}

std::vector<Signal> Design::ideal_signals(const simulation::Pixels& pixels, std::size_t i) const {
  const simulation::ForwardModel ideal(camera(), physical_, {});
  if (shows_board(i)) return signals(ideal, pixels, i, pose_of(conditions_[i]));
  const io::Condition board = stand_in(conditions_[i], camera());
  const simulation::Tracer scene = simulation::board_tracer(camera().focal_length, pose_of(board));
  return demodulated(ideal.expect(scene, simulation::acquisition_of(camera(), board), pixels).taps, pixels.size());
}

std::vector<Signal> Design::demodulated(std::span<const double> taps, std::size_t pixels) const {
  std::vector<Signal> result;
  result.reserve(pixels);
  for (std::size_t s = 0; s < pixels; ++s) result.push_back(demodulation_.of_taps(&taps[s], pixels));
  return result;
}

std::vector<double> Design::shift_of(const simulation::ForwardModel& ideal, std::size_t i,
                                     const simulation::BoardPose& pose) const {
  simulation::BoardPose nearer = pose, farther = pose;
  nearer.distance -= probe;
  farther.distance += probe;
  std::vector<double> rows = rows_of(signals(ideal, pixels_, i, farther), signals(ideal, pixels_, i, nearer), i);
  for (double& row : rows) row /= 2 * probe;
  return rows;
}

std::vector<double> Design::predict(const simulation::ForwardModel& model, std::size_t i, double light) const {
  return rows_of(signals(model, pixels_, i, scaled_reflectivity(pose_of(conditions_[i]), light)), ideal_[i], i);
}

std::vector<Signal> Design::photograph(const simulation::ForwardModel& model, std::size_t i, double light) const {
  return signals(model, whole_, i, scaled_reflectivity(pose_of(conditions_[i]), light));
}

std::vector<double> Design::rows_of(const std::vector<Signal>& seen, const std::vector<Signal>& ideal,
                                    std::size_t i) const {
  const double scale = physics::metres_per_radian(shots_[i].condition.modulation_frequency);
  const std::size_t n = superpixels();
  std::vector<double> rows(observables * n);
  for (std::size_t s = 0; s < n; ++s) {
    const Signal &now = seen[s], &base = ideal[s];
    const std::complex<double> ratio = now.phasor / base.phasor;
    const double gain = std::sqrt(std::norm(ratio));  // much faster than std::abs; no overflow is possible here
    rows[distance * n + s] = scale * std::arg(ratio);
    rows[amplitude * n + s] = std::log(gain);
    rows[intensity * n + s] = std::log(now.intensity / base.intensity);
    rows[null1 * n + s] = now.null1 / (2 * base.intensity * gain);
    rows[null2 * n + s] = now.null2 / std::sqrt(std::norm(now.phasor));
  }
  return rows;
}

std::vector<double> Design::predict_finely(const simulation::ForwardModel& model, std::size_t i, double light,
                                           bool every_pixel) const {
  if (grid_ == single) return predict(model, i, light);
  const simulation::Pixels& pixels = every_pixel ? whole_ : fine_;
  const std::vector<Signal> seen = signals(model, pixels, i, scaled_reflectivity(pose_of(conditions_[i]), light));
  const std::vector<Signal> base = ideal_signals(pixels, i);
  struct Sums {
    std::complex<double> product;
    double square = 0, amplitude = 0, lengths = 0, intensity = 0, base_intensity = 0, null1 = 0, null2 = 0;
  };
  const std::size_t n = superpixels();
  std::vector<Sums> all(n);
  for (std::size_t p = 0; p < base.size(); ++p) {
    if (!std::isfinite(seen[p].intensity) || !(std::abs(base[p].phasor) > 0)) continue;
    Sums& sums = all[superpixel_of(p, pixels.rows, pixels.columns, grid_)];
    sums.product += seen[p].phasor * std::conj(base[p].phasor);
    sums.square += std::norm(base[p].phasor);
    sums.lengths += std::abs(seen[p].phasor) * std::abs(base[p].phasor);
    sums.amplitude += std::abs(base[p].phasor);
    sums.intensity += seen[p].intensity;
    sums.base_intensity += base[p].intensity;
    sums.null1 += seen[p].null1;
    sums.null2 += seen[p].null2;
  }
  const double scale = physics::metres_per_radian(shots_[i].condition.modulation_frequency);
  std::vector<double> rows(observables * n);
  for (std::size_t s = 0; s < n; ++s) {
    const Sums& sums = all[s];
    const std::complex<double> ratio = sums.product / sums.square;
    const double gain = sums.lengths / sums.square;  // mean of the pixels: differing phases lose no amplitude
    rows[distance * n + s] = scale * std::arg(ratio);
    rows[amplitude * n + s] = std::log(gain);
    rows[intensity * n + s] = std::log(sums.intensity / sums.base_intensity);
    rows[null1 * n + s] = sums.null1 / (2 * sums.base_intensity * gain);
    rows[null2 * n + s] = sums.null2 / (sums.amplitude * gain);
  }
  return rows;
}

std::set<double> Design::levels(double io::Condition::*setting) const {
  std::set<double> levels;
  for (const io::Condition& c : conditions_)
    if (!c.is_capped()) levels.insert(c.*setting);
  return levels;
}

double Design::incidence(std::size_t i, std::size_t s) const {
  const simulation::BoardPose pose = pose_of(conditions_[i]);
  const physics::Plane plane = physics::board(pose.distance, pose.tilt_x, pose.tilt_y);
  return std::abs(physics::dot(plane.normal, pixels_.rays[s]));
}

}  // namespace tofgraph::diagnosis
