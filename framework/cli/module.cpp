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

bool join_ranks(const char* program_name) {
  if (std::filesystem::path(program_name).filename() != "tofgraph-mpi") return false;
  const auto file = config::library_folder() / "mpi.so";
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_GLOBAL | RTLD_NODELETE);  // needed by libraries that MPI loads
  void* symbol = library != nullptr ? dlsym(library, "tofgraph_set_ranks") : nullptr;
  if (symbol == nullptr)
    throw std::runtime_error(
        fmt::format("MPI cannot be used: {}\n         is the package tofgraph-mpi installed?", dlerror()));
  reinterpret_cast<void (*)()>(symbol)();
  return true;
}

}  // namespace tofgraph::cli
