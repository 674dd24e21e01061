// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph inspect`, implemented in inspect_module.cpp.
#pragma once

#include <filesystem>
#include <string>

namespace tofgraph::cli {

struct InspectArguments {
  std::filesystem::path capture;  ///< file to read: the recording, or the result of its conversion
  std::string name;               ///< path of the recording, for messages
  std::string camera;             ///< profile by name or path; empty: that of the capture
  std::string layout;             ///< layout of a file of another program; empty: none
  std::filesystem::path foreign;  ///< first file of that recording; empty: the recording is a capture
  std::filesystem::path out;      ///< output page; empty: none
  bool json = false, force = false;
};

}  // namespace tofgraph::cli
