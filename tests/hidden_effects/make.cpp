// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// hidden_effects_make: generates a campaign with hidden effects.
#include "config/quantity.hpp"
#include "tests/hidden_effects/campaign.hpp"
#include "tests/hidden_effects/designs.hpp"
#include "tests/hidden_effects/like.hpp"
#include "tests/hidden_effects/truth.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <map>

namespace {

using namespace tofgraph::hidden;

const char* prefix(Draw draw) { return draw == Draw::either_sign ? "+-" : draw == Draw::within ? "within +-" : ""; }

double length(const std::string& text, const char* option) {
  const tofgraph::config::Quantity quantity = tofgraph::config::parse_quantity(text, "m");
  if (!quantity.ok()) throw std::invalid_argument(fmt::format("{}: {}", option, quantity.problem));
  return quantity.value;
}

void list() {
  fmt::print("designs\n");
  for (const NamedConditions& design : designs())
    fmt::print("  {:<24} {} ({} conditions)\n", design.name, design.text, design.make().size());
  fmt::print("experiments for --add\n");
  for (const NamedConditions& experiment : experiments())
    fmt::print("  {:<24} {} ({} conditions)\n", experiment.name, experiment.text, experiment.make().size());
  fmt::print("effects, with what --size 1 means\n");
  for (const Effect& effect : catalogue()) {
    std::string parameters;
    for (const Parameter& parameter : effect.parameters)
      if (parameter.draw == Draw::angle || parameter.draw == Draw::turn)
        parameters += fmt::format(" {}: drawn", parameter.name);
      else if (parameter.draw != Draw::unused)
        parameters += fmt::format(" {}: {}{}", parameter.name, prefix(parameter.draw),
                                  tofgraph::config::format_quantity(parameter.typical, parameter.unit));
    fmt::print("  {:<24}{}\n", effect.name, parameters);
  }
  fmt::print("patterns that are in no catalogue\n");
  for (const PatternKind& kind : pattern_catalogue())
    fmt::print("  {:<24} {}: {}\n", kind.name, tofgraph::config::format_quantity(kind.typical, kind.unit), kind.text);
}

/// Arguments of the command line.
struct Asked {
  CampaignOptions options;
  std::vector<std::string> effects, patterns;
  double size = 1;
  std::vector<double> exposures;
  std::string warp = "0mm", residue = "0mm", misplaced = "0mm";
  std::filesystem::path like;
  bool list = false, plain = false, light_jitter_given = false;
};

void declare_clutter(CLI::App& app, Asked& asked) {
  app.add_option("--warp", asked.warp,
                 "e.g. 1mm: boards that are not flat, root mean square; the shape moves with the board");
  app.add_option(
      "--sessions", asked.options.clutter.sessions,
      "recorded in so many sessions, each with its own offset (3 mm) and light (2 %); the campaign file does "
      "tell which condition belongs to which");
  app.add_option("--residue", asked.residue,
                 "e.g. 0.3mm: an error that is smooth over the image and the order measured");
  app.add_option("--misplaced", asked.misplaced,
                 "e.g. 20mm: one board stands farther by this than the campaign file says");
}

/// Everything that defines a campaign, except its seed.
void declare_campaign(CLI::App& app, Asked& asked) {
  static const std::map<std::string, NoiseKind> noises = {{"gaussian", NoiseKind::gaussian},
                                                          {"heavy", NoiseKind::heavy},
                                                          {"drift", NoiseKind::drift},
                                                          {"none", NoiseKind::none}};
  static const std::map<std::string, Light> lights = {{"reference", Light::reference}, {"physical", Light::physical}};
  CampaignOptions& options = asked.options;
  app.add_option("--design", options.design, "see --list")->capture_default_str();
  app.add_option("--add", options.experiments, "experiments to append, with commas")->delimiter(',');
  app.add_option("--effect", asked.effects, "NAME or NAME:parameter=value,..; several times for several");
  app.add_option("--pattern", asked.patterns, "NAME or NAME:SIZE, an error that is in no catalogue");
  app.add_option("--size", asked.size, "factor on the typical size, where no parameters are given")
      ->capture_default_str();
  app.add_flag("--plain", asked.plain,
               "draws the main parameters of an effect alone; the further ones keep their off values");
  app.add_option("--noise", options.noise, "gaussian, heavy, drift or none (an exact camera and rail)")
      ->transform(CLI::CheckedTransformer(noises));
  declare_clutter(app, asked);
  app.add_option("--jitter", options.jitter, "factor on 0.5 mm of the boards' places")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  app.add_option("--light-jitter", options.light_jitter, "factor on 1 % of reflectivity; default: that of --jitter")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--order", options.order,
                 "of measurement: shuffled, designed, or unstated (shuffled, not in the file)")
      ->transform(CLI::CheckedTransformer(order_names()));
  app.add_option("--frames", options.frames, "of each condition")->capture_default_str()->check(CLI::Range(1, 100000));
  app.add_option("--light", options.light, "reference or physical")->transform(CLI::CheckedTransformer(lights));
  app.add_option("--exposures", asked.exposures, "phases of a frame's images, deg, with commas; default 0,90,180,270")
      ->delimiter(',')
      ->expected(3, 32);
  app.add_option("--output", options.output, "taps, phases, or distances (with amplitudes)")
      ->transform(CLI::CheckedTransformer(output_names()));
}

