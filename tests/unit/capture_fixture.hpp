// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A capture in a folder of its own.
#pragma once

#include <gtest/gtest.h>

#include "io/captures/capture.hpp"
#include "tests/program.hpp"
#include "tests/unit/full_disk.hpp"

namespace tofgraph::tests {

class CaptureFile : public testing::Test {
 protected:
  TemporaryFolder folder;
  std::filesystem::path path = folder.path() / "a.h5";
  std::string why() const {
    return thrown([&] { const io::CaptureReader reader(path); });
  }
};

inline void expect_words(const std::string& message, const std::vector<std::string>& words) {
  for (const std::string& word : words)
    EXPECT_NE(message.find(word), std::string::npos) << word << " is not in: " << message;
}

}  // namespace tofgraph::tests
