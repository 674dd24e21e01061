// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Message of a call that should be refused.
#pragma once

#include <exception>
#include <string>

namespace tofgraph {

/// The text of what the call throws; "no error" where it throws nothing.
std::string message_of(auto&& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace tofgraph
