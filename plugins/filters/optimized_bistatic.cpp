// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Distance to depth by the optimized bistatic model, for any number of sources at any position.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/optimized_bistatic.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include <hwy/highway.h>
#include <tofgraph/physics/bistatic_tables.hpp>
#include <tofgraph/physics/non_linearity.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "plugins/filters/distance_model.hpp"

#ifndef TOFGRAPH_OPTIMIZED_BISTATIC_ONCE
#define TOFGRAPH_OPTIMIZED_BISTATIC_ONCE
namespace tofgraph {

/// Images of a frame; sigma may be null.
struct BistaticImages {
  const float* distance;
  float* depth;
  float* sigma;          // of the distance; becomes that of the depth
  std::uint16_t* flags;  // read and combined
  std::size_t pixels;
};

}  // namespace tofgraph
#endif

// Precision: 2 um at 7.4 m in single precision, which resolves 0.5 um there: no quantities of the size of D are
// subtracted. The unknown is the small e = D_ref - D (about minus half the distance from sensor to sources), and
// z = D + (f + e cos(theta) - D (1 - cos(theta))).
//
// Speed: the mean square of the paths is the square of their mean plus their variance V. With K = 2 D - D_sen the mean
// is K - D_ref, and the mean square is D_ref^2 + 2 D_ref mean(u.b) + mean|b|^2, so that
//     D_ref = (K^2 - mean|b|^2 + V) / (2 (K + mean(u.b))),
// the closed form for one source, for which V = 0. For sources that are close together compared with the distance to
// the surface, V is a correction of some 0.1 mm and may be evaluated at the uncorrected position.
HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Inputs for a vector of pixels, except its index.
struct Inputs {
  physics::BistaticCamera camera;
  const physics::BistaticSource* sources;
  std::size_t count;
  BistaticImages images;
};

/// Solution for a vector of pixels: e, 1 / (d 2D / d D_ref) there, and a mask of the final ones.
template <class D> struct Solution {
  hn::Vec<D> e, slope;
  hn::Mask<D> settled;
};

/// Closed form with its correction.
template <bool OneSource, class D, class V = hn::Vec<D>>
HWY_INLINE Solution<D> Estimate(D d, const Inputs& in, std::size_t i) {
  const V distance = hn::LoadU(d, in.images.distance + i), sensor = hn::LoadU(d, in.camera.sensor_path + i);
  const V mean_along = hn::LoadU(d, in.camera.mean_along + i), half = hn::Set(d, 0.5F);
  const V k = hn::Sub(hn::Add(distance, distance), sensor);
  const V inverse = hn::Div(hn::Set(d, 1.0F), hn::Add(k, mean_along));
  const V constant = hn::Mul(half, hn::MulSub(sensor, sensor, hn::Set(d, in.camera.mean_square)));
  V e = hn::Mul(hn::NegMulAdd(distance, hn::Add(sensor, mean_along), constant), inverse);
  if constexpr (!OneSource) {
    const V return_path = hn::Add(distance, e);
    const V twice = hn::Add(return_path, return_path), square = hn::Mul(return_path, return_path);
    V first = hn::Zero(d), mean = first, mean_square = first;
    for (std::size_t s = 0; s < in.count; ++s) {
      const V along = hn::LoadU(d, in.sources[s].along + i);
      const V path = hn::Sqrt(hn::MulAdd(twice, along, hn::Add(square, hn::Set(d, in.sources[s].square))));
      if (s == 0) {
        first = path;  // V is computed from small differences, not as a difference of large squares
        continue;
      }
      const V beyond = hn::Sub(path, first), weighted = hn::Mul(hn::Set(d, in.sources[s].weight), beyond);
      mean = hn::Add(mean, weighted);
      mean_square = hn::MulAdd(weighted, beyond, mean_square);
    }
    e = hn::MulAdd(hn::NegMulAdd(mean, mean, mean_square), hn::Mul(half, inverse), e);
  }
  const V slope = hn::Mul(hn::Sub(k, hn::Add(distance, e)), inverse);
  return {e, slope, hn::Ge(distance, hn::Set(d, in.camera.safe_distance))};
}

