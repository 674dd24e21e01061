// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph pose`, implemented in pose_module.cpp.
#pragma once

#include <string>

namespace tofgraph::cli {

struct PoseArguments {
  std::string capture, pattern, camera, out;  ///< as written; empty: not given
  bool force = false, quiet = false;
};

}  // namespace tofgraph::cli
