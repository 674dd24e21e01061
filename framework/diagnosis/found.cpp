// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/found.hpp"

namespace tofgraph::diagnosis {

std::vector<std::string> Found::names() const {
  std::vector<std::string> all = {name};
  for (const Rival& rival : rivals) {
    if (rival.tied) all.push_back(rival.candidate->name());
  }
  return all;
}

}  // namespace tofgraph::diagnosis
