// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/forward_model.hpp"

#include "physics/constants.hpp"
#include "physics/lens.hpp"
#include "physics/reflectance.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tofgraph::simulation {
namespace {

using Complex = std::complex<double>;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Memory that is written before it is read need not be cleared first: there is much of it.
template <class T> struct Uncleared : std::allocator<T> {
  template <class U> struct rebind { using other = Uncleared<U>; };
  template <class U> void construct(U* place) { ::new (static_cast<void*>(place)) U; }
  template <class U, class... Arguments> void construct(U* place, Arguments&&... arguments) {
    ::new (static_cast<void*>(place)) U(std::forward<Arguments>(arguments)...);
  }
};
using Doubles = std::vector<double, Uncleared<double>>;

/// e^(j angle) * p, exactly for whole quarter turns from k pi/2.
Complex turned(Complex p, double angle, std::size_t k) {
  if (angle == static_cast<double>(k) * (std::numbers::pi / 2)) {
    constexpr std::array<Complex, 4> quarters = {Complex{1, 0}, Complex{0, 1}, Complex{-1, 0}, Complex{0, -1}};
    const Complex q = quarters[k];
    return {p.real() * q.real() - p.imag() * q.imag(), p.real() * q.imag() + p.imag() * q.real()};
  }
  return p * std::polar(1.0, angle);
}

/// The points of a shot: the pixels' centres, then the rays of those pixels that lie on an edge.
struct Points {
  Doubles pixel, ray, position, normal, reflected, inside, reflectivity;
  std::vector<const Surface*, Uncleared<const Surface*>> surface;
  std::size_t size() const { return reflected.size(); }

  void resize(std::size_t n) {
    pixel.resize(2 * n);
    for (Doubles* triple : {&ray, &position, &normal}) triple->resize(3 * n);
    for (Doubles* single : {&reflected, &inside, &reflectivity}) single->resize(n);
    surface.resize(n);
  }
  void set(std::size_t i, double u, double v, Vector3 along, const Hit& hit, double focal_length) {
    const bool there = std::isfinite(hit.reflected);
    pixel[2 * i] = u;
    pixel[2 * i + 1] = v;
    const auto put = [i](Doubles& to, Vector3 value) {
      to[3 * i] = value.x;
      to[3 * i + 1] = value.y;
      to[3 * i + 2] = value.z;
    };
    put(ray, along);
    put(position, there ? hit.point : Vector3{});
    put(normal, hit.normal);
    reflected[i] = there ? hit.reflected : 0;
    inside[i] = focal_length / along.z;
    reflectivity[i] = there ? hit.reflectivity : 0;
    surface[i] = hit.surface;
  }
  Vector3 position_of(std::size_t i) const { return {position[3 * i], position[3 * i + 1], position[3 * i + 2]}; }
  Vector3 normal_of(std::size_t i) const { return {normal[3 * i], normal[3 * i + 1], normal[3 * i + 2]}; }
  Vector3 ray_of(std::size_t i) const { return {ray[3 * i], ray[3 * i + 1], ray[3 * i + 2]}; }
};

/// One source's light, per point.
struct SourceArrays {
  Doubles path;
  std::vector<double> strength;
  std::vector<Complex> phasor;
};

/// A pixel and a neighbour see different things: another object, another reflectivity, a crease or a step.
bool differ(const Hit& a, const Hit& b) {
  const bool there = std::isfinite(a.reflected);
  if (there != std::isfinite(b.reflected)) return true;
  if (!there) return false;
  return a.object != b.object || a.reflectivity != b.reflectivity || physics::dot(a.normal, b.normal) < 0.95 ||
         std::abs(a.reflected - b.reflected) > 0.03 * std::min(a.reflected, b.reflected);
}

std::vector<std::size_t> edge_pixels(const std::vector<Hit>& hits, std::size_t rows, std::size_t columns) {
  std::vector<char> on_edge(hits.size(), 0);
  bool any = false;
  const auto compare = [&](std::size_t i, std::size_t j) {
    if (!differ(hits[i], hits[j])) return;
    on_edge[i] = on_edge[j] = 1;
    any = true;
  };
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t i = r * columns + c;
      if (c + 1 < columns) compare(i, i + 1);
      if (r + 1 < rows) compare(i, i + columns);
    }
  }
  std::vector<std::size_t> edges;
  for (std::size_t i = 0; any && i < hits.size(); ++i) {
    if (on_edge[i] != 0) edges.push_back(i);
  }
  return edges;
}

}  // namespace

