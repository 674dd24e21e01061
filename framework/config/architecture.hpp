// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Architecture of library files. For one of another architecture, the dynamic loader says that no such file
/// exists.
#pragma once

#include <string>

namespace tofgraph::config {

/// "is for another architecture: ARM of 64 bits, this program is x86-64" if that is so, otherwise empty: also for files
/// that are absent or not in the ELF format.
std::string other_architecture(const std::string& library);

}  // namespace tofgraph::config
