// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Message of a call that should fail.
#pragma once

#include <exception>
#include <string>

namespace tofgraph {

/// Message of the exception thrown by the call; "no error" if it throws nothing.
std::string message_of(auto&& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace tofgraph