/// The evaluation of one shot; the border's state is its base, so that a call from an effect finds its way back.
class ForwardModel::Evaluation : public tofgraph_light_state {
 public:
  Evaluation(const ForwardModel& model, const Tracer& tracer, const Shot& shot, const Pixels& pixels,
             const BoardChange& moved)
      : tofgraph_light_state{}, model_(model), tracer_(tracer), shot_(shot), pixels_(pixels), moved_(moved) {
    size = sizeof(tofgraph_light_state);
    source_size = sizeof(tofgraph_source_light);
    camera = &model.camera_;
    condition = &shot.condition;
    physical = model.physical_ ? 1 : 0;
    rows = pixels.rows;
    columns = pixels.columns;
    spacing = pixels.spacing;
    noise_factor = 1;
    for (std::size_t k = 0; k < 4; ++k) step[k] = static_cast<double>(k) * (std::numbers::pi / 2);
  }

  /// Geometry and phasor level: light_ and strength_ of each pixel.
  void shine() {
    place_sources();
    apply_level(TOFGRAPH_GEOMETRY);
    trace();
    emit();
    for (std::size_t e = 0; e < model_.effects_.size(); ++e) {
      const Effect& effect = *model_.effects_[e];
      if (effect.level() != TOFGRAPH_PHASOR || effect.late()) continue;
      if (effect.looks_at_neighbours()) merge_edges();
      effect.apply(*this);
    }
    merge_edges();
    sum();
    for (const EffectPtr& effect : model_.effects_) {
      if (effect->level() == TOFGRAPH_PHASOR && effect->late()) effect->apply(*this);
    }
    for (std::size_t i = 0; i < light_.size(); ++i) {
      if (turns_[i] != 0 && light_[i] != Complex{}) light_[i] *= std::polar(1.0, turns_[i]);
    }
  }

  /// Samples and taps, up to the noise.
  Expectation develop() {
    const std::size_t n = pixels_.size();
    for (std::size_t k = 0; k < 4; ++k) {
      exposures_.insert(exposures_.end(), light_.begin(), light_.end());
      intensities_.insert(intensities_.end(), strength_.begin(), strength_.end());
    }
    extras_.assign(4 * n, 0);
    exposure = reinterpret_cast<double*>(exposures_.data());
    intensity = intensities_.data();
    extra = extras_.data();
    displace = [](tofgraph_light_state* state, std::uint32_t k, double displacement) {
      return static_cast<Evaluation*>(state)->move_exposure(k, displacement);
    };
    if (shot_.moving) {
      for (std::size_t k = 1; k < 4; ++k) {
        changes_[k].time = static_cast<double>(k) / (4 * camera->frame_rate);
        shine_again(k);
      }
    }
    apply_level(TOFGRAPH_SAMPLES);
    Expectation result;
    expose(result);
    result.hits = std::move(hits_);
    return result;
  }

  /// Only what effects on the taps need.
  void use_taps(std::span<double> values) {
    points = pixels_.size();
    taps = values.data();
    pixel = pixels_.at.data();
  }

 private:
  void apply_level(std::uint32_t level) {
    for (const EffectPtr& effect : model_.effects_) {
      if (effect->level() == level) effect->apply(*this);
    }
  }

  void place_sources() {
    const std::size_t n = camera->light_count;
    for (std::size_t s = 0; s < n; ++s) {
      const tofgraph_light& light = camera->lights[s];
      const bool on = shot_.on.empty() || shot_.on[s];
      borders_.push_back({light.name,
                          {light.position[0], light.position[1], light.position[2]},
                          on ? 1.0 : 0.0,
                          nullptr,
                          nullptr,
                          nullptr});
    }
    borders_.push_back({"", {0, 0, 0}, 1, nullptr, nullptr, nullptr});
    sources = borders_.data();
    source_count = static_cast<std::uint32_t>(n);  // the inside has no place
    scale = offset = tilt[0] = tilt[1] = 0;
  }

  Vector3 ray_at(const physics::Lens& lens, double u, double v) const {
    const auto p = physics::image_point(*camera, lens, u - principal_point[0], v - principal_point[1]);
    const Vector3 along = p ? Vector3{p->x, p->y, 1} : Vector3{nan, nan, nan};
    return (1 / physics::norm(along)) * along;
  }

