// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Errors in the access to a camera.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace tofgraph::camcube {

/// The words of everything that was tried on software only.
inline constexpr std::string_view unverified = "not verified on hardware";

/// A camera cannot be used as it was asked for; the parameter at fault.
struct SettingError : std::runtime_error {
  SettingError(std::string of, const std::string& text) : std::runtime_error(text), parameter(std::move(of)) {}
  std::string parameter;
};

/// This way leads to no camera here: the next one may be tried.
struct NotFound : SettingError {
  using SettingError::SettingError;
};

/// Something went wrong with a camera that was running.
struct Fault : std::runtime_error {
  /// @param device_lost it has to be opened again
  Fault(const std::string& text, bool device_lost) : std::runtime_error(text), lost(device_lost) {}
  bool lost;
};

}  // namespace tofgraph::camcube
