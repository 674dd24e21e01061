// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Request of `tofgraph evaluate`, implemented in evaluate_module.cpp.
#pragma once

#include <string>

namespace tofgraph::cli {

struct EvaluateArguments {
  std::string campaign, before, out;
  unsigned threads = 0;  ///< 0: one per core
  bool force = false, quiet = false;
};

}  // namespace tofgraph::cli