  void trace_rays(const std::vector<Vector3>& rays, std::vector<Hit>& hits) const {
    BoardChange change = moved_;
    change.scale = 1 + scale;
    change.offset = offset;
    change.tilt_x = tilt[0];
    change.tilt_y = tilt[1];
    hits.assign(rays.size(), {});
    tracer_(change, rays, hits);
  }

  void trace() {
    const bool other_lens = std::ranges::any_of(distortion, [](double d) { return d != 0; }) ||
                            principal_point[0] != 0 || principal_point[1] != 0;
    double coefficients[5];
    for (std::size_t i = 0; i < 5; ++i) coefficients[i] = camera->distortion[i] + distortion[i];
    const physics::Lens lens(coefficients);
    std::vector<Vector3> bent;
    for (std::size_t i = 0; other_lens && i < pixels_.size(); ++i)
      bent.push_back(ray_at(lens, pixels_.at[2 * i], pixels_.at[2 * i + 1]));
    const std::vector<Vector3>& rays = other_lens ? bent : pixels_.rays;
    trace_rays(rays, hits_);
    points_.resize(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i)
      points_.set(i, pixels_.at[2 * i], pixels_.at[2 * i + 1], rays[i], hits_[i], camera->focal_length);
    if (model_.edge_samples_ > 1 && spacing == 1) add_edges(lens);
    points = points_.size();
    pixel = points_.pixel.data();
    ray = points_.ray.data();
    position = points_.position.data();
    normal = points_.normal.data();
    reflected = points_.reflected.data();
    inside = points_.inside.data();
    reflectivity = points_.reflectivity.data();
  }

  void add_edges(const physics::Lens& lens) {
    edges_ = edge_pixels(hits_, rows, columns);
    const std::size_t n = model_.edge_samples_;
    std::vector<Vector3> rays;
    std::vector<double> at;
    for (const std::size_t i : edges_) {
      for (std::size_t s = 0; s < n * n; ++s) {
        const double u = pixels_.at[2 * i] + (static_cast<double>(s % n) + 0.5) / static_cast<double>(n) - 0.5;
        const double v = pixels_.at[2 * i + 1] + (static_cast<double>(s / n) + 0.5) / static_cast<double>(n) - 0.5;
        at.insert(at.end(), {u, v});
        rays.push_back(ray_at(lens, u, v));
      }
    }
    std::vector<Hit> hits;
    trace_rays(rays, hits);
    const std::size_t first = points_.size();
    points_.resize(first + rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i)
      points_.set(first + i, at[2 * i], at[2 * i + 1], rays[i], hits[i], camera->focal_length);
  }

  /// Every source's light at every point: formats of `light: reference` and `light: physical`.
  void emit() {
    const std::size_t n = points_.size(), lights = camera->light_count;
    arrays_.resize(lights + 1);
    for (SourceArrays& a : arrays_) {
      a.strength.assign(n, 0);
      a.phasor.assign(n, {});
    }
    double all = 0;
    for (std::size_t s = 0; s < lights; ++s) all += camera->lights[s].amplitude;
    const bool dark = (shot_.condition.flags & TOFGRAPH_LENS_CAPPED) != 0;
    for (std::size_t s = 0; s < lights; ++s) {
      arrays_[s].path.resize(n);
      const Vector3 place{borders_[s].position[0], borders_[s].position[1], borders_[s].position[2]};
      for (std::size_t i = 0; i < n; ++i) arrays_[s].path[i] = physics::norm(points_.position_of(i) - place);
    }
    if (!dark) {
      for (std::size_t i = 0; i < n; ++i) {
        if (points_.reflected[i] > 0) emit_at(i, all);
      }
    }
    for (std::size_t s = 0; s <= lights; ++s) {
      borders_[s].path = s < lights ? arrays_[s].path.data() : nullptr;
      borders_[s].phasor = reinterpret_cast<double*>(arrays_[s].phasor.data());
      borders_[s].strength = arrays_[s].strength.data();
    }
    source_count = static_cast<std::uint32_t>(lights + 1);
    turns_.assign(n, 0);
    turn = turns_.data();
  }

