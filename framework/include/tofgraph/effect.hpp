// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How an effect is written, a piece of the simulator's physics: its parameters, what is known of it, and `apply`,
/// whose argument says at which level it acts. A parameter with an `off` value is a size, a usual one is `typical`;
/// with `typical` alone it is a shape (a phase, a time constant); with neither it is fixed. A search for missing
/// effects varies sizes and shapes within their bounds. With all sizes off, nothing may change, not one bit.
///
///     struct EvenHarmonic final : tofgraph::Effect {
///       static constexpr tofgraph::EffectInfo info{.touches = "null2", .confused_with = "phase_gain"};
///       Param<double> ratio{this, "ratio", {.fallback = "0", .min = -0.5, .max = 0.5, .off = 0, .typical = 0.02}};
///       void apply(tofgraph::SamplesLevel& light) const { .. }
///     };
///     TOFGRAPH_EFFECT(EvenHarmonic, "Second harmonic of the correlation")
#pragma once

#include <tofgraph/stage.hpp>

#include <cmath>
#include <complex>

namespace tofgraph {

/// See tofgraph_effect.
struct EffectInfo {
  const char *touches, *confused_with = "", *experiment = "";
};

/// What every level knows.
class LightState {
 public:
  explicit LightState(tofgraph_light_state& light) : state(light) {}
  const tofgraph_camera& camera() const { return *state.camera; }
  const tofgraph_condition& condition() const { return *state.condition; }
  std::size_t points() const { return state.points; }
  /// Radians of phase for a metre of (half-path) distance, at the nominal frequency: 4 pi f / c.
  double radians_per_metre() const { return 4 * M_PI / 299792458.0 * camera().modulation_frequency; }
  tofgraph_light_state& state;
};

/// Lens, sources, poses: before any light is computed.
struct GeometryLevel : LightState {
  static constexpr std::uint32_t level = TOFGRAPH_GEOMETRY, flags = 0;
  std::span<tofgraph_source_light> sources() const { return {state.sources, state.source_count}; }
};

/// One source's light at the points.
struct SourceLight {
  const tofgraph_source_light& source;
  std::complex<double>* phasor;  ///< counts
  double* strength;              ///< counts
  bool from_inside() const { return source.path == nullptr; }
  /// Less or more of this light at point i, both in the correlation and in the intensity.
  void scale(std::size_t i, double factor) const {
    phasor[i] *= factor;
    strength[i] *= factor;
  }
};

/// The light of each source on its way; the last is that from inside the camera.
struct PhasorLevel : LightState {
  static constexpr std::uint32_t level = TOFGRAPH_PHASOR, flags = 0;
  std::size_t size() const { return state.source_count; }
  SourceLight operator[](std::size_t source) const {
    const tofgraph_source_light& s = state.sources[source];
    return {s, reinterpret_cast<std::complex<double>*>(s.phasor), s.strength};
  }
  double& turn(std::size_t i) const { return state.turn[i]; }
};
/// The same for effects that look at neighbours: point row * columns + column.
struct PhasorImage : PhasorLevel {
  static constexpr std::uint32_t flags = TOFGRAPH_IMAGE;
};

/// The end of the phasor level: all light is known, its phase may be turned.
struct PhaseLevel : LightState {
  static constexpr std::uint32_t level = TOFGRAPH_PHASOR, flags = TOFGRAPH_LATE;
  double amplitude(std::size_t i) const { return state.amplitude[i]; }
  double distance(std::size_t i) const { return state.distance[i]; }
  double& turn(std::size_t i) const { return state.turn[i]; }
};

/// The four exposures: sample k is Re(phasor e^(j step_k)) + extra.
struct SamplesLevel : LightState {
  static constexpr std::uint32_t level = TOFGRAPH_SAMPLES, flags = 0;
  std::complex<double>& phasor(std::size_t k, std::size_t i) const {
    return reinterpret_cast<std::complex<double>*>(state.exposure)[k * points() + i];
  }
  double& intensity(std::size_t k, std::size_t i) const { return state.intensity[k * points() + i]; }
  double& extra(std::size_t k, std::size_t i) const { return state.extra[k * points() + i]; }
  double& step(std::size_t k) const { return state.step[k]; }
  /// The boards farther away (m) in exposure k: its phase and light follow.
  void displace(std::uint32_t k, double displacement) const {
    if (state.displace(&state, k, displacement) != TOFGRAPH_OK)
      throw std::runtime_error("the boards cannot be moved so");
  }
};

/// The taps before their noise.
struct TapsLevel : LightState {
  static constexpr std::uint32_t level = TOFGRAPH_TAPS, flags = 0;
  double& a(std::size_t k, std::size_t i) const { return state.taps[2 * k * points() + i]; }
  double& b(std::size_t k, std::size_t i) const { return state.taps[(2 * k + 1) * points() + i]; }
  std::span<double> all() const { return {state.taps, 8 * points()}; }
};
/// The taps with their noise, as they are read out.
struct ReadoutLevel : TapsLevel {
  static constexpr std::uint32_t flags = TOFGRAPH_LATE;
};

namespace detail {

template <class T> struct EffectGlue {
  template <class Level> static Level level_of(void (T::*)(Level&) const);
  using Level = decltype(level_of(&T::apply));

  static int apply(void* self, tofgraph_light_state* state) {
    const T& effect = *static_cast<const T*>(self);
    return guarded(effect.host, effect.context, [&] {
      Level light{LightState(*state)};
      return effect.apply(light), TOFGRAPH_OK;
    });
  }
  static const tofgraph_descriptor* descriptor(const char* summary) noexcept {
    static constexpr tofgraph_effect effect{sizeof(tofgraph_effect), Level::level,          Level::flags,       0,
                                            T::info.touches,         T::info.confused_with, T::info.experiment, apply};
    static constexpr tofgraph_extension extension{"effect", 1, 0, &effect};
    return Glue<T>::descriptor(summary, &extension);
  }
};

}  // namespace detail
}  // namespace tofgraph

/// Exports an effect from its plugin. Once a file.
#define TOFGRAPH_EFFECT(Class, summary)                                                                \
  extern "C" __attribute__((visibility("default"))) const tofgraph_descriptor* tofgraph_plugin(void) { \
    return tofgraph::detail::EffectGlue<Class>::descriptor(summary);                                   \
  }
