// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/inputs.hpp"

#include "io/sha256.hpp"

#include <set>

namespace tofgraph::diagnosis {

namespace fs = std::filesystem;

std::vector<InputFile> hashed_inputs(const fs::path& model, const fs::path& data,
                                     const std::vector<io::Condition>& conditions) {
  std::vector<InputFile> inputs = {{model.string(), io::sha256_of_file(model)},
                                   {data.string(), io::sha256_of_file(data)}};
  const fs::path folder = fs::absolute(data).lexically_normal().parent_path();
  std::set<fs::path> seen;
  const auto add = [&](const fs::path& file) {
    std::error_code error;
    if (file.empty() || !fs::is_regular_file(file, error) || !seen.insert(file).second) return;
    inputs.push_back(
        {fs::absolute(file).lexically_normal().lexically_proximate(folder).generic_string(), io::sha256_of_file(file)});
  };
  for (const io::Condition& c : conditions) {
    add(c.campaign);
    add(c.capture);
    if (c.capture.empty() && c.at.source) add(c.at.source->name);  // a row of a table
  }
  return inputs;
}

}  // namespace tofgraph::diagnosis