  void emit_at(std::size_t i, double all) {
    const std::size_t lights = camera->light_count;
    const double common = points_.reflected[i] + points_.inside[i];
    const double amount = camera->gain * points_.reflectivity[i] * shot_.condition.integration_time;
    const double radians_per_metre = physics::two_pi * shot_.condition.modulation_frequency / physics::speed_of_light;
    double mean = 0, weights = 0;
    for (std::size_t s = 0; s < lights; ++s) {
      const double weight = borders_[s].on * camera->lights[s].amplitude;
      mean += weight * arrays_[s].path[i];
      weights += weight;
    }
    const double travelled = mean / weights + common;
    for (std::size_t s = 0; s < lights; ++s) {
      const double weight = borders_[s].on * camera->lights[s].amplitude / all;
      if (weight == 0) continue;
      const double path = arrays_[s].path[i];
      double strength = weight * amount / (travelled * travelled);
      if (physical != 0) {
        const double view = points_.ray[3 * i + 2], view2 = view * view;
        strength = weight * amount * incidence(s, i) / (4 * path * path) * view2 * view2;
      }
      if (points_.surface[i] != nullptr) strength = finish_of(s, i, strength);
      arrays_[s].strength[i] = strength;
      arrays_[s].phasor[i] = std::polar(strength, radians_per_metre * (path + common));
    }
  }

  Vector3 to_source(std::size_t s, std::size_t i) const {
    const Vector3 place{borders_[s].position[0], borders_[s].position[1], borders_[s].position[2]};
    return (1 / arrays_[s].path[i]) * (place - points_.position_of(i));
  }
  /// cos(theta_i); 0 from behind.
  double incidence(std::size_t s, std::size_t i) const {
    return std::max(0.0, physics::dot(to_source(s, i), points_.normal_of(i)));
  }

  /// A surface that is not Lambert's: its factor, and its gloss, which does not depend on the reflectivity.
  double finish_of(std::size_t s, std::size_t i, double strength) const {
    const Surface& surface = *points_.surface[i];
    const Vector3 light = to_source(s, i), view = -1.0 * points_.ray_of(i), normal = points_.normal_of(i);
    const double white = points_.reflectivity[i] > 0 ? strength / points_.reflectivity[i] : 0;
    const double rough = surface.roughness > 0 ? physics::oren_nayar(surface.roughness, normal, light, view) : 1;
    const Vector3 half = light + view;
    const double along = std::max(0.0, physics::dot(normal, half) / physics::norm(half));
    return strength * rough + white * surface.specular * std::pow(along, surface.exponent);
  }

