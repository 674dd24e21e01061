// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The table of services that the host gives to every plugin.
#pragma once

#include <tofgraph/plugin.h>

#include <string>

namespace tofgraph::core {

/// What a plugin said through fail() in the running call of this thread.
struct Failure {
  std::string parameter, text;
};
Failure& last_failure();

const tofgraph_host& host_table();

}  // namespace tofgraph::core
