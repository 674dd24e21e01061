// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/gallery.hpp"
#include "cli/progress.hpp"
#include "io/output_file.hpp"
#include "io/profile.hpp"
#include "report/effect_gallery.hpp"
#include "simulation/forward_model.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/exposures.hpp>

namespace tofgraph::cli {
namespace {

int gallery(const GalleryArguments& arguments) {
  const auto profile = io::find_profile(arguments.camera, std::filesystem::current_path());
  std::error_code error;
  if (profile.empty() || !std::filesystem::exists(profile, error)) {
    const std::vector<std::string> names = io::profile_names();
    throw config::ConfigurationError(fmt::format("--camera {}: error: there is no such profile\n         {}",
                                                 arguments.camera,
                                                 config::suggestion(arguments.camera, names, "cameras")));
  }
  const std::filesystem::path out = arguments.out;
  std::string problem = io::input_problem(out, std::span(&profile, 1));
  if (problem.empty()) problem = io::output_problem(out, arguments.force, "--force");
  if (!problem.empty()) throw config::ConfigurationError(fmt::format("--out: error: {}", problem));
  const auto camera = io::load_profile(profile);
  if (const auto not_four = physics::not_the_four(physics::exposures_of(camera->view())); !not_four.empty())
    throw config::ConfigurationError(fmt::format("--camera {}: error: the gallery {}", arguments.camera, not_four));
  const graph::PluginRegistry registry(arguments.plugin_folders);
  Progress progress(arguments.quiet);
  const std::size_t effects = report::write_effect_gallery(
      registry, camera->view(), arguments.out,
      {arguments.light == "physical", [&](double share) { progress.show(share, "effects"); }});
  progress.finish();
  if (!arguments.quiet) print_message(fmt::format("wrote {}: {}", arguments.out, config::counted(effects, "effect")));
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::gallery(*static_cast<const tofgraph::cli::GalleryArguments*>(arguments));
}
