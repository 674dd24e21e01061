// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/defects.hpp"

#include "tests/hidden_effects/draws.hpp"

namespace tofgraph::hidden {

std::vector<Defect> draw_defects(const Camera& camera, std::uint64_t seed, double share) {
  std::vector<Defect> defects(camera.pixels(), Defect::none);
  std::mt19937_64 random = generator(seed, bad_pixels_draw);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (Defect& defect : defects)
    if (const double u = uniform(random); u < share)
      defect = u < 0.3 * share ? Defect::dead : u < 0.6 * share ? Defect::hot : Defect::noisy;
  return defects;
}

double damaged(Defect defect, double tap, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  switch (defect) {
    case Defect::none:
      break;
    case Defect::dead:
      return 20;
    case Defect::hot:
      return tap + 4000 + 300 * normal(random);
    case Defect::noisy:
      return tap + 400 * normal(random);
  }
  return tap;
}

}  // namespace tofgraph::hidden
