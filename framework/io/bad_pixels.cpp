// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/bad_pixels.hpp"

#include "config/paths.hpp"
#include "io/image_file.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace tofgraph::io {
namespace {

constexpr const char* map_example = "example: bad_pixels: {file: noise.maps.h5, dataset: bad}";

/// True if the document was read from a file, so that relative paths in it can be resolved.
bool is_profile_file(const config::Position& at) {
  std::error_code error;
  return at.source && std::filesystem::is_regular_file(at.source->name, error);
}

/// @throws std::runtime_error
std::vector<std::uint8_t> map_from(const std::filesystem::path& file, const std::string& dataset,
                                   const tofgraph_camera& camera) {
  const ImageFile image("bad_pixels", file.string(), dataset, "", "", true);
  const tofgraph_view& view = image.view();
  if (view.extent[0] != camera.height || view.extent[1] != camera.width)
    throw std::runtime_error(fmt::format("the map in {} is {} x {} px, the camera '{}' has {} x {} (width x height)",
                                         file.string(), view.extent[1], view.extent[0], camera.name, camera.width,
                                         camera.height));
  std::vector<std::uint8_t> bad;
  const auto* values = static_cast<const double*>(view.data);
  for (std::size_t i = 0; i < view.extent[0] * view.extent[1]; ++i) bad.push_back(values[i] != 0 ? 1 : 0);
  return bad;
}

}  // namespace

void read_bad_pixels(const config::Value& named, Camera& camera, config::Diagnostics& diagnostics) {
  std::string text = named.is_scalar() ? named.text : "", dataset;
  if (named.is_map()) {
    const std::size_t before = diagnostics.errors();
    config::Reader reader(named, diagnostics, "'bad_pixels'");
    if (const config::Entry* file = reader.need("file", "noise.maps.h5")) text = file->value.text;
    dataset = reader.word("dataset", "");
    reader.finish();
    if (diagnostics.errors() != before) return;
  }
  if (text.empty())
    return diagnostics.error(named.at, fmt::format("'bad_pixels' is {}, expected a map", named.described()),
                             map_example);
  const std::filesystem::path file = std::filesystem::absolute(config::path_at(text, named.at));
  std::error_code error;
  const bool found = std::filesystem::is_regular_file(file, error);
  if (!is_profile_file(named.at) && (std::filesystem::path(text).is_relative() || !found)) {
    camera.missing_bad_pixels = text;
    return;
  }
  try {
    camera.bad_pixels = map_from(file, dataset, camera.view());
    camera.bad_pixels_file = file;
  } catch (const std::runtime_error& problem) {
    diagnostics.error(named.at, fmt::format("'bad_pixels': {}", problem.what()), map_example);
  }
}

}  // namespace tofgraph::io