/// Newton iteration for pixels that are not final, e.g. with sources far apart or between the camera and the surface.
/// D_i enters as the small t_i = D_i - D_ref = (2 D_ref u.b_i + |b_i|^2) / (D_i + D_ref): 2 e + D_sen + mean(t_i) = 0.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void Refine(D d, const Inputs& in, std::size_t i, hn::Mask<D> valid, Solution<D>& solution) {
  const V distance = hn::LoadU(d, in.images.distance + i), sensor = hn::LoadU(d, in.camera.sensor_path + i);
  auto pending = hn::AndNot(solution.settled, valid);
  constexpr int max_steps = 30;
  for (int step = 0; step < max_steps && !hn::AllFalse(d, pending); ++step) {
    const V return_path = hn::Add(distance, solution.e);
    V rest = hn::Add(hn::Add(solution.e, solution.e), sensor), rise = hn::Set(d, 1.0F);
    V nearest = hn::Set(d, hwy::HighestValue<float>());
    for (std::size_t s = 0; s < in.count; ++s) {
      const V along = hn::LoadU(d, in.sources[s].along + i), weight = hn::Set(d, in.sources[s].weight);
      const V n = hn::MulAdd(hn::Add(return_path, return_path), along, hn::Set(d, in.sources[s].square));
      const V path = hn::Sqrt(hn::MulAdd(return_path, return_path, n));  // D_i
      const V both = hn::Add(path, return_path);
      const V q = hn::Div(weight, hn::Mul(path, both));
      rest = hn::MulAdd(hn::Mul(n, path), q, rest);
      rise = hn::MulAdd(hn::Mul(hn::Add(return_path, along), both), q, rise);
      nearest = hn::Min(nearest, path);
    }
    const V slope = hn::Div(hn::Set(d, 1.0F), rise), change = hn::Mul(rest, slope);
    solution.slope = hn::IfThenElse(pending, slope, solution.slope);
    solution.e = hn::IfThenElse(pending, hn::Sub(solution.e, change), solution.e);
    // The remaining error is at most about change^2 / (2 nearest): iteration stops when that is below 50 nm.
    pending = hn::AndNot(hn::Le(hn::Mul(change, change), hn::Mul(nearest, hn::Set(d, 1e-7F))), pending);
  }
  solution.settled = hn::Not(pending);
}

/// Pixels with a possible solution: valid, not nearer than the lens centre, not NaN (which compares as false).
template <class D> HWY_INLINE hn::Mask<D> Solvable(D d, const Inputs& in, std::size_t i) {
  const hn::RebindToSigned<D> di;
  const auto distance = hn::LoadU(d, in.images.distance + i), sensor = hn::LoadU(d, in.camera.sensor_path + i);
  const auto far = hn::Gt(hn::Sub(hn::Add(distance, distance), sensor), hn::Set(d, in.camera.closest));
  const auto finite = hn::Le(distance, hn::Set(d, max_length));
  const auto flags = hn::PromoteTo(di, hn::LoadU(hn::Rebind<std::uint16_t, D>(), in.images.flags + i));
  const auto good = hn::Eq(hn::And(flags, hn::Set(di, flag::invalid)), hn::Zero(di));
  return hn::And(hn::And(far, finite), hn::RebindMask(d, good));
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE void Finish(D d, const Inputs& in, std::size_t i, hn::Mask<D> valid, const Solution<D>& solution) {
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
  flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, hn::Not(valid)), hn::Set(di, flag::invalid)));
  hn::StoreU(hn::DemoteTo(du16, flags), du16, in.images.flags + i);
}

