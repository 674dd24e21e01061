// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Readers of campaign files for tests: return the campaign, or the text of its errors.
#pragma once

#include <gtest/gtest.h>

#include "io/campaign.hpp"

namespace tofgraph::io {

inline Campaign read(const std::filesystem::path& file) {
  config::Diagnostics diagnostics;
  Campaign campaign = read_campaign(file, diagnostics);
  EXPECT_TRUE(diagnostics.ok()) << diagnostics.text();
  return campaign;
}

inline std::string mistakes(const std::filesystem::path& file) {
  config::Diagnostics diagnostics;
  read_campaign(file, diagnostics);
  return diagnostics.text();
}

}  // namespace tofgraph::io
