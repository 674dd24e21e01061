// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/fuzz/target.hpp"

#include "config/document.hpp"
#include "config/quantity.hpp"
#include "foreign/layout.hpp"
#include "graph/parameters.hpp"
#include "graph/pipeline.hpp"
#include "graph/resolved_pipeline.hpp"
#include "io/campaign.hpp"
#include "io/profile.hpp"
#include "simulation/files/model.hpp"
#include "simulation/files/scene_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace tofgraph::fuzz {
namespace {

/// Reads a document; also generates the text of all errors, which quotes the input.
template <class Read> void document(std::string_view bytes, Read&& read) {
  try {
    const config::Value value =
        config::parse_document("input", std::string(bytes), std::filesystem::temp_directory_path());
    config::Diagnostics diagnostics;
    read(value, diagnostics);
    diagnostics.text();
  } catch (const config::ConfigurationError&) {
  }
}

void pipeline(std::string_view bytes) {
  document(bytes, [](const config::Value& value, config::Diagnostics& diagnostics) {
    const graph::PipelineSpec spec = graph::parse_pipeline(value, diagnostics);
    const graph::ResolvedPipeline resolved(spec, plugins(), diagnostics);
    // Also parses the parameters of every node with a known stage, including the PCD writer's options.
    for (const std::size_t node : resolved.order(diagnostics)) {
      std::vector<const config::Entry*> written;
      for (const config::Entry& entry : resolved.spec(node).parameters) written.push_back(&entry);
      const graph::ParameterValues values(*resolved.stage(node), written, resolved.spec(node).at, diagnostics);
    }
  });
}

void pipeline_line(std::string_view bytes) {
  try {
    config::Diagnostics diagnostics;
    graph::parse_pipeline(graph::pipeline_from_line(std::string(bytes), ""), diagnostics);
    diagnostics.text();
  } catch (const config::ConfigurationError&) {
  }
}

void scene(std::string_view bytes) {
  document(bytes, [](const config::Value& value, config::Diagnostics& diagnostics) {
    const simulation::SceneFile read = simulation::read_scene(value, diagnostics);
    if (diagnostics.ok()) simulation::expand(read);
  });
}

void campaign(std::string_view bytes) {
  document(bytes, [](const config::Value& value, config::Diagnostics& diagnostics) {
    io::read_campaign(value, diagnostics, io::Captures::may_be_missing);
  });
}

void model(std::string_view bytes) {
  document(bytes, [](const config::Value& value, config::Diagnostics& diagnostics) {
    simulation::read_model(value, plugins(), diagnostics);
  });
}

void profile(std::string_view bytes) {
  document(bytes,
           [](const config::Value& value, config::Diagnostics& diagnostics) { io::read_profile(value, diagnostics); });
}

void layout(std::string_view bytes) {
  try {
    foreign::read_layout(file_of(bytes, "layout.yaml"));
  } catch (const config::ConfigurationError&) {
  }
}

/// The first line is the unit, the rest the text. The displayed value must be read back as the same value.
void units(std::string_view bytes) {
  const std::size_t end = bytes.find('\n');
  if (end == std::string_view::npos) return;
  constexpr std::string_view known[] = {"m", "s", "Hz", "rad", "K", "counts", "m/s", "counts m^2/s", "1/m", ""};
  const auto* const unit_at = std::ranges::find(known, bytes.substr(0, end));
  if (unit_at == std::end(known)) return;
  const std::string_view unit = *unit_at;
  const std::string_view text = bytes.substr(end + 1);
  config::parse_scale(text, unit);
  const config::Quantity read = config::parse_quantity(text, unit);
  if (!read.ok()) return;
  if (!std::isfinite(read.value)) std::abort();
  const std::string shown = config::format_quantity(read.value, unit);
  const config::Quantity again = config::parse_quantity(shown, unit);
  if (!again.ok() || std::abs(again.value - read.value) > 1e-3 * std::abs(read.value) + 1e-300) std::abort();
}

}  // namespace

std::vector<Target> document_targets() {
  return {{"pipeline", "pipeline files, with the parameters of their stages", pipeline},
          {"pipeline_line", "pipelines in one line", pipeline_line},
          {"scene", "scene files", scene},
          {"campaign", "campaign files", campaign},
          {"model", "model files", model},
          {"profile", "camera profiles", profile},
          {"layout", "layouts of foreign files", layout},
          {"units", "numbers with units", units}};
}

}  // namespace tofgraph::fuzz
