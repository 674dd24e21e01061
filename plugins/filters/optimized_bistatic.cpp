// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Distance to depth by the optimized bistatic model, any number of sources anywhere.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/optimized_bistatic.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <hwy/highway.h>
#include <tofgraph/stage.hpp>

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>

#include "physics/non_linearity.hpp"

#ifndef TOFGRAPH_OPTIMIZED_BISTATIC_ONCE
#define TOFGRAPH_OPTIMIZED_BISTATIC_ONCE
namespace tofgraph {

/// A source's constants in single precision. With u the pixel's ray, L the lens centre, b = L - S:
struct BistaticSource {
  float weight, square;  // share of the light, |b|^2
  const float* along;    // a pixel: u . b
};

/// What is the same for all sources.
struct BistaticCamera {
  float focal_length, closest, mean_square;  // f, mean |b|, mean |b|^2
  const float* sensor_path;                  // a pixel: D_sen
  const float* foreshortening;               // a pixel: 1 - cos(theta)
};

/// A frame's images; sigma may be null.
struct BistaticImages {
  const float* distance;
  float* depth;
  float* sigma;          // of the distance; becomes that of the depth
  std::uint16_t* flags;  // read and combined
  std::size_t pixels;
};

}  // namespace tofgraph
#endif

// How single precision keeps 2 um at 7.4 m, where it resolves 0.5 um: nothing of the size of D is subtracted. The
// unknown is the small e = D_ref - D (about minus half the distance from sensor to sources), and D_i enters as
// t_i = D_i - D_ref = (2 D_ref u.b_i + |b_i|^2) / (D_i + D_ref), equally small. The equation of the model,
// mean(D_i) + D_ref + D_sen = 2 D, then reads 2 e + D_sen + mean(t_i) = 0, and z = D + (f + e cos(theta) - D (1 -
// cos(theta))).
HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// What a solver knows of a vector of pixels: e, and 1 / (d 2D / d D_ref) there.
template <class V>
struct Solution {
  V e, slope;
};

/// All that a vector of pixels is computed from, but for its place.
struct Inputs {
  BistaticCamera camera;
  const BistaticSource* sources;
  std::size_t count;
  BistaticImages images;
};

/// The closed form for one source, written for e; for several that of a source at their root mean square path.
template <class D, class V = hn::Vec<D>>
HWY_INLINE Solution<V> Start(D d, const Inputs& in, std::size_t i) {
  const V distance = hn::LoadU(d, in.images.distance + i), sensor = hn::LoadU(d, in.camera.sensor_path + i);
  V along = hn::Zero(d);
  for (std::size_t s = 0; s < in.count; ++s) {
    along = hn::MulAdd(hn::Set(d, in.sources[s].weight), hn::LoadU(d, in.sources[s].along + i), along);
  }
  const V path = hn::Sub(hn::Add(distance, distance), sensor);
  const V inverse = hn::Div(hn::Set(d, 1.0F), hn::Add(path, along));
  const V constant = hn::Mul(hn::Set(d, 0.5F), hn::MulSub(sensor, sensor, hn::Set(d, in.camera.mean_square)));
  const V e = hn::Mul(hn::NegMulAdd(distance, hn::Add(sensor, along), constant), inverse);
  return {e, hn::Mul(hn::Sub(path, hn::Add(distance, e)), inverse)};
}

