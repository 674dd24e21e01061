// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/camera.hpp"

#include "io/border.hpp"

#include <tofgraph/array.hpp>
#include <tofgraph/physics/lens.hpp>

namespace tofgraph::io {

Camera::Camera(const tofgraph_camera& camera)
    : view_(host_sized(camera)),
      name_(camera.name),
      profile_(view_.profile != nullptr ? view_.profile : ""),
      model_(view_.model != nullptr ? view_.model : "") {
  view_.light_size = sizeof(tofgraph_light);
  view_.exposure_size = sizeof(tofgraph_exposure);
  view_.name = name_.c_str();
  view_.profile = profile_.c_str();
  view_.model = model_.empty() ? nullptr : model_.c_str();
  for (const tofgraph_light& light : lights_of(camera))
    lights_.push_back(host_sized<tofgraph_light>(&light, camera.light_size));
  light_names_.reserve(lights_.size());
  for (tofgraph_light& light : lights_) light.name = light_names_.emplace_back(light.name).c_str();
  view_.lights = lights_.data();
  for (const tofgraph_exposure& exposure :
       Strided<const tofgraph_exposure>{view_.exposures, camera.exposure_size, view_.exposure_count})
    exposures_.push_back(host_sized<tofgraph_exposure>(&exposure, camera.exposure_size));
  view_.exposures = exposures_.data();
  const std::size_t values = std::size_t{camera.width} * camera.height * 3;
  if (camera.rays != nullptr) {
    rays_.assign(camera.rays, camera.rays + values);
  } else {
    rays_.resize(values);
    physics::pixel_rays(view_, rays_.data());
  }
  view_.rays = rays_.data();
}

}  // namespace tofgraph::io
