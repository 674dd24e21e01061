// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/profile_lens.hpp"

#include "io/profile.hpp"
#include "io/ray_table.hpp"
#include "io/unknown.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace tofgraph::io {
namespace {

void read_focal_length(config::Reader& reader, const config::Entry& focal, tofgraph_camera& camera,
                       config::Diagnostics& diagnostics) {
  if (focal.value.is_list()) {
    read_pair(focal, "px", "[175.37 px, 175.48 px]", camera.focal_px, diagnostics);
    camera.focal_length = (camera.focal_px[0] * camera.pitch[0] + camera.focal_px[1] * camera.pitch[1]) / 2;
    return;
  }
  camera.focal_length = reader.number("focal_length", "m", "12.8 mm", unknown);
  if (camera.focal_length <= 0) diagnostics.error(focal.value.at, "'focal_length' must be positive");
  if (std::isnan(camera.pitch[0])) {
    diagnostics.error(focal.value.at, "'focal_length' is a length, so 'pixel_pitch' is also required",
                      "or give the focal length in pixels: focal_length: [175.37 px, 175.48 px]");
  }
  for (int i = 0; i < 2; ++i) camera.focal_px[i] = camera.focal_length / camera.pitch[i];
}

/// Sets the pinhole, or the fisheye without distortion (radius = focal length x angle), implied by the data sheet's
/// field of view, with the axis at the image centre.
void use_field_of_view(const config::Entry& field, bool fisheye, tofgraph_camera& camera,
                       config::Diagnostics& diagnostics) {
  double angles[2];
  const std::size_t errors = diagnostics.errors();
  read_pair(field, "rad", "[40 deg, 30 deg]", angles, diagnostics);
  if (diagnostics.errors() != errors) return;
  const double sides[] = {static_cast<double>(camera.width), static_cast<double>(camera.height)};
  for (int i = 0; i < 2; ++i) {
    if (!(angles[i] < 3.1)) return diagnostics.error(field.value.at, "'field_of_view' must be less than 178 deg");
    camera.focal_px[i] = sides[i] / 2 / (fisheye ? angles[i] / 2 : std::tan(angles[i] / 2));
    camera.principal_point[i] = (sides[i] - 1) / 2;
  }
  camera.focal_length = (camera.focal_px[0] * camera.pitch[0] + camera.focal_px[1] * camera.pitch[1]) / 2;
  diagnostics.warning(
      field.value.at,
      fmt::format("'field_of_view' is all that is known of the lens: its focal length is taken as {:.1f} px and {:.1f} "
                  "px, without distortion, so that planes may be bent and sizes wrong by several percent",
                  camera.focal_px[0], camera.focal_px[1]),
      "add focal_length, principal_point and distortion, of the camera's own file or by tofgraph calibrate intrinsics");
}

void read_distortion(config::Reader& reader, tofgraph_camera& camera, const config::Value& document,
                     config::Diagnostics& diagnostics) {
  const std::string lens = reader.word("lens", "opencv");
  if (lens != "opencv" && lens != "fisheye")
    diagnostics.error(place_of(document, "lens"), fmt::format("'lens' is '{}', expected opencv or fisheye", lens),
                      "example: lens: fisheye");
  camera.lens_model = lens == "fisheye" ? TOFGRAPH_LENS_FISHEYE : TOFGRAPH_LENS_OPENCV;
  const std::vector<double> distortion = reader.numbers("distortion", "", "[0, 0, 0, 0, 0]");
  constexpr std::size_t usual = std::size(tofgraph_camera{}.distortion);
  if (lens == "fisheye" && distortion.size() > 4) {
    diagnostics.error(place_of(document, "distortion"),
                      "'distortion' of a fisheye has at most four numbers: k1 k2 k3 k4");
  } else if (distortion.size() > usual + std::size(camera.further_distortion)) {
    diagnostics.error(place_of(document, "distortion"),
                      "'distortion' has at most twelve numbers: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4");
  } else {
    for (std::size_t i = 0; i < distortion.size(); ++i)
      (i < usual ? camera.distortion[i] : camera.further_distortion[i - usual]) = distortion[i];
  }
  camera.skew = reader.number("skew", "", "0.001", 0);
}

/// Reads the table of rays and sets the best-fitting pinhole.
void read_rays(const config::Entry& entry, tofgraph_camera& camera, std::vector<float>& rays,
               const config::Value& document, config::Diagnostics& diagnostics) {
  for (const char* other : {"focal_length", "principal_point", "distortion", "lens", "skew"}) {
    if (document.find(other) != nullptr)
      return diagnostics.error(place_of(document, other), fmt::format("'{}' is contained in the table 'rays'", other),
                               "omit one of the two");
  }
  RayTable table;
  if (!read_ray_table(entry.value, camera.width, camera.height, table, diagnostics)) return;
  rays = std::move(table.rays);
  camera.lens_model = TOFGRAPH_LENS_RAYS;
  for (int i = 0; i < 2; ++i) {
    camera.focal_px[i] = table.focal[i];
    camera.principal_point[i] = table.centre[i];
  }
  camera.focal_length = (camera.focal_px[0] * camera.pitch[0] + camera.focal_px[1] * camera.pitch[1]) / 2;
}

}  // namespace

void read_lens(config::Reader& reader, tofgraph_camera& camera, const config::Value& document, std::vector<float>& rays,
               config::Diagnostics& diagnostics) {
  camera.focal_length = camera.pitch[0] = camera.pitch[1] = unknown;
  if (const config::Entry* pitch = reader.take("pixel_pitch"))
    read_pair(*pitch, "m", "40 um", camera.pitch, diagnostics);
  if (const config::Entry* table = reader.take("rays")) {
    read_rays(*table, camera, rays, document, diagnostics);
    return;
  }
  const config::Entry* field = document.is_map() ? document.find("field_of_view") : nullptr;
  const bool last_resort = field != nullptr && document.find("focal_length") == nullptr;
  const config::Entry* lens = document.is_map() ? document.find("lens") : nullptr;
  if (last_resort)
    use_field_of_view(*field, lens != nullptr && lens->value.text == "fisheye", camera, diagnostics);
  else if (const config::Entry* focal = reader.need("focal_length", "12.8 mm"))
    read_focal_length(reader, *focal, camera, diagnostics);
  const std::vector<double> centre = reader.numbers("principal_point", "", "[101.5, 101.5]");
  if (centre.size() == 2)
    std::ranges::copy(centre, camera.principal_point);
  else if (document.is_map() && !(last_resort && centre.empty()))
    diagnostics.error(place_of(document, "principal_point"), "'principal_point' needs two numbers",
                      "example: principal_point: [101.5, 101.5]");
  read_distortion(reader, camera, document, diagnostics);
}

std::vector<double> distortion_of(const tofgraph_camera& camera) {
  if (camera.lens_model == TOFGRAPH_LENS_FISHEYE) return {camera.distortion, camera.distortion + 4};
  std::vector<double> all(std::begin(camera.distortion), std::end(camera.distortion));
  if (std::ranges::any_of(camera.further_distortion, [](double d) { return d != 0; }))
    all.insert(all.end(), std::begin(camera.further_distortion), std::end(camera.further_distortion));
  return all;
}

}  // namespace tofgraph::io
