// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "core/camera.hpp"

#include "physics/lens.hpp"

namespace tofgraph::core {

Camera::Camera(const tofgraph_camera& camera)
    : view_(camera), name_(camera.name), profile_(camera.profile != nullptr ? camera.profile : "") {
  view_.size = sizeof view_;
  view_.light_size = sizeof(tofgraph_light);
  view_.name = name_.c_str();
  view_.profile = profile_.c_str();
  lights_.assign(camera.lights, camera.lights + camera.light_count);
  light_names_.reserve(lights_.size());
  for (tofgraph_light& light : lights_) light.name = light_names_.emplace_back(light.name).c_str();
  view_.lights = lights_.data();
  const std::size_t values = std::size_t{camera.width} * camera.height * 3;
  if (camera.rays != nullptr) {
    rays_.assign(camera.rays, camera.rays + values);
  } else {
    rays_.resize(values);
    physics::pixel_rays(view_, rays_.data());
  }
  view_.rays = rays_.data();
}

}  // namespace tofgraph::core
