// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// tofgraph-scan FILE...: writes one line of JSON per plugin to standard output. If one crashes, only this process ends.
#include "graph/plugin.hpp"

#include <unistd.h>

#include <string>

int main(int argc, char** argv) {
  const int out = dup(STDOUT_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);  // output of plugins must not mix with the result
  constexpr unsigned seconds_for_one = 20;
  for (int i = 1; i < argc; ++i) {
    alarm(seconds_for_one);
    nlohmann::json line;
    try {
      line = tofgraph::graph::describe(tofgraph::graph::load_plugin(tofgraph::graph::plugin_file(argv[i])));
    } catch (const std::exception& error) {
      line = {{"error", error.what()}};
    }
    const std::string text = line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    if (write(out, text.data(), text.size()) != static_cast<ssize_t>(text.size())) return 1;
  }
  _exit(0);  // skips the destructors of plugins
}
