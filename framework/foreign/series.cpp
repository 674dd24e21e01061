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

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Natural order of file names: runs of digits compare as numbers, other text by characters.
bool comes_before(const std::filesystem::path& first, const std::filesystem::path& second) {
  const std::string x = first.string(), y = second.string();
  std::size_t i = 0, j = 0;
  while (i < x.size() && j < y.size()) {
    if (is_digit(x[i]) && is_digit(y[j])) {
      const auto run = [](const std::string& text, std::size_t& at) {
        while (at < text.size() && text[at] == '0') ++at;
        const std::size_t begin = at;
        while (at < text.size() && is_digit(text[at])) ++at;
        return std::string_view(text).substr(begin, at - begin);
      };
      const std::string_view a = run(x, i), b = run(y, j);
      if (a.size() != b.size()) return a.size() < b.size();
      if (a != b) return a < b;
      continue;
    }
    if (x[i] != y[j]) return x[i] < y[j];
    ++i;
    ++j;
  }
  return x.size() - i < y.size() - j;
}

/// Adds a file, or all files that match a pattern, in the natural order of their names.
void add_matching(const std::string& pattern, std::vector<std::filesystem::path>& files) {
  const std::filesystem::path path(pattern);
  const std::string name = path.filename().string();
  if (name.find_first_of("*?") == std::string::npos) return files.push_back(path);
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  std::vector<std::filesystem::path> found;
  try {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.is_regular_file() && matches(entry.path().filename().string(), name)) found.push_back(entry.path());
    }
  } catch (const std::filesystem::filesystem_error& error) {
    throw ForeignError(fmt::format("{}: the folder cannot be read: {}", pattern, error.code().message()));
  }
  if (found.empty()) throw ForeignError(fmt::format("{}: no file matches this pattern", pattern));
  files.insert(files.end(), found.begin(), found.end());
}

}  // namespace

std::vector<std::uint64_t> file_numbers(const std::vector<std::filesystem::path>& files) {
  std::vector<std::uint64_t> numbers;
  std::string around;
  for (const std::filesystem::path& file : files) {
    const std::string stem = file.stem().string();
    const auto last = stem.find_last_of("0123456789");
    if (last == std::string::npos) return {};
    const auto before = stem.find_last_not_of("0123456789", last);
    const std::size_t first = before == std::string::npos ? 0 : before + 1;
    if (last + 1 - first > 18) return {};
    const std::string text = file.parent_path().string() + "/" + stem.substr(0, first) + "#" + stem.substr(last + 1);
    const std::uint64_t number = std::stoull(stem.substr(first, last + 1 - first));
    if (!numbers.empty() && (text != around || number <= numbers.back())) return {};
    around = text;
    numbers.push_back(number);
  }
  return numbers;
}

std::vector<std::filesystem::path> files_of(const std::string& patterns) {
  std::vector<std::filesystem::path> files;
  for (std::size_t at = 0; at <= patterns.size();) {
    const std::size_t end = std::min(patterns.find('\n', at), patterns.size());
    add_matching(patterns.substr(at, end - at), files);
    at = end + 1;
  }
  std::ranges::stable_sort(files, comes_before);
  return files;
}

}  // namespace tofgraph::foreign
