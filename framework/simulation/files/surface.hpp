// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Reflection of a surface, except its reflectivity.
#pragma once

namespace tofgraph::simulation {

struct Surface {
  double roughness = 0;  ///< rad, Oren-Nayar standard deviation of the facets' slope; 0: Lambert
  double specular = 0;   ///< k_s of the added lobe k_s (n.h)^m, independent of the reflectivity
  double exponent = 60;  ///< exponent m of the lobe
  bool given = false;    ///< stated in the scene
};

}  // namespace tofgraph::simulation
