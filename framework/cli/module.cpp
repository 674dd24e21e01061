// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/commands.hpp"
#include "config/paths.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

namespace tofgraph::cli {

int run_module(const std::string& name, const void* arguments) {
  const auto file = config::command_folder() / (name + ".so");
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (library == nullptr)
    throw std::runtime_error(
        fmt::format("the command '{}' cannot be loaded: {}\n         is it installed?", name, dlerror()));
  void* symbol = dlsym(library, "tofgraph_command");
  if (symbol == nullptr) throw std::runtime_error(file.string() + " has no symbol tofgraph_command");
  return reinterpret_cast<int (*)(const void*)>(symbol)(arguments);
}

}  // namespace tofgraph::cli
