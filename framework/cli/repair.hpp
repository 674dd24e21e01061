// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph repair`, implemented in repair_module.cpp.
#pragma once

#include <filesystem>

namespace tofgraph::cli {

struct RepairArguments {
  std::filesystem::path part, out;
  bool force = false, quiet = false;
};

}  // namespace tofgraph::cli
