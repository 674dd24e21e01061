// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Errors of the access to a camera.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace tofgraph::camcube {

/// Remark for everything that was tested with software only.
inline constexpr std::string_view unverified = "not verified on hardware";

/// Camera that cannot be used with these settings; names the invalid parameter.
struct SettingError : std::runtime_error {
  SettingError(std::string of, const std::string& text) : std::runtime_error(text), parameter(std::move(of)) {}
  std::string parameter;
};

/// No camera is available through this backend; the next one may be tried.
struct NotFound : SettingError {
  using SettingError::SettingError;
};

/// Failure of a running camera.
struct Fault : std::runtime_error {
  /// @param device_lost it must be reopened
  Fault(const std::string& text, bool device_lost) : std::runtime_error(text), lost(device_lost) {}
  bool lost;
};

}  // namespace tofgraph::camcube