CampaignOptions campaign_of(const Asked& asked) {
  if (!asked.like.empty()) return like(asked.like, asked.options.seed);
  CampaignOptions options = asked.options;
  if (!asked.light_jitter_given) options.light_jitter = options.jitter;
  for (const std::string& text : asked.effects)
    options.effects.add_text(text, asked.size, options.seed, asked.plain ? Drawn::plain : Drawn::all);
  for (const std::string& text : asked.patterns) options.patterns.push_back(parse_pattern(text, asked.size));
  if (!asked.exposures.empty()) options.steps.clear();
  for (const double phase : asked.exposures) options.steps.push_back(phase * M_PI / 180);
  options.clutter.warp = length(asked.warp, "--warp");
  options.clutter.residue = length(asked.residue, "--residue");
  options.clutter.misplaced = length(asked.misplaced, "--misplaced");
  return options;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Makes a measuring campaign in which effects are hidden, by a model of the camera that shares no code "
      "with the simulator."};
  Asked asked;
  declare_campaign(app, asked);
  const std::vector<CLI::Option*> decided = app.get_options([](const CLI::Option* o) { return !o->check_name("-h"); });
  CLI::Option* same = app.add_option("--like", asked.like,
                                     "truth.yaml of a campaign: the same camera, boards and hidden effects once more, "
                                     "at distances between those; all but --seed, --threads and --out is its");
  for (CLI::Option* option : decided) same->excludes(option);
  app.add_option("--seed", asked.options.seed, "of everything that is drawn")->capture_default_str();
  app.add_option("--threads", asked.options.threads, "0: one a core")->capture_default_str();
  app.add_option("-o,--out", asked.options.folder, "the folder to make");
  app.add_flag("--list", asked.list, "shows designs, experiments, effects and patterns");
  CLI11_PARSE(app, argc, argv);
  asked.light_jitter_given = app.count("--light-jitter") > 0;
  try {
    if (asked.list) return list(), 0;
    if (asked.options.folder.empty()) throw std::invalid_argument("where to? -o DIR is missing");
    CampaignOptions options = campaign_of(asked);
    options.folder = asked.options.folder;
    options.threads = asked.options.threads;
    make_campaign(options);
  } catch (const std::invalid_argument& mistake) {
    fmt::print(stderr, "hidden_effects_make: {}\n", mistake.what());
    return 2;
  } catch (const std::exception& failure) {
    fmt::print(stderr, "hidden_effects_make: {}\n", failure.what());
    return 1;
  }
  return 0;
}