  /// Each pixel on an edge becomes the mean of its rays; from then on the points are the pixels.
  void merge_edges() {
    const std::size_t n = pixels_.size(), each = model_.edge_samples_ * model_.edge_samples_;
    points = n;
    for (SourceArrays& a : arrays_) {
      for (std::size_t e = 0; e < edges_.size(); ++e) {
        Complex phasor;
        double strength_sum = 0;
        for (std::size_t s = 0; s < each; ++s) {
          phasor += a.phasor[n + e * each + s];
          strength_sum += a.strength[n + e * each + s];
        }
        a.phasor[edges_[e]] = phasor / static_cast<double>(each);
        a.strength[edges_[e]] = strength_sum / static_cast<double>(each);
      }
    }
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      double turn_sum = 0;
      for (std::size_t s = 0; s < each; ++s) turn_sum += turns_[n + e * each + s];
      turns_[edges_[e]] = turn_sum / static_cast<double>(each);
    }
    edges_.clear();
  }

  /// All light together: what late effects look at.
  void sum() {
    const std::size_t n = pixels_.size();
    light_.assign(n, {});
    strength_.assign(n, 0);
    distances_.assign(n, 0);
    amplitudes_.resize(n);
    std::vector<double> weights(n, 0);
    for (std::size_t s = 0; s < arrays_.size(); ++s) {
      const SourceArrays& a = arrays_[s];
      for (std::size_t i = 0; i < n; ++i) {
        light_[i] += a.phasor[i];
        strength_[i] += a.strength[i];
        if (s == camera->light_count) continue;
        const double half_path = (a.path[i] + points_.reflected[i] + points_.inside[i]) / 2;
        distances_[i] += a.strength[i] * half_path;
        weights[i] += a.strength[i];
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      if (weights[i] > 0) distances_[i] /= weights[i];
      amplitudes_[i] = std::sqrt(std::norm(light_[i]));
      strength_[i] /= 2 * camera->contrast;
    }
    amplitude = amplitudes_.data();
    distance = distances_.data();
  }

  /// Exposure k sees the scene as changes_[k] says: what effects made of its light before stays, in proportion.
  void shine_again(std::size_t k) {
    Evaluation other(model_, tracer_, shot_, pixels_, changes_[k]);
    other.shine();
    const std::size_t n = pixels_.size();
    if (clean_[k].empty()) {
      clean_[k] = light_;
      clean_strength_[k] = strength_;
    }
    for (std::size_t i = 0; i < n; ++i) {
      Complex& now = exposures_[k * n + i];
      now = clean_[k][i] != Complex{} ? now * (other.light_[i] / clean_[k][i]) : other.light_[i];
      double& amount = intensities_[k * n + i];
      amount = clean_strength_[k][i] > 0 ? amount * (other.strength_[i] / clean_strength_[k][i]) : other.strength_[i];
    }
    clean_[k] = std::move(other.light_);
    clean_strength_[k] = std::move(other.strength_);
  }

  int move_exposure(std::uint32_t k, double displacement) noexcept {
    if (k > 3) return TOFGRAPH_ERROR;
    if (displacement == 0) return TOFGRAPH_OK;
    try {
      changes_[k].displacement += displacement;
      shine_again(k);
      return TOFGRAPH_OK;
    } catch (const std::exception&) {
      return TOFGRAPH_ERROR;
    }
  }

  void expose(Expectation& result) {
    const std::size_t n = pixels_.size();
    result.taps.resize(8 * n);
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t i = 0; i < n; ++i) {
        double c = turned(exposures_[k * n + i], step[k], k).real() + extras_[k * n + i];
        if (std::isnan(pixels_.rays[i].z)) c = nan;
        const double mean = intensities_[k * n + i];
        result.taps[2 * k * n + i] = mean + c / 2;
        result.taps[(2 * k + 1) * n + i] = mean - c / 2;
      }
    }
    taps = result.taps.data();
    for (std::size_t e = 0; e < model_.first_readout_; ++e) {
      if (model_.effects_[e]->level() == TOFGRAPH_TAPS) model_.effects_[e]->apply(*this);
    }
    if (model_.has_readout()) {  // one after the readout may still set the noise
      std::vector<double> copy = result.taps;
      taps = copy.data();
      for (std::size_t e = model_.first_readout_; e < model_.effects_.size(); ++e) model_.effects_[e]->apply(*this);
    }
    result.noise_factor = noise_factor;
  }

  const ForwardModel& model_;
  const Tracer& tracer_;
  const Shot& shot_;
  const Pixels& pixels_;
  const BoardChange moved_;
  std::vector<tofgraph_source_light> borders_;
  std::vector<SourceArrays> arrays_;
  Points points_;
  std::vector<Hit> hits_;
  std::vector<std::size_t> edges_;
  std::vector<double> turns_, strength_, distances_, intensities_, extras_;
  Doubles amplitudes_;
  std::vector<Complex> light_, exposures_;
  std::array<std::vector<Complex>, 4> clean_;
  std::array<std::vector<double>, 4> clean_strength_;
  std::array<BoardChange, 4> changes_{};
};

ForwardModel::ForwardModel(const tofgraph_camera& camera, bool physical, std::vector<EffectPtr> effects,
                           std::size_t edge_samples)
    : camera_(camera), physical_(physical), effects_(std::move(effects)), edge_samples_(edge_samples) {
  static_cast<void>(physics::geometry_of(camera));  // says what is missing
  const auto need = [&](double value, const char* what) {
    if (value > 0) return;
    throw std::invalid_argument(std::string("the profile of the camera '") + camera.name + "' has no " + what);
  };
  need(camera.gain, "gain, e.g. gain: 7.0e6 counts m^2/s");
  need(camera.contrast, "contrast, e.g. contrast: 0.5");
  need(camera.modulation_frequency, "modulation_frequency, e.g. modulation_frequency: 20 MHz");
  std::ranges::stable_sort(effects_, {}, [](const EffectPtr& e) { return e->level(); });
  const auto readout =
      std::ranges::find_if(effects_, [](const EffectPtr& e) { return e->level() == TOFGRAPH_TAPS && e->late(); });
  first_readout_ = static_cast<std::size_t>(readout - effects_.begin());
}

Expectation ForwardModel::expect(const Tracer& tracer, const Shot& shot, const Pixels& pixels) const {
  Evaluation evaluation(*this, tracer, shot, pixels, {});
  evaluation.shine();
  return evaluation.develop();
}

void ForwardModel::read_out(const Shot& shot, const Pixels& pixels, std::span<double> taps) const {
  static const Tracer nothing;
  Evaluation evaluation(*this, nothing, shot, pixels, {});
  evaluation.use_taps(taps);
  for (std::size_t e = first_readout_; e < effects_.size(); ++e) effects_[e]->apply(evaluation);
}

}  // namespace tofgraph::simulation
