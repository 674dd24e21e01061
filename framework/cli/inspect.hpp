// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph inspect`, implemented in inspect_module.cpp.
#pragma once

#include <filesystem>
#include <string>

namespace tofgraph::cli {

struct InspectArguments {
  std::filesystem::path capture;  ///< to be read: the recording, or what was converted from it
  std::string name;               ///< of the recording, for messages
  std::string camera;             ///< a profile by name or path; empty: that of the capture
  std::string layout;             ///< of a file of another program; empty: none
  std::filesystem::path foreign;  ///< this file, of a series the first; empty: the recording is a capture
  std::filesystem::path out;      ///< the page; empty: none
  bool json = false, force = false;
};

}  // namespace tofgraph::cli
