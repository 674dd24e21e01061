// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// tofgraph-check FILE CHECK SEED [PARAMETER=VALUE]...: runs one check on one plugin in the working folder, which is
// initially empty, and writes the result as a line of JSON. If the plugin crashes or loops, only this process is
// affected. tofgraph-check without arguments: prints the table of checks.
#include "config/json_text.hpp"
#include "conformance/check.hpp"
#include "graph/running_call.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <new>

namespace {

using namespace tofgraph;
using nlohmann::json;

json table() {
  json list = json::array();
  for (const conformance::Check& check : conformance::checks())
    list.push_back({{"name", check.name},
                    {"sentence", check.sentence},
                    {"kinds", check.kinds},
                    {"strictness", check.strictness},
                    {"seconds", check.seconds}});
  return list;
}

json outcome_of(const conformance::Check& check, const conformance::Subject& subject) {
  try {
    return {{"result", "passed"}, {"text", check.run(subject)}};
  } catch (const conformance::Violation& violation) {
    return {{"result", "failed"}, {"text", violation.what()}};
  } catch (const conformance::NotApplicable& reason) {
    return {{"result", "skipped"}, {"text", reason.what()}};
  } catch (const std::bad_alloc&) {
    return {{"result", "failed"}, {"text", "it asks for more memory than 8 GiB"}};
  } catch (const std::exception& error) {
    return {{"result", "failed"}, {"text", error.what()}};
  }
}

void write_line(int out, const json& value) {
  const std::string text = config::json_text(value) + "\n";
  if (write(out, text.data(), text.size()) != static_cast<ssize_t>(text.size())) _exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  const int out = dup(STDOUT_FILENO);
  if (argc == 1) {
    write_line(out, table());
    _exit(0);
  }
  dup2(STDERR_FILENO, STDOUT_FILENO);  // output of plugins must not mix with the result
  const auto all = conformance::checks();
  const auto check = std::ranges::find(all, std::string_view(argc > 3 ? argv[2] : ""), &conformance::Check::name);
  if (check == all.end()) _exit(2);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  const rlimit memory{8UL << 30U, 8UL << 30U};
  setrlimit(RLIMIT_AS, &memory);
#endif
  graph::install_crash_handler();
  write_line(
      out,
      outcome_of(*check, {argv[1], std::stoull(argv[3]), {argv + 4, argv + argc}, std::filesystem::current_path()}));
  _exit(0);  // skips the destructors of plugins, which are not checked
}
