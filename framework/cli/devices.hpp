// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph devices`, implemented in devices/camcube/devices_module.cpp.
#pragma once

namespace tofgraph::cli {

struct DevicesArguments {
  bool json = false;
};

}  // namespace tofgraph::cli
