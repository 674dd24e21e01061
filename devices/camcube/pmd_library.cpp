// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "devices/camcube/pmd_library.hpp"

#include "config/architecture.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

namespace tofgraph::camcube {
namespace {

namespace fs = std::filesystem;

constexpr const char* file_name = "libpmdaccess2.so";
/// Platform suffix in the file names of the vendor's plugins for this program.
constexpr const char* platform = sizeof(void*) == 8 ? "L64" : "L32";

std::string sdk_folder() {
  const char* folder = std::getenv("PMDDIR");
  return folder != nullptr && *folder != '\0' ? folder : "/usr/local/pmd";
}

std::string why_not(const std::string& path, const std::string& loader_says) {
  std::error_code error;
  if (path.find('/') != std::string::npos && !fs::exists(path, error)) return path + ": there is no such file";
  if (const std::string other = config::other_architecture(path); !other.empty()) return path + ": " + other;
  return loader_says.starts_with(path) ? loader_says : path + ": " + loader_says;
}

std::string result_name(int result) {
  switch (result) {
    case pmd::disconnected:
      return "disconnected";
    case pmd::invalid_value:
      return "invalid value";
    case pmd::timed_out:
      return "timed out";
    case pmd::unknown_handle:
      return "unknown handle";
    case pmd::not_implemented:
      return "not implemented";
    case pmd::out_of_bounds:
      return "out of bounds";
    case pmd::file_not_found:
      return "file not found";
    case pmd::could_not_open:
      return "could not open";
    case pmd::data_not_found:
      return "data not found";
    case pmd::end_of_data:
      return "end of data";
    case pmd::device_is_busy:
      return "the device is busy";
    default:
      return "failed";
  }
}

}  // namespace

std::vector<std::string> PmdLibrary::candidates(const std::string& library) {
  if (!library.empty()) return {library};
  std::vector<std::string> all;
  for (const char* folder : {"lib", "bin"}) all.push_back((fs::path(sdk_folder()) / folder / file_name).string());
  all.emplace_back(file_name);
  return all;
}

PmdLibrary::PmdLibrary(const std::string& library) {
  std::vector<std::string> problems;
  for (const std::string& path : candidates(library)) {
    library_ = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    path_ = path;
    if (library_ != nullptr) return;
    const char* says = dlerror();
    problems.push_back(why_not(path, says != nullptr ? says : "cannot be loaded"));
  }
  throw NotFound(
      library.empty() ? "backend" : "library",
      fmt::format("the vendor's library cannot be used: {}; set PMDDIR to the folder of the vendor's SDK, or "
                  "give library: /path/to/{}",
                  fmt::join(problems, "; "), file_name));
}

void* PmdLibrary::symbol(const char* name) const { return dlsym(library_, name); }

std::string PmdLibrary::plugin(const std::string& name) const {
  if (name.empty() || name.find('/') != std::string::npos) return name;
  for (const char* ending : {"pap", "ppp", "pcp"}) {
    const fs::path file = fs::path(sdk_folder()) / "plugins" / fmt::format("{}.{}.{}", name, platform, ending);
    std::error_code error;
    if (fs::exists(file, error)) return file.string();
  }
  return name;
}

std::string PmdLibrary::plugins() const {
  const fs::path folder = fs::path(sdk_folder()) / "plugins";
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string ending = entry.path().extension().string();
    if (ending == ".pap" || ending == ".ppp" || ending == ".pcp") names.push_back(entry.path().filename().string());
  }
  if (names.empty()) return fmt::format("there are no plugins in {}", folder.string());
  std::ranges::sort(names);
  return fmt::format("{} has {}", folder.string(), fmt::join(names, ", "));
}

std::string PmdLibrary::error_text(pmd::Handle handle, int result) const {
  char text[512] = "";
  if (auto* get = find<pmd::GetLastError>("pmdGetLastError"); get != nullptr) get(handle, text, sizeof text);
  text[sizeof text - 1] = '\0';
  return fmt::format("{} (code {}: {})", *text != '\0' ? text : "the vendor's library gives no reason", result,
                     result_name(result));
}

}  // namespace tofgraph::camcube
