// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph calibrate`, implemented in calibrate_module.cpp.
#pragma once

#include <string>
#include <vector>

namespace tofgraph::cli {

struct CalibrateArguments {
  std::string what, campaign, out;
  std::string variant, range, accuracy, roi, corrected_at;  ///< as written; empty: not given
  std::vector<std::string> free, without;
  unsigned threads = 0;  ///< 0: one per core
  bool force = false, quiet = false;
};

}  // namespace tofgraph::cli
