// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "foreign/series.hpp"

#include "foreign/foreign_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace tofgraph::foreign {
namespace {

bool matches(std::string_view text, std::string_view like) {
  if (like.empty()) return text.empty();
  if (like[0] == '*') return matches(text, like.substr(1)) || (!text.empty() && matches(text.substr(1), like));
  return !text.empty() && (like[0] == '?' || like[0] == text[0]) && matches(text.substr(1), like.substr(1));
}

/// Adds a file, or those that a pattern matches, by name.
void add_matching(const std::string& pattern, std::vector<std::filesystem::path>& files) {
  const std::filesystem::path path(pattern);
  const std::string name = path.filename().string();
  if (name.find_first_of("*?") == std::string::npos) return files.push_back(path);
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  std::vector<std::filesystem::path> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.is_regular_file() && matches(entry.path().filename().string(), name)) found.push_back(entry.path());
  }
  if (found.empty()) throw ForeignError(fmt::format("{}: no file matches this pattern", pattern));
  std::ranges::sort(found);
  files.insert(files.end(), found.begin(), found.end());
}

}  // namespace

std::optional<std::uint64_t> number_of(const std::filesystem::path& file) {
  const std::string stem = file.stem().string();
  const auto last = stem.find_last_of("0123456789");
  if (last == std::string::npos) return std::nullopt;
  const auto before = stem.find_last_not_of("0123456789", last);
  const std::string digits = stem.substr(before == std::string::npos ? 0 : before + 1, last - before);
  if (digits.size() > 18) return std::nullopt;
  return std::stoull(digits);
}

std::vector<std::filesystem::path> files_of(const std::string& patterns) {
  std::vector<std::filesystem::path> files;
  for (std::size_t at = 0; at <= patterns.size();) {
    const std::size_t end = std::min(patterns.find('\n', at), patterns.size());
    add_matching(patterns.substr(at, end - at), files);
    at = end + 1;
  }
  std::ranges::stable_sort(files, [](const std::filesystem::path& a, const std::filesystem::path& b) {
    const auto x = number_of(a), y = number_of(b);
    return x && y && *x < *y;
  });
  return files;
}

}  // namespace tofgraph::foreign
