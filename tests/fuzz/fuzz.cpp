// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// fuzz TARGET CORPUS... [OPTIONS of libFuzzer]. Built without libFuzzer it reads each file of the corpus once.
#include "tests/fuzz/target.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>

#include <unistd.h>

namespace tofgraph::fuzz {

const graph::PluginRegistry& plugins() {
  static const graph::PluginRegistry registry(graph::plugin_path({}));
  return registry;
}

std::filesystem::path file_of(std::string_view bytes, const std::string& name) {
  struct Folder {
    std::filesystem::path path = std::filesystem::temp_directory_path() / ("tofgraph_fuzz_" + std::to_string(getpid()));
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() { std::filesystem::remove_all(path); }
  };
  static const Folder folder;
  std::ofstream(folder.path / name, std::ios::binary) << bytes;
  return folder.path / name;
}

namespace {

std::vector<Target> targets() {
  std::vector<Target> all = document_targets();
  std::ranges::move(recording_targets(), std::back_inserter(all));
  std::ranges::move(device_targets(), std::back_inserter(all));
  return all;
}

void (*read_input)(std::string_view) = nullptr;

/// Selects the target named by the first argument, and removes that argument.
void choose(int& count, char** words) {
  const std::string name = count > 1 ? words[1] : "";
  for (const Target& target : targets()) {
    if (name == "--list") std::cout << target.name << "\t" << target.reads << "\n";
    if (target.name == name) read_input = target.read;
  }
  if (read_input == nullptr) {
    if (name != "--list") std::cerr << "usage: fuzz TARGET CORPUS...; fuzz --list prints the targets\n";
    std::exit(name == "--list" ? 0 : 2);
  }
  std::copy(words + 2, words + count + 1, words + 1);
  --count;
}

}  // namespace
}  // namespace tofgraph::fuzz

// The names are libFuzzer's.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  tofgraph::fuzz::read_input({reinterpret_cast<const char*>(bytes), size});
  return 0;
}

#ifdef TOFGRAPH_FUZZ
extern "C" int LLVMFuzzerInitialize(int* count, char*** words);
extern "C" int LLVMFuzzerInitialize(int* count, char*** words) {
  tofgraph::fuzz::choose(*count, *words);
  return 0;
}
#else
int main(int count, char** words) {
  tofgraph::fuzz::choose(count, words);
  std::size_t read = 0;
  for (int i = 1; i < count; ++i)
    for (const auto& entry : std::filesystem::directory_iterator(words[i])) {
      std::ifstream file(entry.path(), std::ios::binary);
      const std::string bytes{std::istreambuf_iterator<char>(file), {}};
      LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
      ++read;
    }
  if (read == 0) {
    std::cerr << "fuzz: the corpus is empty\n";
    return 1;
  }
}
#endif
