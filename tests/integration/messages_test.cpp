// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Catalogue of errors: each file in tests/fixtures/errors is wrong in one way (NAME.yaml is checked, NAME.args are
// arguments of `run`, NAME.calibrate of `calibrate`), NAME.expected is the exact message to the user.
#include "tests/program.hpp"

#include <algorithm>
#include <vector>

namespace tofgraph::tests {
namespace {

const std::filesystem::path folder = TOFGRAPH_SOURCE_DIR "/tests/fixtures/errors";

std::vector<std::string> cases() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.is_regular_file() && entry.path().extension() != ".expected")
      names.push_back(entry.path().filename().string());
  }
  std::ranges::sort(names);
  return names;
}

class Message : public testing::TestWithParam<std::string> {};

TEST_P(Message, IsAsWritten) {
  const std::filesystem::path file = folder / GetParam();
  std::string arguments = "check " + GetParam();
  if (file.extension() == ".calibrate") arguments = "calibrate " + read_text(file);
  if (file.extension() == ".args") arguments = "run " + read_text(file);
  if (!arguments.empty() && arguments.back() == '\n') arguments.pop_back();
  const Outcome outcome = shell("\"$TOFGRAPH\" " + arguments, folder);
  std::string said = outcome.err;
  // The build folder first: it may lie inside the source folder.
  for (const auto& [path, word] :
       {std::pair<std::string, std::string>{TOFGRAPH_BINARY_DIR, "BUILD"}, {TOFGRAPH_SOURCE_DIR, "SOURCE"}}) {
    for (std::size_t at = 0; (at = said.find(path)) != std::string::npos;) said.replace(at, path.size(), word);
  }
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(said, read_text(std::filesystem::path(file).replace_extension(".expected")));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.txt")) << "an output was touched";
}

INSTANTIATE_TEST_SUITE_P(PluginRegistry, Message, testing::ValuesIn(cases()), [](const auto& info) {
  std::string name = info.param;
  std::ranges::replace(name, '.', '_');
  return name;
});

}  // namespace
}  // namespace tofgraph::tests
