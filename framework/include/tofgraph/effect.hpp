// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Effects of the simulator: parameters, information for the search, and `apply`, whose argument determines the level.
/// A parameter with an `off` value is an amplitude parameter, with `typical` as its usual size; with `typical` alone it
/// is a nonlinear parameter (a phase, a time constant); with neither it is fixed. The gap search varies both kinds
/// within their bounds; an amplitude parameter that is `nested`, and the nonlinear ones declared `nested` after it,
/// only if the data require it. With all amplitude parameters off, an effect must not change a single bit.
///
///     struct EvenHarmonic final : tofgraph::Effect {
///       static constexpr tofgraph::EffectInfo info{.touches = "null2", .confused_with = "phase_gain"};
///       Param<double> ratio{
///           this, "ratio", {.default_value = "0", .min = -0.5, .max = 0.5, .off = 0, .typical = 0.02}};
///       void apply(tofgraph::SamplesLevel& light) const { .. }
///     };
///     TOFGRAPH_EFFECT(EvenHarmonic, "Second harmonic of the correlation")
#pragma once

#include <tofgraph/effect.h>
#include <tofgraph/stage.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>

namespace tofgraph {

/// See tofgraph_effect.
struct EffectInfo {
  const char *touches, *confused_with = "", *experiment = "";
  std::uint32_t scope = TOFGRAPH_SCOPE_CAMERA;  ///< or TOFGRAPH_SCOPE_SETUP: rail, board, room
};

/// Value of a pixel map between pixel centres: bilinear interpolation, constant beyond the border; 0 for an empty map.
/// @param u, v column and row
inline double at(const Image& map, double u, double v) {
  if (map.empty()) return 0;
  const auto split = [](double x, std::size_t count, std::size_t& low, std::size_t& high) {
    const double position = std::clamp(x, 0.0, static_cast<double>(count - 1));
    low = std::min(static_cast<std::size_t>(position), count - 1 - (count > 1 ? 1 : 0));
    high = std::min(low + 1, count - 1);
    return position - static_cast<double>(low);
  };
  std::size_t left = 0, right = 0, top = 0, bottom = 0;
  const double x = split(u, map.columns, left, right), y = split(v, map.rows, top, bottom);
  const auto value = [&](std::size_t row, std::size_t column) { return map.data[row * map.columns + column]; };
  return std::lerp(std::lerp(value(top, left), value(top, right), x),
                   std::lerp(value(bottom, left), value(bottom, right), x), y);
}

/// Properties common to all levels.
class LightState {
 public:
  explicit LightState(tofgraph_light_state& light) : state(light) {}
  const tofgraph_camera& camera() const { return *state.camera; }
  const tofgraph_condition& condition() const { return *state.condition; }
  std::size_t points() const { return state.points; }
  /// Phase in radians per metre of (half-path) distance at the modulation frequency: 4 pi f / c.
  double radians_per_metre() const { return 4 * M_PI / 299792458.0 * state.frequency; }
  tofgraph_light_state& state;
};

/// Lens, sources and poses, before any light is computed.
struct GeometryLevel : LightState {
  static constexpr std::uint32_t level = TOFGRAPH_LEVEL_GEOMETRY, flags = 0;
  Strided<tofgraph_source_light> sources() const { return {state.sources, state.source_size, state.source_count}; }
};

/// Light of one source at the points.
struct SourceLight {
  const tofgraph_source_light& source;
  std::complex<double>* phasor;  ///< counts
  double* strength;              ///< counts
  bool from_inside() const { return source.path == nullptr; }
  /// Scales this light at point i, in the correlation and in the intensity.
  void scale(std::size_t i, double factor) const {
    phasor[i] *= factor;
    strength[i] *= factor;
  }
};

/// Light of each source on its path; the last is the light inside the camera.
struct PhasorLevel : LightState {
  static constexpr std::uint32_t level = TOFGRAPH_LEVEL_PHASOR, flags = 0;
  std::size_t size() const { return state.source_count; }
  SourceLight operator[](std::size_t source) const {
    const tofgraph_source_light& s = Strided<tofgraph_source_light>{state.sources, state.source_size, 0}[source];
    return {s, reinterpret_cast<std::complex<double>*>(s.phasor), s.strength};
  }
  double& phase_offset(std::size_t i) const { return state.phase_offset[i]; }
};
/// The same for effects that use neighbouring pixels: point row * columns + column.
struct PhasorImage : PhasorLevel {
  static constexpr std::uint32_t flags = TOFGRAPH_EFFECT_IMAGE;
};

/// End of the phasor level: all light is known, and its phase may be changed.
struct PhaseLevel : LightState {
  static constexpr std::uint32_t level = TOFGRAPH_LEVEL_PHASOR, flags = TOFGRAPH_EFFECT_LATE;
  double amplitude(std::size_t i) const { return state.amplitude[i]; }
  double distance(std::size_t i) const { return state.distance[i]; }
  double& phase_offset(std::size_t i) const { return state.phase_offset[i]; }
};

/// Exposures: sample k is Re(phasor e^(j step_k)) + extra.
struct SamplesLevel : LightState {
  static constexpr std::uint32_t level = TOFGRAPH_LEVEL_SAMPLES, flags = 0;
  std::size_t exposures() const { return state.exposure_count; }
  tofgraph_exposure& exposure(std::size_t k) const {
    return Strided<tofgraph_exposure>{state.exposures, state.exposure_size, 0}[k];
  }
  using LightState::radians_per_metre;
  /// As above, at the frequency of exposure k.
  double radians_per_metre(std::size_t k) const { return 4 * M_PI / 299792458.0 * exposure(k).frequency; }
  std::complex<double>& phasor(std::size_t k, std::size_t i) const {
    return reinterpret_cast<std::complex<double>*>(state.exposure)[k * points() + i];
  }
  double& intensity(std::size_t k, std::size_t i) const { return state.intensity[k * points() + i]; }
  double& extra(std::size_t k, std::size_t i) const { return state.extra[k * points() + i]; }
  double& step(std::size_t k) const { return exposure(k).phase; }
  /// Moves the boards away by a displacement (m) in exposure k: phase and light are recomputed.
  void displace(std::uint32_t k, double displacement) const {
    if (state.displace(&state, k, displacement) != TOFGRAPH_STATUS_OK)
      throw std::runtime_error("the boards cannot be moved like this");
  }
};

/// Taps before the noise.
struct TapsLevel : LightState {
  static constexpr std::uint32_t level = TOFGRAPH_LEVEL_TAPS, flags = 0;
  std::size_t exposures() const { return state.exposure_count; }
  double& a(std::size_t k, std::size_t i) const { return state.taps[2 * k * points() + i]; }
  double& b(std::size_t k, std::size_t i) const { return state.taps[(2 * k + 1) * points() + i]; }
  std::span<double> all() const { return {state.taps, 2 * exposures() * points()}; }
  /// Takes these counts from both taps of a pixel, after their shot noise arose.
  void remove(std::size_t k, std::size_t i, double counts) const {
    a(k, i) -= counts;
    b(k, i) -= counts;
    const bool kept = state.size > offsetof(tofgraph_light_state, removed) && state.removed != nullptr;
    if (kept) state.removed[k * points() + i] += counts;
  }
};
/// Taps with noise, as read out.
struct ReadoutLevel : TapsLevel {
  static constexpr std::uint32_t flags = TOFGRAPH_EFFECT_LATE;
};

namespace detail {

template <class T> struct __attribute__((visibility("hidden"))) EffectGlue {
  template <class Level> static Level level_of(void (T::*)(Level&) const);
  using Level = decltype(level_of(&T::apply));

  static int apply(void* self, tofgraph_light_state* state) {
    const T& effect = *static_cast<const T*>(self);
    return guarded(effect.host, effect.context, [&] {
      Level light{LightState(*state)};
      return effect.apply(light), TOFGRAPH_STATUS_OK;
    });
  }
  static const tofgraph_descriptor* descriptor(const char* summary) noexcept {
    static constexpr tofgraph_effect effect{
        sizeof(tofgraph_effect), Level::level,          Level::flags,       T::info.scope,
        T::info.touches,         T::info.confused_with, T::info.experiment, apply};
    static constexpr tofgraph_extension extension{"effect", 1, 0, &effect};
    return Glue<T>::descriptor(summary, &extension);
  }
};

}  // namespace detail
}  // namespace tofgraph

/// Exports an effect from its plugin. Use once per file.
#define TOFGRAPH_EFFECT(Class, summary)                                                                \
  extern "C" __attribute__((visibility("default"))) const tofgraph_descriptor* tofgraph_plugin(void) { \
    return tofgraph::detail::EffectGlue<Class>::descriptor(summary);                                   \
  }
