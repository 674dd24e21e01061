// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Checks of file formats: reaction to files that are not theirs.
#include "conformance/check.hpp"

#include <fmt/format.h>

#include <fstream>
#include <random>

namespace tofgraph::conformance {
namespace {

/// Messages of a format while it opens a file.
struct Heard {
  std::string failure;
  std::size_t arrays = 0;
};

}  // namespace

std::string refuses_rubbish(const Subject& subject) {
  const tofgraph_format& format = *subject.plugin().format;
  std::mt19937_64 random(subject.seed);
  std::size_t taken = 0;
  for (const std::size_t size : {0U, 1U, 3U, 16U, 100U, 512U, 4096U, 20000U}) {
    std::string bytes(size, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    static_cast<void>(
        format.recognises(reinterpret_cast<const std::uint8_t*>(bytes.data()), std::min<std::size_t>(size, 4096)));
    const std::filesystem::path file = subject.scratch / fmt::format("rubbish_{}.bin", size);
    std::ofstream(file, std::ios::binary) << bytes;
    Heard heard;
    tofgraph_format_host host{};
    host.size = sizeof host;
    host.context = &heard;
    host.fail = [](void* context, const char* text) { static_cast<Heard*>(context)->failure = text; };
    host.add = [](void* context, const tofgraph_file_array*) { ++static_cast<Heard*>(context)->arrays; };
    host.profile = [](void*, const char*) {};
    void* opened = format.open(file.c_str(), &host);
    if (opened == nullptr && heard.failure.empty())
      throw Violation(fmt::format("it refuses a file of {} random bytes without saying why", size));
    if (opened != nullptr) {
      ++taken;
      format.close(opened);
    }
  }
  return taken != 0 ? fmt::format("{} of 8 were taken for its own", taken) : "";
}

}  // namespace tofgraph::conformance