/// Newton's steps from e to the solution. @returns where there is one
template <class D, class V = hn::Vec<D>>
HWY_INLINE hn::Mask<D> Refine(D d, const Inputs& in, std::size_t i, hn::Mask<D> valid, Solution<V>& solution) {
  const V distance = hn::LoadU(d, in.images.distance + i), sensor = hn::LoadU(d, in.camera.sensor_path + i);
  const V one = hn::Set(d, 1.0F);
  auto pending = valid;
  constexpr int most_steps = 30;  // one or two, unless sources stand between the camera and the surface
  for (int step = 0; step < most_steps && !hn::AllFalse(d, pending); ++step) {
    const V reflected = hn::Add(distance, solution.e);
    V rest = hn::Add(hn::Add(solution.e, solution.e), sensor), rise = one;
    V nearest = hn::Set(d, hwy::HighestValue<float>());
    for (std::size_t s = 0; s < in.count; ++s) {
      const V along = hn::LoadU(d, in.sources[s].along + i), weight = hn::Set(d, in.sources[s].weight);
      const V n = hn::MulAdd(hn::Add(reflected, reflected), along, hn::Set(d, in.sources[s].square));
      const V path = hn::Sqrt(hn::MulAdd(reflected, reflected, n));  // D_i
      const V both = hn::Add(path, reflected);
      const V q = hn::Div(weight, hn::Mul(path, both));
      rest = hn::MulAdd(hn::Mul(n, path), q, rest);
      rise = hn::MulAdd(hn::Mul(hn::Add(reflected, along), both), q, rise);
      nearest = hn::Min(nearest, path);
    }
    solution.slope = hn::Div(one, rise);
    const V change = hn::Mul(rest, solution.slope);
    solution.e = hn::Sub(solution.e, change);
    // Newton leaves at most about change^2 / (2 nearest): the step was the last one when that is below 50 nm.
    const auto close = hn::Le(hn::Mul(change, change), hn::Mul(nearest, hn::Set(d, 1e-7F)));
    pending = hn::AndNot(close, pending);
  }
  return hn::AndNot(pending, valid);
}

