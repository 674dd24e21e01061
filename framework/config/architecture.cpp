// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/architecture.hpp"

#include <elf.h>
#include <fmt/format.h>

#include <algorithm>
#include <fstream>

namespace tofgraph::config {
namespace {

std::string machine_name(unsigned machine) {
  switch (machine) {
    case EM_386:
      return "x86 of 32 bits";
    case EM_X86_64:
      return "x86-64";
    case EM_ARM:
      return "ARM of 32 bits";
    case EM_AARCH64:
      return "ARM of 64 bits";
    default:
      return fmt::format("machine {}", machine);
  }
}

/// Machine for which a library file was built, or nothing.
unsigned machine_of(const std::string& path) {
  unsigned char head[20] = {};
  std::ifstream(path, std::ios::binary).read(reinterpret_cast<char*>(head), sizeof head);
  if (!std::equal(head, head + SELFMAG, ELFMAG)) return EM_NONE;
  const bool big = head[EI_DATA] == ELFDATA2MSB;
  return big ? unsigned{head[18]} << 8U | head[19] : unsigned{head[19]} << 8U | head[18];
}

}  // namespace

std::string other_architecture(const std::string& library) {
  const unsigned its = machine_of(library), ours = machine_of("/proc/self/exe");
  if (its == EM_NONE || its == ours) return {};
  return fmt::format("is for another architecture: {}, this program is {}", machine_name(its), machine_name(ours));
}

}  // namespace tofgraph::config
