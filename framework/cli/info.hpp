// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file What `tofgraph info` was asked for; the work is in info_module.cpp.
#pragma once

#include <filesystem>

namespace tofgraph::cli {

struct InfoArguments {
  std::filesystem::path capture;
  bool json = false;
};

}  // namespace tofgraph::cli