/// Where there can be a solution: no invalid pixel, not nearer than the lens centre, no NaN (which compares as false).
template <class D>
HWY_INLINE hn::Mask<D> Solvable(D d, const Inputs& in, std::size_t i) {
  const hn::RebindToSigned<D> di;
  const auto distance = hn::LoadU(d, in.images.distance + i), sensor = hn::LoadU(d, in.camera.sensor_path + i);
  const auto far = hn::Lt(hn::Add(sensor, hn::Set(d, in.camera.closest)), hn::Add(distance, distance));
  const auto finite = hn::Lt(distance, hn::Set(d, hwy::HighestValue<float>()));
  const auto flags = hn::PromoteTo(di, hn::LoadU(hn::Rebind<std::uint16_t, D>(), in.images.flags + i));
  const auto good = hn::Eq(hn::And(flags, hn::Set(di, flag::invalid)), hn::Zero(di));
  return hn::And(hn::And(far, finite), hn::RebindMask(d, good));
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE void Finish(D d, const Inputs& in, std::size_t i, hn::Mask<D> valid, const Solution<V>& solution) {
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::uint16_t, D> du16;
  const V distance = hn::LoadU(d, in.images.distance + i), shortened = hn::LoadU(d, in.camera.foreshortening + i);
  const V cosine = hn::Sub(hn::Set(d, 1.0F), shortened);
  const V offset = hn::MulAdd(solution.e, cosine, hn::Set(d, in.camera.focal_length));
  const V depth = hn::Add(distance, hn::NegMulAdd(distance, shortened, offset));
  hn::StoreU(hn::IfThenElse(valid, depth, hn::NaN(d)), d, in.images.depth + i);
  if (in.images.sigma != nullptr) {
    const V slope = hn::Mul(hn::Add(cosine, cosine), solution.slope);  // dz/dD
    const V sigma = hn::Mul(hn::LoadU(d, in.images.sigma + i), slope);
    hn::StoreU(hn::IfThenElse(valid, sigma, hn::NaN(d)), d, in.images.sigma + i);
  }
  auto flags = hn::PromoteTo(di, hn::LoadU(du16, in.images.flags + i));
  const auto invalid = hn::RebindMask(di, hn::Not(valid)), outside = hn::RebindMask(di, hn::IsNaN(shortened));
  flags = hn::Or(flags, hn::IfThenElseZero(invalid, hn::Set(di, flag::invalid)));
  flags = hn::Or(flags, hn::IfThenElseZero(outside, hn::Set(di, flag::outside_lens)));
  hn::StoreU(hn::DemoteTo(du16, flags), du16, in.images.flags + i);
}

/// Pixels from `begin` on, whole vectors below `end`, in two sweeps: the chain from the start to the solution is too
/// long for the processor to overlap many pixels. The depth holds e in between. @returns the first pixel not done
template <bool ClosedForm, class D>
HWY_INLINE std::size_t SolveSome(D d, const Inputs& in, std::size_t begin, std::size_t end) {
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = begin;
  for (; !ClosedForm && i + lanes <= end; i += lanes) hn::StoreU(Start(d, in, i).e, d, in.images.depth + i);
  for (i = begin; i + lanes <= end; i += lanes) {
    auto valid = Solvable(d, in, i);
    if constexpr (ClosedForm) {
      Finish(d, in, i, valid, Start(d, in, i));
    } else {
      Solution<hn::Vec<D>> solution{hn::LoadU(d, in.images.depth + i), hn::Zero(d)};
      valid = Refine(d, in, i, valid, solution);
      Finish(d, in, i, valid, solution);
    }
  }
  return i;
}

/// @param Sources their number where it is worth a copy of the code, so that constants stay in registers; else 0
template <std::size_t Sources>
void SolveAll(const BistaticCamera& camera, std::span<const BistaticSource> all, const BistaticImages& images) {
  BistaticSource some[Sources + 1];
  std::copy_n(all.begin(), Sources, some);
  const Inputs in{camera, Sources != 0 ? some : all.data(), Sources != 0 ? Sources : all.size(), images};
  constexpr std::size_t chunk = 512;  // stays in the nearest cache between the sweeps
  for (std::size_t i = 0; i < images.pixels;) {
    const std::size_t end = std::min(i + chunk, images.pixels);
    i = SolveSome<Sources == 1>(hn::ScalableTag<float>(), in, i, end);
    i = SolveSome<Sources == 1>(hn::CappedTag<float, 1>(), in, i, end);
  }
}

void Solve(const BistaticCamera& camera, std::span<const BistaticSource> sources, const BistaticImages& images) {
  if (sources.size() == 1)
    SolveAll<1>(camera, sources, images);
  else if (sources.size() == 2)
    SolveAll<2>(camera, sources, images);
  else
    SolveAll<0>(camera, sources, images);
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tofgraph {

HWY_EXPORT(Solve);

/// Solves mean_i |L + D_ref u - S_i| + D_ref + D_sen = 2 D for D_ref, equations (5.111), (5.125); the mean is weighted
/// by the sources' amplitudes; z = D_ref cos(theta) + f. A distance below that of a surface at the lens centre has no
/// solution and becomes invalid; one beyond the unambiguous range (after unwrapping or an offset) is solved like any
/// other.
struct OptimizedBistatic final : Filter {
  In<float> distance{this, "distance", {.text = "half of the travelled path"}};
  Out<float> depth{
      this, "depth", {.text = "along z from the sensor plane", .from = "distance rays", .adds = "non_linearity"}};
  InOut<float> sigma{
      this, "sigma", {.text = "of the distance, becomes that of the depth", .optional = true, .of = "depth"}};
  InOut<std::uint16_t> flags{this, "flags", {.text = "made, or combined with those that arrive", .optional = true}};
  Param<Choice> solver{this,
                       "solver",
                       {.fallback = "newton",
                        .choices = "newton closed_form bisection",
                        .text = "newton: any number of sources; closed_form: exact, for one source only; "
                                "bisection: the slow reference in double precision"}};

  void prepare(Setup& setup) {
    const tofgraph_camera& camera = setup.camera();
    geometry_ = physics::geometry_of(camera);
    if (*solver == "closed_form" && geometry_.sources.size() != 1) {
      throw ConfigError("solver", "closed_form is for one source, the camera '" + std::string(camera.name) + "' has " +
                                      std::to_string(geometry_.sources.size()) + ": write solver: newton");
    }
    if (sigma.present() && setup.find("sigma")->of != std::string_view("distance")) {
      throw std::runtime_error(std::string("sigma is that of '") + setup.find("sigma")->of +
                               "', expected that of 'distance'");
    }
    flags.provide(setup);
    columns_ = camera.width;
    rows_ = camera.height;
    for (std::size_t i = 0; i < rows_ * columns_; ++i) rays_.push_back(physics::unit_ray(camera.rays + 3 * i));
    if (*solver != "bisection") make_tables();
  }

  void process(Frame& frame) const {
    const Array<const float> measured = distance(frame);
    if (measured.rows() != rows_ || measured.columns() != columns_) {
      throw std::runtime_error("distance is " + std::to_string(measured.rows()) + " x " +
                               std::to_string(measured.columns()) + ", the camera has " + std::to_string(rows_) +
                               " x " + std::to_string(columns_));
    }
    const BistaticImages images{.distance = measured.data(),
                                .depth = depth(frame, rows_, columns_).data(),
                                .sigma = sigma(frame).data(),
                                .flags = flags(frame, rows_, columns_).data(),
                                .pixels = measured.size()};
    if (*solver == "bisection")
      bisect(images);
    else
      HWY_DYNAMIC_DISPATCH(Solve)(camera_, sources_, images);
  }

 private:
  void make_tables() {
    const std::size_t pixels = rays_.size();
    along_.resize(pixels * geometry_.sources.size());
    double closest = 0, mean_square = 0;
    for (float* along = along_.data(); const auto& [position, weight] : geometry_.sources) {
      const physics::Vector3 b = geometry_.lens_centre() - position;
      closest += weight * physics::norm(b);
      mean_square += weight * physics::dot(b, b);
      sources_.push_back({static_cast<float>(weight), static_cast<float>(physics::dot(b, b)), along});
      for (const physics::Vector3& ray : rays_) *along++ = static_cast<float>(physics::dot(ray, b));
    }
    for (const physics::Vector3& ray : rays_) {
      sensor_path_.push_back(static_cast<float>(physics::sensor_path(geometry_, ray)));
      // 1 - cos, without the cancellation near the axis
      foreshortening_.push_back(static_cast<float>((ray.x * ray.x + ray.y * ray.y) / (1 + ray.z)));
    }
    camera_ = {static_cast<float>(geometry_.focal_length), static_cast<float>(closest), static_cast<float>(mean_square),
               sensor_path_.data(), foreshortening_.data()};
  }

  void bisect(const BistaticImages& images) const {
    for (std::size_t i = 0; i < images.pixels; ++i) {
      const double measured = (images.flags[i] & flag::invalid) == 0 ? images.distance[i] : std::nan("");
      const double reflected = physics::optimized_bistatic_bisection(geometry_, rays_[i], measured);
      images.depth[i] = static_cast<float>(physics::depth_of(geometry_, rays_[i], reflected));
      if (images.sigma != nullptr) {
        images.sigma[i] *= static_cast<float>(physics::optimized_bistatic_slope(geometry_, rays_[i], reflected));
      }
      if (std::isnan(reflected)) images.flags[i] |= flag::invalid;
      if (std::isnan(rays_[i].z)) images.flags[i] |= flag::outside_lens;
    }
  }

  physics::Geometry geometry_;
  std::size_t rows_ = 0, columns_ = 0;
  std::vector<physics::Vector3> rays_;
  std::vector<float> along_, sensor_path_, foreshortening_;
  std::vector<BistaticSource> sources_;
  BistaticCamera camera_{};
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::OptimizedBistatic, "Distance to depth by the optimized bistatic model, any sources anywhere")
#endif
