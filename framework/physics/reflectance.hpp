// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "geometry.hpp"
namespace tofgraph::physics {
inline double oren_nayar(double, Vector3, Vector3, Vector3) { return 1; }
}
