// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Fixture of tests that convert files of other programs into a capture of the small camera.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/small_capture.hpp"
#include "tests/unit/raw_capture.hpp"

namespace tofgraph::tests {

class SmallConversion : public testing::Test {
 protected:
  void SetUp() override { write_text(path("tiny.yaml"), small_profile); }
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  Outcome tofgraph(const std::string& arguments) const { return shell("$TOFGRAPH " + arguments, folder_.path()); }
  Outcome convert(const std::string& arguments) const {
    return tofgraph("convert " + arguments + " -o out.h5 --camera ./tiny.yaml --force");
  }
  /// Debian's own Python, for which bootstrap installs NumPy and SciPy. @returns whether it succeeded
  bool python(const std::string& script) const {
    write_text(path("write.py"), "import numpy as np\n" + script);
    const Outcome outcome = shell("/usr/bin/python3 write.py", folder_.path());
    EXPECT_TRUE(outcome.exit_code == 0 || outcome.err.find("ModuleNotFoundError") != std::string::npos) << outcome.err;
    return outcome.exit_code == 0;
  }
  /// Elements stored by a script with ndarray.tofile().
  template <class T> std::vector<T> stored(const std::string& name) const {
    const std::string bytes = read_text(path(name));
    std::vector<T> values(bytes.size() / sizeof(T));
    std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
    return values;
  }
  /// All frames of a channel of the capture.
  template <class T> std::vector<T> frames(const std::string& channel) const {
    return raw_values<T>(path("out.h5"), "/frames/" + channel);
  }
  TemporaryFolder folder_;
};

}  // namespace tofgraph::tests
