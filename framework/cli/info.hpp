// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph info`, implemented in info_module.cpp.
#pragma once

#include <filesystem>

namespace tofgraph::cli {

struct InfoArguments {
  std::filesystem::path capture;
  bool json = false;
};

}  // namespace tofgraph::cli
