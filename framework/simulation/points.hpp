// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Surface points of an evaluation. For forward_model.cpp and evaluation*.cpp only.
#pragma once

#include "simulation/hit.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <utility>
#include <vector>

namespace tofgraph::simulation {

using Complex = std::complex<double>;

/// Leaves new elements uninitialised: the large arrays are written before they are read.
template <class T> struct DefaultInitAllocator : std::allocator<T> {
  template <class U> struct rebind { using other = DefaultInitAllocator<U>; };
  template <class U> void construct(U* place) { ::new (static_cast<void*>(place)) U; }
  template <class U, class... Arguments> void construct(U* place, Arguments&&... arguments) {
    ::new (static_cast<void*>(place)) U(std::forward<Arguments>(arguments)...);
  }
};
using Doubles = std::vector<double, DefaultInitAllocator<double>>;

/// Points of an evaluation: the pixel centres, then the rays of pixels on an edge.
struct Points {
  Doubles pixel, ray, position, normal, return_path, sensor_path, reflectivity;
  std::vector<const Surface*, DefaultInitAllocator<const Surface*>> surface;
  std::size_t size() const { return return_path.size(); }

  void resize(std::size_t n) {
    pixel.resize(2 * n);
    for (Doubles* triple : {&ray, &position, &normal}) triple->resize(3 * n);
    for (Doubles* single : {&return_path, &sensor_path, &reflectivity}) single->resize(n);
    surface.resize(n);
  }
  void set(std::size_t i, double u, double v, Vector3 along, const Hit& hit, double focal_length) {
    const bool there = std::isfinite(hit.return_path);
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
    return_path[i] = there ? hit.return_path : 0;
    sensor_path[i] = focal_length / along.z;
    // Black keeps a small reflectivity, because the specular part, which does not depend on it, is computed relative
    // to the diffuse light.
    reflectivity[i] = there ? std::max(hit.reflectivity, 1e-9) : 0;
    surface[i] = hit.surface;
  }
  Vector3 position_of(std::size_t i) const { return {position[3 * i], position[3 * i + 1], position[3 * i + 2]}; }
  Vector3 normal_of(std::size_t i) const { return {normal[3 * i], normal[3 * i + 1], normal[3 * i + 2]}; }
  Vector3 ray_of(std::size_t i) const { return {ray[3 * i], ray[3 * i + 1], ray[3 * i + 2]}; }
};

/// Light of a source, per point.
struct SourceArrays {
  Doubles path;
  std::vector<double> strength;
  std::vector<Complex> phasor;
  std::vector<std::pair<std::size_t, double>> edge_paths;  ///< pixels on an edge: mean whole path of their light, m
};

/// Pixels whose neighbours see another surface, so that the pixel itself may see both.
std::vector<std::size_t> edge_pixels(const std::vector<Hit>& hits, std::size_t rows, std::size_t columns);

}  // namespace tofgraph::simulation