/// Processes whole vectors of pixels from `begin` on. @returns the first unprocessed pixel
template <bool OneSource, class D> HWY_INLINE std::size_t SolveSome(D d, const Inputs& in, std::size_t begin) {
  std::size_t i = begin;
  for (; i + hn::Lanes(d) <= in.images.pixels; i += hn::Lanes(d)) {
    const auto valid = Solvable(d, in, i);
    Solution<D> solution = Estimate<OneSource>(d, in, i);
    if (HWY_UNLIKELY(!hn::AllFalse(d, hn::AndNot(solution.settled, valid)))) Refine(d, in, i, valid, solution);
    Finish(d, in, i, hn::And(valid, solution.settled), solution);
  }
  return i;
}

/// @param Sources number of sources if a specialisation pays off, so that constants stay in registers; else 0
template <std::size_t Sources> void SolveAll(const physics::BistaticCamera& camera,
                                             std::span<const physics::BistaticSource> all,
                                             const BistaticImages& images) {
  physics::BistaticSource some[Sources + 1];
  std::copy_n(all.begin(), Sources, some);
  const Inputs in{camera, Sources != 0 ? some : all.data(), Sources != 0 ? Sources : all.size(), images};
  const std::size_t done = SolveSome<Sources == 1>(hn::ScalableTag<float>(), in, 0);
  SolveSome<Sources == 1>(hn::CappedTag<float, 1>(), in, done);
}

void Solve(const physics::BistaticCamera& camera, std::span<const physics::BistaticSource> sources,
           const BistaticImages& images) {
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
/// by the sources' amplitudes; z = D_ref cos(theta) + f. A distance less than that of a surface at the lens centre has
/// no solution and becomes invalid; one beyond the unambiguous range (after unwrapping or an offset) is solved like any
/// other.
struct OptimizedBistatic final : DistanceModel {
  static constexpr bool steady = true;
  Param<Choice> solver{this,
                       "solver",
                       {.default_value = "newton",
                        .choices = "newton bisection",
                        .text = "newton: with Newton steps only where a corrected closed form is not exact enough; "
                                "bisection: the slow reference in double precision"}};

  void prepare(Setup& setup) {
    prepare_model(setup);
    tables_.emplace(geometry, rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (std::isnan(rays[i].z)) outside_.push_back(i);
    }
  }

  void process(Frame& frame) const {
    const Array<const float> input = measured(frame);
    const Array<std::uint16_t> bits = flags(frame, rows, columns);
    const BistaticImages images{.distance = input.data(),
                                .depth = depth(frame, rows, columns).data(),
                                .sigma = sigma(frame).data(),
                                .flags = bits.data(),
                                .pixels = input.size()};
    if (*solver == "bisection")
      bisect(images);
    else
      HWY_DYNAMIC_DISPATCH(Solve)(tables_->camera(), tables_->sources(), images);
    for (const std::size_t i : outside_) images.flags[i] |= flag::outside_lens;
    lengths.invalidate(frame, bits);
  }

 private:
  void bisect(const BistaticImages& images) const {
    for (std::size_t i = 0; i < images.pixels; ++i) {
      const double known = (images.flags[i] & flag::invalid) == 0 && is_valid_length(images.distance[i])
                               ? images.distance[i]
                               : std::nan("");
      const double return_path = physics::optimized_bistatic_bisection(geometry, rays[i], known);
      images.depth[i] = static_cast<float>(physics::depth_of(geometry, rays[i], return_path));
      if (images.sigma != nullptr) {
        images.sigma[i] *= static_cast<float>(physics::optimized_bistatic_slope(geometry, rays[i], return_path));
      }
      if (std::isnan(return_path)) images.flags[i] |= flag::invalid;
    }
  }

  std::vector<std::size_t> outside_;  // pixels outside the lens model
  std::optional<physics::BistaticTables> tables_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::OptimizedBistatic,
               "Distance to depth by the optimized bistatic model, for any sources anywhere")
#endif
